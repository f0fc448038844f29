// The thread that draws the part, and fetches and parses its layers: the page's own thread has
// nothing to do with that, and answers a click at once however slow the drawing is.
import type { LayerRecord } from '../layers';
import { loadLayers } from './loader';
import type { Drawn, FromWorker, ToWorker } from './messages';
import { Painter } from './painter';
import { bedLines, PartView } from './view';

const TOLD_MS = 250;
const tell = (message: FromWorker): void => self.postMessage(message);

let page = '';
let view: PartView | null = null;
let loading: AbortController | null = null;
let drawings: Drawn | null = null;
let telling = 0;

function load(job: number, into: PartView): void {
  const abort = new AbortController();
  loading = abort;
  let layers = 0;
  const take = (record: LayerRecord) => {
    into.add(record);
    layers = Math.max(layers, record.layer + 1);
  };
  void loadLayers(page, job, abort.signal, {
    begin: (segments) => into.begin(segments),
    add: (records) => {
      records.forEach(take);
      tell({ type: 'loaded', layers, features: [...into.features].sort((a, b) => a - b) });
    },
    problem: (text, status) => tell({ type: 'problem', text, status }),
  }).then(() => abort.signal.aborted || into.loaded());
}

/** Told now and then: the newest of them. */
function drawn(now: Drawn): void {
  drawings = now;
  telling ||= setTimeout(() => {
    telling = 0;
    tell({ type: 'drawn', ...drawings! });
  }, TOLD_MS) as unknown as number;
}

function begin({ page: address, canvas, overlay, size, dark, bed }: Extract<ToWorker, { type: 'begin' }>): void {
  page = address;
  // What is drawn is kept: new beads are added to it.
  const gl = canvas?.getContext('webgl2', { antialias: true, preserveDrawingBuffer: true, failIfMajorPerformanceCaveat: false }) ?? null;
  canvas?.addEventListener('webglcontextlost', () => tell({ type: 'lost' }));
  const lines = bedLines(bed);
  const painter = gl ? new Painter(gl, lines.grid, lines.outline) : null;
  view = new PartView({ canvas, overlay, painter }, bed, size, dark, { drawn, flat: (flat) => tell({ type: 'flat', flat }) });
  tell({ type: 'begun', as: painter ? 'solid' : 'flat' });
}

function take(message: Exclude<ToWorker, { type: 'begin' }>, on: PartView): void {
  switch (message.type) {
    case 'job':
      loading?.abort();
      on.clear(message.box);
      tell({ type: 'loaded', layers: 0, features: [] });
      return message.job === null ? undefined : load(message.job, on);
    case 'show': return on.show(message.executed, message.top, message.running);
    case 'head': return on.setHead(message.at);
    case 'size': return on.resize(message.size);
    case 'dark': return on.setDark(message.dark);
    case 'visible': return on.setVisible(message.visible);
    case 'look': return on.look(message.from);
    case 'turn': return on.turn(message.azimuth, message.polar);
    case 'zoom': return on.zoom(message.by);
    case 'pan': return on.pan(message.x, message.y);
  }
}

self.onmessage = ({ data }: MessageEvent<ToWorker>) => {
  if (data.type === 'begin') begin(data);
  else if (view) take(data, view);
};
