// How dark the bed is under and around the part, so that it stands there and does not float: the
// light that the part takes away from each place of the bed. It is worked out once, while the
// layers come, and drawn as triangles on the bed that are as dark as their corners. (A texture
// took four times as long without a graphics card.) Pure.
//
//        sun ╲      │part│          what lies low takes most (contact), what is higher less,
//             ╲     │    │          and further away from the sun
//    ──────────░░▒▒▓▓████▓▒░─────   then all of it is softened
import type { LayerRecord } from '../layers';
import type { Box } from './orbit';
import { BESIDE } from './segments';

const CELLS_MAX = 160; // along a side: their corners are counted in 16 bits
const CELL_MM = 2;
const FAINTEST = 0.012; // nobody sees less
const FADES_MM = 14; // the height above which a part hardly darkens the bed
const HIGHEST_MM = 40;
const SOFT_MM = 4;
const MARGIN_MM = 16; // beside the bed

export class Shade {
  readonly width: number;
  readonly height: number;
  /** It has changed since it was last asked for. */
  fresh = true;
  private readonly cell_mm: number;
  private readonly low: number[];
  private readonly taken: Float32Array;

  /** `sun`: towards it. */
  constructor({ min, max }: Box, private readonly sun: number[]) {
    const spans = [0, 1].map((i) => max[i] - min[i] + 2 * MARGIN_MM);
    this.cell_mm = Math.max(CELL_MM, Math.max(...spans) / CELLS_MAX);
    [this.width, this.height] = spans.map((span) => Math.ceil(span / this.cell_mm));
    this.low = [min[0] - MARGIN_MM, min[1] - MARGIN_MM];
    this.taken = new Float32Array(this.width * this.height);
  }

  clear(): void {
    this.taken.fill(0);
    this.fresh = true;
  }

  /** Adds the shade of the part itself: a skirt lies flat. */
  add({ ends, features, segments }: LayerRecord): void {
    const { taken, width, height, cell_mm, low } = this;
    for (let i = 0; i < segments; i++) {
      const at = 6 * i;
      const z_mm = ends[at + 5];
      if (z_mm > HIGHEST_MM || BESIDE.includes(features[i])) continue;
      const light = Math.exp(-z_mm / FADES_MM);
      const away = 0.5 * z_mm / this.sun[2];
      const [x, y] = [ends[at] - away * this.sun[0] - low[0], ends[at + 1] - away * this.sun[1] - low[1]];
      const [alongX, alongY] = [ends[at + 3] - ends[at], ends[at + 4] - ends[at + 1]];
      const steps = Math.max(1, Math.ceil(Math.hypot(alongX, alongY) / cell_mm));
      for (let step = 0; step <= steps; step++) {
        const column = Math.floor((x + (alongX * step) / steps) / cell_mm);
        const row = Math.floor((y + (alongY * step) / steps) / cell_mm);
        if (column < 0 || row < 0 || column >= width || row >= height) continue;
        const cell = row * width + column;
        if (taken[cell] < light) taken[cell] = light;
      }
    }
    this.fresh = true;
  }

  /** Where it is to be seen: x and y in mm, and the share of the light that is taken. */
  triangles(): { corners: Float32Array; indices: Uint16Array } {
    this.fresh = false;
    const { width, height, cell_mm, low } = this;
    const soft = this.softened();
    const corners: number[] = [];
    const indices: number[] = [];
    const known = new Map<number, number>();
    const corner = (cell: number): number => {
      const number = known.get(cell) ?? corners.length / 3;
      if (number === corners.length / 3) corners.push(low[0] + ((cell % width) + 0.5) * cell_mm, low[1] + (Math.floor(cell / width) + 0.5) * cell_mm, soft[cell]);
      known.set(cell, number);
      return number;
    };
    for (let row = 0; row + 1 < height; row++) {
      for (let column = 0; column + 1 < width; column++) {
        const at = row * width + column;
        if (Math.max(soft[at], soft[at + 1], soft[at + width], soft[at + width + 1]) < FAINTEST) continue;
        const [a, b, c, d] = [at, at + 1, at + width, at + width + 1].map(corner);
        indices.push(a, b, c, c, b, d);
      }
    }
    return { corners: new Float32Array(corners), indices: new Uint16Array(indices) };
  }

  /** Three means after one another are nearly a bell curve. */
  private softened(): Float32Array {
    const { width, height } = this;
    const reach = Math.max(1, Math.round(SOFT_MM / this.cell_mm / 2));
    let soft = this.taken;
    for (let round = 0; round < 3; round++) {
      soft = means(soft, width, height, 1, width, reach);
      soft = means(soft, height, width, width, 1, reach);
    }
    return soft;
  }
}

/** The mean of each place and `reach` on both sides, along lines of `length` places. */
function means(from: Float32Array, length: number, lines: number, step: number, between: number, reach: number): Float32Array {
  const to = new Float32Array(from.length);
  for (let line = 0; line < lines; line++) {
    const first = line * between;
    let sum = 0;
    for (let i = -reach; i < length; i++) {
      if (i + reach < length) sum += from[first + (i + reach) * step];
      if (i - reach - 1 >= 0) sum -= from[first + (i - reach - 1) * step];
      if (i >= 0) to[first + i * step] = sum / (2 * reach + 1);
    }
  }
  return to;
}
