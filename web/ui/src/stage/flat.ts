// The part where there is no WebGL: a still picture of some thousands of its lines, which any
// processor draws in a few milliseconds.
import { cssColour, FEATURE_COLOURS, type LayerRecord } from '../layers';
import type { Flat } from './messages';
import type { Orbit } from './orbit';
import type { Range } from './segments';

const LINES_MAX = 6000;

/** Every n-th segment of a job. */
export class Sketch {
  private every = 1;
  private seen = 0;
  private ends: number[] = [];
  private features: number[] = [];
  private places: number[] = [];

  begin(segments: number): void {
    Object.assign(this, { every: Math.max(1, Math.ceil(segments / LINES_MAX)), seen: 0, ends: [], features: [], places: [] });
  }

  add(record: LayerRecord): void {
    for (let i = (this.every - (this.seen % this.every)) % this.every; i < record.segments; i += this.every) {
      this.ends.push(...record.ends.subarray(6 * i, 6 * i + 6));
      this.features.push(record.features[i]);
      this.places.push(this.seen + i);
    }
    this.seen += record.segments;
  }

  /** As it looks from `orbit`, as far as `shown` goes; `bed`: ends of the bed's lines, mm. */
  flat(orbit: Orbit, matrix: Float32Array, shown: Range[], bed: number[]): Flat {
    const lines: number[] = [];
    const features: number[] = [];
    const flatten = (ends: number[], at: number, to: number[]) =>
      to.push(...orbit.project(matrix, ends[at], ends[at + 1], ends[at + 2]), ...orbit.project(matrix, ends[at + 3], ends[at + 4], ends[at + 5]));
    this.places.forEach((place, i) => {
      if (!shown.some(({ first, count }) => place >= first && place < first + count)) return;
      flatten(this.ends, 6 * i, lines);
      features.push(this.features[i]);
    });
    const ground: number[] = [];
    for (let at = 0; at < bed.length; at += 6) flatten(bed, at, ground);
    return { lines: new Float32Array(lines), features: new Uint8Array(features), bed: new Float32Array(ground) };
  }
}

type Context = CanvasRenderingContext2D | OffscreenCanvasRenderingContext2D;

/** `ratio`: device pixels in a CSS pixel. */
export function paintFlat(context: Context, { lines, features, bed }: Flat, ratio: number, bedColour: string): void {
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, context.canvas.width, context.canvas.height);
  const stroke = (colour: string, from: Float32Array, wanted: (i: number) => boolean) => {
    context.beginPath();
    for (let i = 0; 4 * i < from.length; i++) {
      if (!wanted(i)) continue;
      context.moveTo(from[4 * i], from[4 * i + 1]);
      context.lineTo(from[4 * i + 2], from[4 * i + 3]);
    }
    context.strokeStyle = colour;
    context.stroke();
  };
  context.lineWidth = 1;
  stroke(bedColour, bed, () => true);
  for (const feature of new Set(features)) stroke(cssColour(FEATURE_COLOURS[feature] ?? FEATURE_COLOURS[0]), lines, (i) => features[i] === feature);
}
