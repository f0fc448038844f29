// The segments of a job as the graphics card takes them, and which of them are shown. Pure.
//
// 32 bytes a segment, in the order of the job:
//
//     0  x y z of its beginning   float32, mm        24  red green blue ·      uint8, linear light
//    12  x y z of its end         float32, mm        28  width height          uint16, µm
import { FEATURE_COLOURS, segmentsDone, type LayerRecord } from '../layers';
import type { Box } from './orbit';

export const SEGMENT_BYTES = 32;
export const TINT_AT = 24;
export const SECTION_AT = 28;
const WIDTH_UM = 450; // where the file does not say it
const HEIGHT_UM = 200;

export function packSegments(record: LayerRecord): ArrayBuffer {
  const buffer = new ArrayBuffer(record.segments * SEGMENT_BYTES);
  const floats = new Float32Array(buffer);
  const bytes = new Uint8Array(buffer);
  const shorts = new Uint16Array(buffer);
  const height_um = record.height_mm > 0 ? Math.min(65535, record.height_mm * 1000) : HEIGHT_UM;
  // Every other layer a little darker, so that layers can be told apart from the side.
  const shade = (record.layer & 1 ? 0.88 : 1) * 255;
  for (let i = 0; i < record.segments; i++) {
    for (let n = 0; n < 6; n++) floats[8 * i + n] = record.ends[6 * i + n];
    const [r, g, b] = FEATURE_COLOURS[record.features[i]] ?? FEATURE_COLOURS[0];
    bytes.set([r * shade, g * shade, b * shade, 255], SEGMENT_BYTES * i + TINT_AT);
    shorts.set([record.widths_um[i] || WIDTH_UM, height_um], (SEGMENT_BYTES * i + SECTION_AT) / 2);
  }
  return buffer;
}

/** Segments from `first` on, by their numbers in the job. */
export interface Range {
  first: number;
  count: number;
}

export const countOf = (ranges: Range[]): number => ranges.reduce((sum, { count }) => sum + count, 0);

/** A record without its segments: where they are, and when each is laid down. */
export type Known = Pick<LayerRecord, 'layer' | 'segments' | 'bytes'>;

/** What is laid down after `executed` bytes, without the layers from `top` on (null: all). */
export function shownRanges(records: Known[], executed: number, top: number | null): Range[] {
  const out: Range[] = [];
  let first = 0;
  for (const record of records) {
    const hidden = top !== null && record.layer >= top;
    const count = hidden ? 0 : executed === Infinity ? record.segments : segmentsDone(record as LayerRecord, executed);
    const last = out[out.length - 1];
    if (count > 0 && last && last.first + last.count === first) last.count += count;
    else if (count > 0) out.push({ first, count });
    first += record.segments;
  }
  return out;
}

/** What `now` has beyond `before`; null: something of `before` is gone, so all is drawn anew. */
export function added(before: Range[], now: Range[]): Range[] | null {
  const out: Range[] = [];
  for (const [i, range] of now.entries()) {
    const old = before[i];
    if (!old) {
      out.push({ ...range });
      continue;
    }
    if (old.first !== range.first || old.count > range.count) return null;
    // One that has grown up to the next is another list.
    if (i < before.length - 1 && old.count !== range.count) return null;
    if (range.count > old.count) out.push({ first: old.first + old.count, count: range.count - old.count });
  }
  return before.length > now.length ? null : out;
}

/** Takes up to `most` segments from the front of `ranges`. */
export function takeFrom(ranges: Range[], most: number): Range[] {
  const out: Range[] = [];
  let left = most;
  while (left > 0 && ranges.length > 0) {
    const range = ranges[0];
    const count = Math.min(left, range.count);
    out.push({ first: range.first, count });
    left -= count;
    if (count === range.count) ranges.shift();
    else ranges[0] = { first: range.first + count, count: range.count - count };
  }
  return out;
}

const STRIDE_MAX = 7; // segments: WebGL takes a stride of at most 255 bytes
const BLOCK = 512;

/**
 * Every `step`-th segment of `ranges`, about: as ranges, and the stride in them. Above STRIDE_MAX
 * whole blocks are left out as well.
 */
export function thinned(ranges: Range[], step: number): { ranges: Range[]; stride: number } {
  if (step <= STRIDE_MAX) return { ranges, stride: step };
  const every = Math.ceil(step / STRIDE_MAX) * BLOCK;
  const out: Range[] = [];
  for (const { first, count } of ranges) {
    for (let at = 0; at < count; at += every) out.push({ first: first + at, count: Math.min(BLOCK, count - at) });
  }
  return { ranges: out, stride: STRIDE_MAX };
}

const OTHER = 0;
export const BESIDE = [9, 14]; // skirt and custom: drawn before the part, beside it

/** A box that grows. */
class Growing {
  min = [Infinity, Infinity, Infinity];
  max = [-Infinity, -Infinity, -Infinity];
  take(ends: Float32Array, at: number): void {
    for (let axis = 0; axis < 3; axis++) {
      this.min[axis] = Math.min(this.min[axis], ends[at + axis], ends[at + 3 + axis]);
      this.max[axis] = Math.max(this.max[axis], ends[at + axis], ends[at + 3 + axis]);
    }
  }
  box(): Box | null {
    return this.min[0] <= this.max[0] ? { min: [this.min[0], this.min[1], 0], max: [...this.max] } : null;
  }
}

/**
 * Where the part itself lies: without skirt and priming line. Where the slicer does not name what
 * it extrudes, a priming line lies in the lowest layer alone, so what is above it tells the place.
 */
export class Extent {
  private named = new Growing();
  private above = new Growing();
  private all = new Growing();
  private lowest_mm = Infinity;

  take(record: LayerRecord): void {
    for (let i = 0; i < record.segments; i++) {
      const feature = record.features[i];
      const z_mm = record.ends[6 * i + 5];
      if (z_mm < this.lowest_mm) this.lowest_mm = z_mm;
      this.all.take(record.ends, 6 * i);
      if (feature !== OTHER && !BESIDE.includes(feature)) this.named.take(record.ends, 6 * i);
      else if (feature === OTHER && z_mm > this.lowest_mm + 0.01) this.above.take(record.ends, 6 * i);
    }
  }

  box(): Box | null {
    return this.named.box() ?? this.above.box() ?? this.all.box();
  }
}
