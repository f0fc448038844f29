// Reads packed layers in the format of printer/preflight/layer_packer.h (version 1). Pure.
import type { LayerIndex } from './types';

export const MAGIC = 0x314c4451;
const HEADER_BYTES = 40;
const VERTEX_BYTES = 20;
const STARTS_POLYLINE = 1;

/** Segments of one record as arrays that the graphics card takes: two ends for each segment. */
export interface LayerRecord {
  layer: number;
  part: number;
  z_mm: number;
  height_mm: number;
  segments: number;
  /** x y z of both ends: 6 numbers a segment, millimetres. */
  ends: Float32Array;
  /** Feature number of each segment. */
  features: Uint8Array;
  /** Width of each segment's extrusion in micrometres; 0: not known. */
  widths_um: Uint16Array;
  /** The segment is laid down once bytes_executed exceeds this. Rising. */
  bytes: Float64Array;
}

/** Every record in `buffer`. Throws an Error that says where the bytes stop making sense. */
export function decodeLayers(buffer: ArrayBuffer): LayerRecord[] {
  const view = new DataView(buffer);
  const records: LayerRecord[] = [];
  let at = 0;
  while (at < buffer.byteLength) {
    if (buffer.byteLength - at < HEADER_BYTES || view.getUint32(at, true) !== MAGIC) {
      throw new Error(`layers: no record at byte ${at}`);
    }
    const vertices = view.getUint32(at + 20, true);
    const end = at + HEADER_BYTES + vertices * VERTEX_BYTES;
    if (end > buffer.byteLength) throw new Error(`layers: the record at byte ${at} is cut off`);
    records.push(decodeRecord(view, at, vertices));
    at = end;
  }
  return records;
}

function decodeRecord(view: DataView, at: number, vertices: number): LayerRecord {
  const segments = view.getUint32(at + 24, true);
  const firstByte = view.getFloat64(at + 32, true);
  const record: LayerRecord = {
    layer: view.getUint32(at + 4, true),
    part: view.getUint32(at + 8, true),
    z_mm: view.getFloat32(at + 12, true),
    height_mm: view.getFloat32(at + 16, true),
    segments,
    ends: new Float32Array(segments * 6),
    features: new Uint8Array(segments),
    widths_um: new Uint16Array(segments),
    bytes: new Float64Array(segments),
  };
  let n = 0;
  let x = 0, y = 0, z = 0;
  for (let i = 0; i < vertices; i++) {
    const v = at + HEADER_BYTES + i * VERTEX_BYTES;
    const nx = view.getFloat32(v, true);
    const ny = view.getFloat32(v + 4, true);
    const nz = view.getFloat32(v + 8, true);
    const starts = i === 0 || (view.getUint8(v + 13) & STARTS_POLYLINE) !== 0;
    if (!starts && n < segments) {
      record.ends.set([x, y, z, nx, ny, nz], n * 6);
      record.features[n] = view.getUint8(v + 12);
      record.widths_um[n] = view.getUint16(v + 14, true);
      record.bytes[n] = firstByte + view.getUint32(v + 16, true);
      n++;
    }
    x = nx;
    y = ny;
    z = nz;
  }
  record.segments = n;
  return record;
}

/** How many segments of `record` are laid down once `executed` bytes of the job are. */
export function segmentsDone(record: LayerRecord, executed: number): number {
  let low = 0;
  let high = record.segments;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (record.bytes[middle] < executed) low = middle + 1;
    else high = middle;
  }
  return low;
}

const CHUNK_BYTES = 4_000_000;

/** Runs of records of about CHUNK_BYTES each: few requests, and the first of them is soon there. */
export function chunks(index: LayerIndex[]): [number, number][] {
  const out: [number, number][] = [];
  let first = 0;
  let size = 0;
  index.forEach((layer, i) => {
    size += layer.bytes;
    if (size >= CHUNK_BYTES || i === index.length - 1) {
      out.push([index[first].index, layer.index]);
      first = i + 1;
      size = 0;
    }
  });
  return out;
}

/** Name and linear RGB of each feature; the numbers are gcode::Feature's. */
const FEATURES: readonly (readonly [name: string, colour: readonly [number, number, number]])[] = [
  ['Other', [0.62, 0.65, 0.70]],
  ['Outer wall', [1.00, 0.47, 0.16]],
  ['Inner wall', [1.00, 0.70, 0.30]],
  ['Overhang', [0.16, 0.20, 0.95]],
  ['Infill', [0.60, 0.14, 0.10]],
  ['Solid infill', [0.62, 0.30, 0.78]],
  ['Top surface', [1.00, 0.42, 0.62]],
  ['Bridge', [0.30, 0.50, 0.85]],
  ['Gap fill', [0.95, 0.95, 0.95]],
  ['Skirt', [0.20, 0.60, 0.55]],
  ['Support', [0.25, 0.75, 0.35]],
  ['Support interface', [0.15, 0.55, 0.25]],
  ['Prime tower', [0.70, 0.85, 0.55]],
  ['Ironing', [0.98, 0.60, 0.65]],
  ['Custom', [0.40, 0.70, 0.75]],
];
export const FEATURE_NAMES = FEATURES.map(([name]) => name);
export const FEATURE_COLOURS = FEATURES.map(([, colour]) => colour);

/** The words of `activities_s`: the features by their numbers, and what is no extrusion. */
const ACTIVITIES: Record<string, string> = {
  unknown: 'Extrusion', outer_wall: 'Outer wall', inner_wall: 'Inner wall', overhang: 'Overhang', sparse_infill: 'Infill',
  solid_infill: 'Solid infill', top_surface: 'Top surface', bridge: 'Bridge', gap_fill: 'Gap fill', skirt: 'Skirt', support: 'Support',
  support_interface: 'Support interface', prime_tower: 'Prime tower', ironing: 'Ironing', custom: 'Custom', travel: 'Travel',
  retraction: 'Retraction', dwell: 'Waiting', homing: 'Homing', heating: 'Heating',
};

export interface ActivityShare {
  name: string;
  seconds: number;
  share: number;
  /** As linear light, like the features of the part; null: nothing is laid down. */
  colour: readonly [number, number, number] | null;
}

/**
 * What the estimated time goes into, the longest first. A word that the page does not know is shown
 * as it is.
 */
export function activityShares(activities: Record<string, number> | undefined): ActivityShare[] {
  const entries = Object.entries(activities ?? {}).filter(([, seconds]) => seconds > 0);
  const total = entries.reduce((sum, [, seconds]) => sum + seconds, 0);
  return entries
    .map(([word, seconds]) => {
      const feature = FEATURE_NAMES.indexOf(ACTIVITIES[word]);
      const colour = word === 'unknown' ? FEATURE_COLOURS[0] : feature > 0 ? FEATURE_COLOURS[feature] : null;
      return { name: ACTIVITIES[word] ?? word, seconds, share: seconds / total, colour };
    })
    .sort((a, b) => b.seconds - a.seconds);
}

/** For a style sheet. */
export const cssColour = (linear: readonly number[]): string =>
  `rgb(${linear.map((c) => Math.round(Math.pow(c, 1 / 2.2) * 255)).join(' ')})`;
