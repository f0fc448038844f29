// What the page and the worker that draws the part say to each other (stage/client.ts and
// stage/worker.ts).
import type { Box, Direction } from './orbit';

export interface Size {
  /** CSS pixels. */
  width: number;
  height: number;
  /** Device pixels in one of them. */
  ratio: number;
}

export type ToWorker =
  /**
   * Without canvases the worker draws nothing, and sends a flat picture for the page to paint.
   * `page`: the page's address, which may lie below a proxy's prefix; the worker's own is no help.
   */
  | { type: 'begin'; page: string; canvas: OffscreenCanvas | null; overlay: OffscreenCanvas | null; size: Size; dark: boolean; bed: Box }
  /** Its layers are fetched; `box`: where it lies as far as known. Null: the empty bed. */
  | { type: 'job'; job: number | null; box: Box | null }
  /** Bytes that are laid down; no layer from `top` on (null: all). `running`: the job prints. */
  | { type: 'show'; executed: number; top: number | null; running: boolean }
  /** The nozzle's tip; null: not shown. */
  | { type: 'head'; at: number[] | null }
  | { type: 'size'; size: Size }
  | { type: 'dark'; dark: boolean }
  /** False: it is off screen, and nothing is drawn. */
  | { type: 'visible'; visible: boolean }
  | { type: 'look'; from: Direction }
  /** By radians. */
  | { type: 'turn'; azimuth: number; polar: number }
  | { type: 'zoom'; by: number }
  /** By CSS pixels. */
  | { type: 'pan'; x: number; y: number };

/** Lines on the screen, in CSS pixels, four numbers each; `features` has one number each. */
export interface Flat {
  lines: Float32Array;
  features: Uint8Array;
  bed: Float32Array;
}

export interface Drawn {
  /** Since the beginning; `anew` of them drew everything. */
  frames: number;
  anew: number;
  /** Segments that are shown. */
  segments: number;
  /** Lines of the part that is still to come. */
  ghost: number;
  /** Nothing is left to be drawn. */
  whole: boolean;
}

export type FromWorker =
  /** 'flat': it has no WebGL, and draws a still picture instead. */
  | { type: 'begun'; as: 'solid' | 'flat' }
  | { type: 'loaded'; layers: number; features: number[] }
  /** Why there are no layers, or no more of them, in words; status 401: the session has ended. */
  | { type: 'problem'; text: string | null; status: number }
  /** Told now and then. */
  | ({ type: 'drawn' } & Drawn)
  | { type: 'flat'; flat: Flat }
  /** The graphics card has forgotten everything: the canvas is of no use any more. */
  | { type: 'lost' };
