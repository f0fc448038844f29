// How much is drawn at once, and how long the computer rests after that. Without a graphics card a
// large part takes seconds. Whatever else runs on the computer waits meanwhile: the service and the
// page with its emergency stop among it. So the time of each drawing is measured, and the next one
// is as large as fits into a few hundredths of a second. Pure.
//
//   a person turns the part     lines, every n-th of them, as many as fit; a pause as long
//   it stands still             beads over them, slice by slice; a pause four times as long
//   only new beads              the same, and nothing else is drawn again

export type Kind = 'beads' | 'lines';

/** A drawing that takes longer is felt. */
export const FRAME_MS = 40;
/** For more than that, with its pauses, nobody waits: then it is lines at last. */
const FINE_MS_MAX = 6000;
const LEARNS_FROM = 100; // segments: fewer say nothing of what one costs
const SLICE_MIN = 200;
const QUICK_MS = 8; // half a frame: no pause is needed

export class Pace {
  /** Milliseconds for one segment; at first as on a slow computer without a graphics card. */
  private readonly cost_ms: Record<Kind, number> = { beads: 0.02, lines: 0.02 };

  note(kind: Kind, segments: number, took_ms: number): void {
    if (segments < LEARNS_FROM) return;
    this.cost_ms[kind] += 0.5 * (took_ms / segments - this.cost_ms[kind]);
  }

  /** So many segments are drawn in `time_ms`. */
  fits(kind: Kind, time_ms: number): number {
    return Math.max(SLICE_MIN, Math.floor(time_ms / this.cost_ms[kind]));
  }

  /** How a part of so many segments is drawn at last. */
  finest(segments: number): Kind {
    return segments * this.cost_ms.beads <= FINE_MS_MAX ? 'beads' : 'lines';
  }

  /** How it is drawn in one go: `step` 3 is every third segment. */
  atOnce(segments: number): { kind: Kind; step: number } {
    if (segments <= this.fits('beads', FRAME_MS)) return { kind: 'beads', step: 1 };
    return { kind: 'lines', step: Math.max(1, Math.ceil(segments / this.fits('lines', FRAME_MS))) };
  }
}

/** The pause after a drawing. */
export const rest_ms = (took_ms: number, moving: boolean): number => (took_ms <= QUICK_MS ? 0 : moving ? took_ms : 4 * took_ms);
