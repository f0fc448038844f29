// How the plotter reads a line, what it keeps, and where its axis has lines.
import assert from "node:assert/strict";
import test from "node:test";
import { readFile } from "node:fs/promises";

// The browser's module, whose folder says nothing of modules to node.
const source = await readFile(new URL("../../../qduino/monitor/plotter/series.js", import.meta.url), "utf8");
const { Curves, CURVES_MAX, POINTS_KEPT, axisOf, namesOf, pointsOf } = await import("data:text/javascript," + encodeURIComponent(source));

const flat = (line, names) => pointsOf(line, names).map(({ name, value }) => `${name}=${value}`).join(" ");

test("comma, semicolon, blank and tab separate; a name stands before a colon", () => {
  assert.equal(flat("1, 2.5\t-3e2 +.5"), "value 1=1 value 2=2.5 value 3=-300 value 4=0.5");
  assert.equal(flat("in:23.5,out: -4"), "in=23.5 out=-4");
  assert.equal(flat("a:b:7"), "a:b=7");
  assert.equal(flat("heap 80 % free:12"), "value 1=80 free=12");
  assert.equal(flat("1 2", ["left", "right"]), "left=1 right=2");
  for (const line of ["", "hello world", "nan", "0x10", "1e", "--1", "12px"]) assert.equal(flat(line), "", line);
});

test("words alone name the curves of the lines after them", () => {
  assert.deepEqual(namesOf("left,right"), ["left", "right"]);
  assert.deepEqual(namesOf("left:1"), []);
  const curves = new Curves();
  for (const line of ["left right", "1 2", "3 4"]) curves.take(line);
  assert.deepEqual([...curves.byName], [["left", [1, 3]], ["right", [2, 4]]]);
});

test("a line without a value leaves a gap, and curves stay together", () => {
  const curves = new Curves();
  for (const line of ["a:1", "a:2 b:5", "b:6", "nothing", "a:4"]) curves.take(line);
  assert.deepEqual([...curves.byName], [["a", [1, 2, null, 4]], ["b", [null, 5, 6, null]]]);
  assert.equal(curves.lines, 4);
});

test("the last points are kept, and no more curves than there is room for", () => {
  const curves = new Curves();
  for (let i = 0; i < POINTS_KEPT + 20; i += 1) curves.take(`n:${i}`);
  curves.take("late:1 n:7");
  const [n, late] = [curves.byName.get("n"), curves.byName.get("late")];
  assert.equal(n.length, POINTS_KEPT);
  assert.deepEqual([n[0], n.at(-1)], [21, 7]);
  assert.equal(late.length, POINTS_KEPT);
  assert.deepEqual([late.at(-2), late.at(-1)], [null, 1]);
  for (let i = 0; i < 40; i += 1) curves.take(`c${i}:1`);
  assert.equal(curves.byName.size, CURVES_MAX);
});

test("an axis holds its values, in steps of 1, 2 or 5", () => {
  assert.deepEqual(axisOf(0, 10, 5).ticks, [0, 2, 4, 6, 8, 10]);
  assert.deepEqual(axisOf(-0.3, 0.31, 4).ticks, [-0.4, -0.2, 0, 0.2, 0.4]);
  assert.deepEqual(axisOf(5, 5, 2).ticks, [4, 5, 6]);
  let seed = 1;
  const random = () => (seed = (seed * 48271) % 2147483647) / 2147483647;
  for (let i = 0; i < 5000; i += 1) {
    const low = (random() - 0.5) * 10 ** Math.floor(random() * 8 - 2), high = low + random() * 10 ** Math.floor(random() * 8 - 2) + 1e-6 * Math.abs(low) + 1e-9;
    const { ticks, low: begin, high: end } = axisOf(low, high, 6);
    const step = ticks[1] - ticks[0], width = end - begin;
    assert.ok(begin <= low + step * 1e-6 && end >= high - step * 1e-6, `${low} … ${high}: ${ticks}`);
    assert.ok(ticks.length >= 2 && ticks.length <= 10, `${ticks.length} of ${low} … ${high}`);
    const leading = Number((step / 10 ** Math.floor(Math.log10(step * 1.0001))).toPrecision(3));
    assert.ok([1, 2, 5].includes(leading), `${step} of ${width}`);
  }
});
