// The page's end of the worker that draws the part. Here are the canvas as an element, and the
// hands on it: nothing is drawn and nothing is parsed on this thread. Where a canvas cannot be
// given to a worker, the still picture that the worker sends is painted here, some thousands of
// lines at once.
import { paintFlat } from './flat';
import type { Drawn, FromWorker, Size, ToWorker } from './messages';
import type { Box } from './orbit';

const TURN = Math.PI / 600; // radians a CSS pixel
const KEY_TURN = Math.PI / 24;
const KEY_ZOOM = 1.15;
const RATIO_MAX = 2;

export interface Hears {
  /** 'flat': there is no 3D here, but a still picture. */
  begun(as: 'solid' | 'flat'): void;
  loaded(layers: number, features: number[]): void;
  problem(text: string | null, status: number): void;
  /** It draws no more: another canvas is needed. */
  lost(): void;
}

const canGiveAway = (): boolean => typeof OffscreenCanvas !== 'undefined' && 'transferControlToOffscreen' in HTMLCanvasElement.prototype;

export class StageClient {
  private readonly worker: Worker;
  private readonly ends: (() => void)[] = [];
  private readonly scheme = matchMedia('(prefers-color-scheme: dark)');
  private readonly context: CanvasRenderingContext2D | null;

  /** `box`: what the canvases fill. Contract: the canvases are new. */
  constructor(private readonly canvas: HTMLCanvasElement, overlay: HTMLCanvasElement, bed: Box, private readonly hears: Hears) {
    this.worker = new Worker(new URL('./worker.ts', import.meta.url), { type: 'module' });
    this.worker.onmessage = ({ data }: MessageEvent<FromWorker>) => this.take(data);
    this.worker.onerror = () => hears.problem('This browser cannot draw the part.', 0);
    const given = canGiveAway() ? [canvas.transferControlToOffscreen(), overlay.transferControlToOffscreen()] : [];
    this.context = given.length > 0 ? null : canvas.getContext('2d');
    const size = this.size();
    if (this.context) this.fit(size);
    this.worker.postMessage(
      { type: 'begin', page: location.href, canvas: given[0] ?? null, overlay: given[1] ?? null, size, dark: this.scheme.matches, bed } satisfies ToWorker, given);
    this.watch();
    this.listen();
  }

  say(message: ToWorker): void {
    this.worker.postMessage(message);
  }

  dispose(): void {
    this.ends.forEach((end) => end());
    this.worker.terminate();
  }

  private take(message: FromWorker): void {
    switch (message.type) {
      case 'begun': return this.hears.begun(message.as);
      case 'loaded': return this.hears.loaded(message.layers, message.features);
      case 'problem': return this.hears.problem(message.text, message.status);
      case 'lost': return this.hears.lost();
      case 'drawn':
        this.tellOf(message);
        return undefined;
      case 'flat':
        if (this.context) paintFlat(this.context, message.flat, this.size().ratio, this.scheme.matches ? 'rgb(86 104 121)' : 'rgb(151 165 179)');
        return undefined;
    }
  }

  /** For whoever looks from outside, as tests do. */
  private tellOf({ frames, anew, segments, ghost, whole }: Drawn): void {
    Object.assign(this.canvas.dataset, { frames, anew, segments, ghost, whole });
  }

  private size(): Size {
    const { width, height } = this.canvas.parentElement!.getBoundingClientRect();
    return { width, height, ratio: Math.min(devicePixelRatio, RATIO_MAX) };
  }

  private fit({ width, height, ratio }: Size): void {
    Object.assign(this.canvas, { width: Math.round(width * ratio), height: Math.round(height * ratio) });
  }

  /** Size, colours, and whether anybody sees it. */
  private watch(): void {
    const box = this.canvas.parentElement!;
    const resized = new ResizeObserver(() => {
      const size = this.size();
      if (this.context) this.fit(size);
      this.say({ type: 'size', size });
    });
    resized.observe(box);
    let inView = true;
    const tell = () => this.say({ type: 'visible', visible: inView && !document.hidden });
    const viewed = new IntersectionObserver((entries) => {
      inView = entries[entries.length - 1].isIntersecting;
      tell();
    });
    viewed.observe(box);
    const recolour = () => this.say({ type: 'dark', dark: this.scheme.matches });
    document.addEventListener('visibilitychange', tell);
    this.scheme.addEventListener('change', recolour);
    this.ends.push(() => resized.disconnect(), () => viewed.disconnect(), () => document.removeEventListener('visibilitychange', tell),
      () => this.scheme.removeEventListener('change', recolour));
  }

  private on<K extends keyof HTMLElementEventMap>(name: K, listener: (event: HTMLElementEventMap[K]) => void): void {
    this.canvas.addEventListener(name, listener, { passive: false });
    this.ends.push(() => this.canvas.removeEventListener(name, listener));
  }

  private listen(): void {
    const { canvas } = this;
    // A finger that goes up or down scrolls the page; sideways, it turns the part. Two zoom.
    canvas.style.touchAction = 'pan-y';
    const held = new Map<number, { x: number; y: number }>();
    const spread = () => {
      const [a, b] = [...held.values()];
      return Math.hypot(a.x - b.x, a.y - b.y);
    };
    this.on('pointerdown', (event) => {
      canvas.setPointerCapture(event.pointerId);
      held.set(event.pointerId, { x: event.clientX, y: event.clientY });
    });
    this.on('pointermove', (event) => {
      const last = held.get(event.pointerId);
      if (!last) return;
      const [x, y] = [event.clientX - last.x, event.clientY - last.y];
      const before = held.size === 2 ? spread() : 0;
      held.set(event.pointerId, { x: event.clientX, y: event.clientY });
      if (held.size === 2) this.say({ type: 'zoom', by: before / Math.max(1, spread()) });
      else if ((event.buttons & 2) !== 0 || event.shiftKey) this.say({ type: 'pan', x, y });
      else this.say({ type: 'turn', azimuth: -x * TURN, polar: -y * TURN });
    });
    for (const name of ['pointerup', 'pointercancel'] as const) this.on(name, (event) => held.delete(event.pointerId));
    this.on('contextmenu', (event) => event.preventDefault());
    this.on('wheel', (event) => {
      event.preventDefault();
      this.say({ type: 'zoom', by: Math.exp(Math.max(-200, Math.min(200, event.deltaY)) * 0.002) });
    });
    this.on('keydown', (event) => this.press(event));
  }

  private press(event: KeyboardEvent): void {
    const said: Record<string, ToWorker> = {
      ArrowLeft: { type: 'turn', azimuth: KEY_TURN, polar: 0 }, ArrowRight: { type: 'turn', azimuth: -KEY_TURN, polar: 0 },
      ArrowUp: { type: 'turn', azimuth: 0, polar: KEY_TURN }, ArrowDown: { type: 'turn', azimuth: 0, polar: -KEY_TURN },
      '+': { type: 'zoom', by: 1 / KEY_ZOOM }, '=': { type: 'zoom', by: 1 / KEY_ZOOM }, '-': { type: 'zoom', by: KEY_ZOOM },
      Home: { type: 'look', from: 'corner' },
    };
    const message = said[event.key];
    if (!message || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    this.say(message);
  }
}
