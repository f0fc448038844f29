// How a line of Serial becomes points, as in the Arduino IDE's plotter, and what is kept of them.
//
//   23.5,40            two curves without names
//   in:23.5 out:-4     two with names; comma, blank and tab separate
//   in out             a line of words names the curves of the lines after it

export const POINTS_KEPT = 500;
export const CURVES_MAX = 12;
const NUMBER = /^[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$/i;

/** [{name, value}] of a line; `names` are those of curves without one. Fields that are no number are left out. */
export function pointsOf(line, names = []) {
  const points = [];
  for (const field of fieldsOf(line)) {
    const colon = field.lastIndexOf(":");
    const number = field.slice(colon + 1);
    if (!NUMBER.test(number)) continue;
    const unnamed = names[points.length] ?? `value ${points.length + 1}`;
    points.push({ name: colon > 0 ? field.slice(0, colon) : unnamed, value: Number(number) });
  }
  return points.slice(0, CURVES_MAX);
}

/** The names that a line of words alone gives to the curves; empty: it is none. */
export function namesOf(line) {
  const fields = fieldsOf(line);
  return fields.some((field) => NUMBER.test(field.slice(field.lastIndexOf(":") + 1))) ? [] : fields.slice(0, CURVES_MAX);
}

function fieldsOf(line) {
  return line.trim().replace(/:[ \t]+/g, ":").split(/[,;\t ]+/).filter((field) => field !== "");
}

/** The curves: of each the last POINTS_KEPT lines, null where a line had no value for it. */
export class Curves {
  constructor() {
    this.byName = new Map();
    this.names = [];
    this.lines = 0;
  }

  take(line) {
    const points = pointsOf(line, this.names);
    if (points.length === 0) {
      this.names = namesOf(line);
      return;
    }
    this.lines += 1;
    for (const { name } of points) {
      if (!this.byName.has(name) && this.byName.size < CURVES_MAX) this.byName.set(name, new Array(this.kept() - 1).fill(null));
    }
    const values = new Map(points.map(({ name, value }) => [name, value]));
    for (const [name, curve] of this.byName) {
      curve.push(values.get(name) ?? null);
      if (curve.length > POINTS_KEPT) curve.shift();
    }
  }

  /** How many lines there are points of. */
  kept() {
    return Math.min(this.lines, POINTS_KEPT);
  }

  clear() {
    this.byName.clear();
    this.names = [];
    this.lines = 0;
  }
}

/** The limits of the axis of values, and where its lines are: 1, 2 or 5 times a power of ten apart, about `wanted` of them. */
export function axisOf(low, high, wanted) {
  if (!(high > low)) [low, high] = [low - 1, high + 1];
  const rough = (high - low) / Math.max(1, wanted);
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((times) => times * power).find((one) => one >= rough * 0.999) ?? rough;
  const first = Math.floor(low / step + 1e-9), last = Math.ceil(high / step - 1e-9);
  const ticks = [];
  for (let i = first; i <= last; i += 1) ticks.push(Number((i * step).toPrecision(12)));
  return { low: ticks[0], high: ticks[ticks.length - 1], ticks };
}
