// The plotter in a real browser, in front of a sketch that runs: its lines, axes, legend, pause and
// clear. A second page, which is not paused, shows that lines come meanwhile.
//
//   node plotter_in_browser.mjs ADDRESS [PICTURE]
//
// upload_test.py calls it with the sketch "saw": up:N down:-N, N from 0 to 99, again and again.
import assert from 'node:assert/strict';
import { startBrowser, whatNoBrowserCanDoWithout } from '../browser/stack.mjs';

const [address, picture] = process.argv.slice(2);
const missing = whatNoBrowserCanDoWithout();
if (missing) {
  console.log(`skipped: ${missing}`);
  process.exit(77);
}

const WAIT = { timeout: 60_000 };
const browser = await startBrowser({ draws: false });
process.on('exit', () => browser.close());

/** A page that notes what it writes into its picture. */
async function open(size = { width: 1000, height: 600 }) {
  const page = await browser.newPage({ viewport: size });
  page.on('pageerror', (error) => { throw error; });
  await page.addInitScript(() => {
    const write = CanvasRenderingContext2D.prototype.fillText, clear = CanvasRenderingContext2D.prototype.clearRect;
    window.written = [];
    CanvasRenderingContext2D.prototype.clearRect = function (...all) { window.written = []; return clear.apply(this, all); };
    CanvasRenderingContext2D.prototype.fillText = function (text, x, y) { window.written.push({ text, x, y }); return write.call(this, text, x, y); };
  });
  await page.goto(address);
  return page;
}

const linesOf = async (page) => Number(/(\d+) lines?$/.exec(await page.locator('#count').textContent())?.[1] ?? 0);
const untilLines = (page, least) =>
  page.waitForFunction((n) => Number(/(\d+) lines?$/.exec(document.querySelector('#count').textContent)?.[1] ?? 0) >= n, least, WAIT);

/** In one instant: the legend, the words on the axes, and where each curve has its colour. */
const look = (page) => page.evaluate(() => {
  const chart = document.querySelector('canvas'), pen = chart.getContext('2d');
  const { data, width } = pen.getImageData(0, 0, chart.width, chart.height);
  const curves = [...document.querySelectorAll('#legend li')].map((item) => {
    const colour = item.querySelector('line').getAttribute('stroke').slice(1).match(/../g).map((part) => parseInt(part, 16));
    const rows = new Set(), columns = new Set();
    for (let i = 0; i < data.length; i += 4) {
      if (data[i + 3] === 255 && colour.every((level, channel) => Math.abs(data[i + channel] - level) < 8)) {
        rows.add(Math.floor(i / 4 / width));
        columns.add((i / 4) % width);
      }
    }
    return { text: item.textContent, top: Math.min(...rows), bottom: Math.max(...rows), columns: columns.size };
  });
  return { curves, words: window.written, picture: chart.toDataURL(), state: document.querySelector('#state').textContent };
});

const page = await open(), other = await open({ width: 360, height: 640 });
await untilLines(page, 150);
assert.ok(await page.locator('#empty').isHidden(), 'the hint is gone');

// Paused, so that the legend and the picture are of one instant.
await page.getByRole('button', { name: 'Pause' }).click();
await page.waitForFunction(() => document.querySelector('#state').textContent === 'paused', null, WAIT);
const paused = await look(page), pausedLines = await linesOf(page);

const values = paused.curves.map(({ text }) => /^(up|down): (-?\d+)$/.exec(text)?.slice(1));
assert.deepEqual(values.map(([name]) => name), ['up', 'down'], 'each curve has its label');
assert.equal(Number(values[0][1]) + Number(values[1][1]), 0, 'the latest values are of one line');

const axis = paused.words.filter(({ text }) => ['-100', '-50', '0', '50', '100'].includes(text));
const at = (text) => paused.words.find((word) => word.text === text && word.x < 60).y;
assert.ok(axis.length >= 5, `the axis of values: ${JSON.stringify(paused.words)}`);
assert.ok(at('100') < at('50') && at('50') < at('0') && at('0') < at('-100'), 'it grows upwards');
const [up, down] = paused.curves;
assert.ok(up.top >= at('100') - 3 && up.bottom <= at('0') + 3, `up lies between 0 and 100: ${JSON.stringify(up)}`);
assert.ok(down.top >= at('0') - 3 && down.bottom <= at('-100') + 3, `down lies below: ${JSON.stringify(down)}`);
assert.ok(up.bottom - up.top > 0.9 * (at('0') - at('100')), 'all of the saw is there');
for (const { columns, text } of paused.curves) assert.ok(columns > 0.2 * 1000, `${text} is a line, not a point: ${columns}`);
const lines = paused.words.filter(({ y }) => y > at('-100')).map(({ text }) => Number(text));
assert.ok(lines.length >= 2 && lines.every((line) => line % 100 === 0), `the axis of lines counts in hundreds: ${lines}`);
if (picture) await page.screenshot({ path: picture });

// Lines come meanwhile: they are not shown, and not lost.
await untilLines(other, pausedLines + 30);
const still = await look(page);
assert.equal(still.picture, paused.picture, 'a paused picture stands still');
assert.deepEqual(still.curves.map(({ text }) => text), paused.curves.map(({ text }) => text));
await page.setViewportSize({ width: 900, height: 600 });  // it is drawn once more
await page.waitForFunction(() => document.querySelector('canvas').width === 900, null, WAIT);
assert.deepEqual((await look(page)).curves.map(({ text }) => text), paused.curves.map(({ text }) => text));
await page.getByRole('button', { name: 'Go on' }).click();
await untilLines(page, pausedLines + 30);
assert.equal((await look(page)).state, 'live');

// A narrow page has all of it, side by side or below each other.
const overflow = await other.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
assert.equal(overflow, 0, 'nothing hangs out of a narrow page');
assert.equal((await look(other)).curves.length, 2);
if (picture) await other.screenshot({ path: picture.replace(/(\.\w+)$/, '-narrow$1') });

const before = await linesOf(page);
await page.getByRole('button', { name: 'Clear' }).click();
await page.waitForFunction((n) => Number(/(\d+) lines?$/.exec(document.querySelector('#count').textContent)[1]) < n, before, WAIT);
await untilLines(page, 20);
assert.equal((await look(page)).curves.length, 2, 'it begins anew');
console.log(`the plotter drew ${before} lines`);
await browser.close();
