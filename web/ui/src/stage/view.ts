// The part as the worker has it: its segments, where it is looked at from, and what is left to be
// drawn. Nothing is drawn while nothing changes or nobody sees it.
//
//   camera, size, colours, a layer hidden ──► all anew, as much as fits into one frame
//                                                 │ the rest waits
//   new beads ────────────────────────────────────┴─► waiting ──► a slice, a pause, a slice, …
//   the nozzle moves ─────────────────────────────────────────► its own canvas alone
import type { LayerRecord } from '../layers';
import { paintFlat, Sketch } from './flat';
import type { Drawn, Flat, Size } from './messages';
import { drawNozzle, NOZZLE_MM } from './nozzle';
import { Orbit, type Box, type Direction } from './orbit';
import { Painter, SUN, type Colours } from './painter';
import { FRAME_MS, Pace, rest_ms, type Kind } from './pace';
import { Shade } from './shade';
import { added, countOf, Extent, packSegments, shownRanges, takeFrom, type Known, type Range } from './segments';

const STILL_MS = 150; // after the last turn: then it is drawn in full
const FLAT_REST_MS = 250;
const GHOST_MS = 10;
const INSET = { left: 12, right: 56, top: 52, bottom: 40 };
const FAR_MM = 8; // beside the part: the nozzle has a width

/** Both ends of bed lines every 10 mm, and of its outline. */
export function bedLines({ min, max }: Box): { grid: number[]; outline: number[] } {
  const grid: number[] = [];
  for (let x = min[0] + 10; x < max[0] - 1e-6; x += 10) grid.push(x, min[1], 0, x, max[1], 0);
  for (let y = min[1] + 10; y < max[1] - 1e-6; y += 10) grid.push(min[0], y, 0, max[0], y, 0);
  const corners = [[min[0], min[1]], [max[0], min[1]], [max[0], max[1]], [min[0], max[1]]];
  const outline = corners.flatMap(([x, y], i) => [x, y, 0, ...corners[(i + 1) % 4], 0]);
  return { grid, outline };
}

const colour = (hex: number): number[] => [16, 8, 0].map((shift) => ((hex >> shift) & 255) / 255);
const coloursOf = (dark: boolean): Colours => ({ grid: colour(dark ? 0x2b3947 : 0xd0d8e0), outline: colour(dark ? 0x566879 : 0x97a5b3), shade: dark ? 0.85 : 0.6 });
const FLAT_BED = { dark: 'rgb(86 104 121)', light: 'rgb(151 165 179)' };

/** Where it is drawn; without a painter: flat. */
export interface Surface {
  canvas: OffscreenCanvas | null;
  overlay: OffscreenCanvas | null;
  painter: Painter | null;
}

export interface Reports {
  drawn(now: Drawn): void;
  flat(flat: Flat): void;
}

export class PartView {
  private readonly orbit = new Orbit();
  private readonly pace = new Pace();
  private readonly sketch = new Sketch();
  private readonly overlay: OffscreenCanvasRenderingContext2D | null;
  private readonly lines: ReturnType<typeof bedLines>;
  private size: Size;
  private records: Known[] = [];
  private readonly shade: Shade;
  private room = 0; // segments
  private filled = 0;
  private extent = new Extent();
  private box: Box | null = null;
  private running = false;
  private executed = Infinity;
  private top: number | null = null;
  private head: number[] | null = null;
  private seen = true;
  private anew = true;
  private moved = false; // the nozzle
  private shown: Range[] = [];
  private waiting: Range[] = [];
  private finest: Kind = 'beads';
  private turned_ms = -Infinity;
  private scheduled = false;
  private free_ms = 0;
  private frames = 0;
  private drawnAnew = 0;
  private ghosts = 0;
  private pale: Range[] = []; // of the ghost, what is still to be drawn
  readonly features = new Set<number>();

  constructor(private readonly surface: Surface, private readonly bed: Box, size: Size, private dark: boolean, private readonly reports: Reports) {
    this.lines = bedLines(bed);
    this.shade = new Shade(bed, SUN);
    this.overlay = surface.painter ? (surface.overlay?.getContext('2d') ?? null) : null;
    this.size = size;
    this.resize(size);
    this.look('corner');
  }

  /** Another job, or none; `box`: where it lies as far as is known. */
  clear(box: Box | null): void {
    Object.assign(this, { records: [], filled: 0, room: 0, extent: new Extent(), box, running: false, executed: Infinity, top: null });
    this.features.clear();
    this.shade.clear();
    this.sketch.begin(0);
    this.look('corner');
  }

  begin(segments: number): void {
    this.room = segments;
    this.surface.painter?.begin(segments);
    this.sketch.begin(segments);
    this.again();
  }

  add(record: LayerRecord): void {
    if (this.filled + record.segments > this.room) throw new Error('layers: more of them than their list says');
    if (this.surface.painter) this.surface.painter.put(this.filled, packSegments(record));
    else this.sketch.add(record);
    this.filled += record.segments;
    this.records.push({ layer: record.layer, segments: record.segments, bytes: record.bytes });
    record.features.subarray(0, record.segments).forEach((feature) => this.features.add(feature));
    this.extent.take(record);
    if (this.surface.painter) this.shade.add(record);
    this.refresh();
  }

  /** All of it is there: it is framed as it is, unless a person has chosen another view. */
  loaded(): void {
    this.box = this.extent.box() ?? this.box;
    if (!this.orbit.held) this.look();
    else this.again(); // its ghost and its shade are known now
  }

  show(executed: number, top: number | null, running: boolean): void {
    const other = running !== this.running;
    Object.assign(this, { executed, top, running });
    if (other && !this.orbit.held) this.look();
    this.refresh();
  }

  setHead(at: number[] | null): void {
    this.head = at;
    this.moved = true;
    this.schedule();
  }

  setDark(dark: boolean): void {
    this.dark = dark;
    this.again();
  }

  setVisible(visible: boolean): void {
    this.seen = visible;
    this.schedule();
  }

  resize(size: Size): void {
    this.size = size;
    for (const canvas of [this.surface.canvas, this.surface.overlay]) {
      if (!canvas) continue;
      canvas.width = Math.max(1, Math.round(size.width * size.ratio));
      canvas.height = Math.max(1, Math.round(size.height * size.ratio));
    }
    this.orbit.resize(size.width, size.height);
    if (this.orbit.held) this.again();
    else this.look();
  }

  /** The whole of it, from `from` or as before. */
  look(from?: Direction): void {
    const box = this.box ?? this.bed;
    // The nozzle stands above what is printed, and is not to be cut.
    const room = this.running || !this.box ? NOZZLE_MM : 0;
    const beside = room > 0 ? FAR_MM / 2 : 0;
    this.orbit.look({
      min: [box.min[0] - beside, box.min[1] - beside, Math.min(0, box.min[2])], max: [box.max[0] + beside, box.max[1] + beside, box.max[2] + room],
    }, INSET, from);
    this.again();
  }

  turn(azimuth: number, polar: number): void { this.orbit.turn(azimuth, polar); this.touched(); }
  zoom(by: number): void { this.orbit.zoom(by); this.touched(); }
  pan(x: number, y: number): void { this.orbit.pan(x, y); this.touched(); }

  private touched(): void {
    this.turned_ms = performance.now();
    this.again();
  }

  private again(): void {
    this.anew = true;
    this.schedule();
  }

  /** What is shown has changed: what has come is added, or all is drawn anew. */
  private refresh(): void {
    if (this.anew) return this.schedule();
    const now = shownRanges(this.records, this.executed, this.top);
    const more = this.surface.painter ? added(this.shown, now) : null;
    if (!more) {
      if (this.surface.painter || countOf(now) !== countOf(this.shown)) this.again();
      return;
    }
    this.shown = now;
    this.waiting.push(...more);
    if (more.length > 0) this.pale = [];
    if (more.length > 0) this.schedule();
  }

  private schedule(): void {
    if (this.scheduled || !this.seen || this.size.width < 2 || !(this.anew || this.moved || this.waiting.length > 0 || this.pale.length > 0)) return;
    this.scheduled = true;
    const still_ms = this.anew || this.moved ? 0 : this.turned_ms + STILL_MS - performance.now();
    setTimeout(() => {
      this.scheduled = false;
      if (this.seen) this.frame();
      this.schedule();
    }, Math.max(0, this.free_ms - performance.now(), still_ms));
  }

  private frame(): void {
    const matrix = this.orbit.matrix();
    const began_ms = performance.now();
    const moving = began_ms - this.turned_ms < STILL_MS;
    if (this.anew || this.moved) this.drawOverlay(matrix);
    this.moved = false;
    if (!this.surface.painter) this.drawFlat(matrix);
    else if (this.anew) this.drawAnew(this.surface.painter, matrix);
    else if (this.waiting.length > 0 && !moving) this.drawSlice(this.surface.painter, matrix);
    else if (this.pale.length > 0 && !moving) this.drawPaleSlice(this.surface.painter, matrix);
    else return;
    this.frames++;
    const took_ms = performance.now() - began_ms;
    this.free_ms = began_ms + took_ms + (this.surface.painter ? rest_ms(took_ms, moving) : FLAT_REST_MS);
    this.reports.drawn({ frames: this.frames, anew: this.drawnAnew, segments: countOf(this.shown), ghost: this.ghosts, whole: !this.anew && this.waiting.length === 0 });
  }

  private drawAnew(painter: Painter, matrix: Float32Array): void {
    this.anew = false;
    this.drawnAnew++;
    this.shown = shownRanges(this.records, this.executed, this.top);
    const segments = countOf(this.shown);
    const { kind, step } = this.pace.atOnce(segments);
    const { width, height } = this.surface.canvas!;
    painter.shadeBy(this.shade);
    painter.clear(width, height, matrix, coloursOf(this.dark));
    this.drawGhost(painter, matrix);
    this.timed(painter, kind, () => painter.draw(kind, this.shown, step, matrix, this.orbit.eye()));
    this.finest = this.pace.finest(segments);
    this.waiting = step === 1 && (kind === 'beads' || this.finest === 'lines') ? [] : this.shown.map((range) => ({ ...range }));
  }

  /** While it prints: what is still to come, below what is laid down. */
  private drawGhost(painter: Painter, matrix: Float32Array): void {
    this.ghosts = 0;
    this.pale = [];
    if (!this.running || this.top !== null) return;
    const first = countOf(shownRanges(this.records, this.executed, null));
    const count = this.filled - first;
    if (count <= 0) return;
    const step = Math.max(1, Math.ceil(count / this.pace.fits('lines', GHOST_MS)));
    this.timed(painter, 'lines', () => (this.ghosts = painter.ghost([{ first, count }], step, matrix, this.orbit.eye())));
    // The rest of its lines comes slice by slice, as long as nothing is laid down that they would
    // cover.
    if (step > 1 && first === 0) this.pale = [{ first, count }];
  }

  private drawPaleSlice(painter: Painter, matrix: Float32Array): void {
    const slice = takeFrom(this.pale, this.pace.fits('lines', FRAME_MS));
    this.timed(painter, 'lines', () => painter.ghost(slice, 1, matrix, this.orbit.eye()));
    this.ghosts = Math.max(this.ghosts, this.filled - countOf(this.pale));
  }

  private drawSlice(painter: Painter, matrix: Float32Array): void {
    const kind = this.finest;
    const slice = takeFrom(this.waiting, this.pace.fits(kind, FRAME_MS));
    this.timed(painter, kind, () => painter.draw(kind, slice, 1, matrix, this.orbit.eye()));
  }

  private timed(painter: Painter, kind: Kind, draw: () => number): void {
    const began_ms = performance.now();
    const segments = draw();
    painter.finish();
    this.pace.note(kind, segments, performance.now() - began_ms);
  }

  private drawOverlay(matrix: Float32Array): void {
    if (!this.overlay) return;
    const { width, height, ratio } = this.size;
    this.overlay.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.overlay.clearRect(0, 0, width, height);
    if (this.head) drawNozzle(this.overlay, this.orbit, matrix, this.head, width, height);
  }

  private drawFlat(matrix: Float32Array): void {
    this.anew = false;
    this.waiting = [];
    this.shown = shownRanges(this.records, this.executed, this.top);
    const flat = this.sketch.flat(this.orbit, matrix, this.shown, this.lines.outline);
    const context = this.surface.canvas?.getContext('2d');
    if (context) paintFlat(context, flat, this.size.ratio, this.dark ? FLAT_BED.dark : FLAT_BED.light);
    else this.reports.flat(flat);
  }
}
