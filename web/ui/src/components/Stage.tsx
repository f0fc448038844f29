import { useEffect, useRef, useState } from 'preact/hooks';
import { layerBytes, layerIndex } from '../api';
import { useStore } from '../hooks';
import { chunks, cssColour, decodeLayers, FEATURE_COLOURS, FEATURE_NAMES } from '../layers';
import { bytesLaid, hasStopped } from '../jobs';
import { isRunning, lacks, store } from '../store';
import type { Job } from '../types';
import type { Direction, PartView } from '../view';
import { Icon } from './Icon';

/**
 * Fetches and draws a job's layers, the lowest first. `done` gets the number of layers drawn so
 * far.
 */
async function load(view: PartView, solidFor: (segments: number) => boolean, job: number, signal: AbortSignal,
  done: (layers: number) => void): Promise<void> {
  const index = await layerIndex(job);
  const solid = solidFor(index.reduce((sum, record) => sum + record.segments, 0));
  for (const [first, last] of chunks(index)) {
    const records = decodeLayers(await layerBytes(job, first, last, signal));
    if (signal.aborted) return;
    records.forEach((record) => view.add(record, solid));
    done((records[records.length - 1]?.layer ?? -1) + 1);
  }
}

/** How many bytes of the shown job lie on the bed. */
const laidDown = (job: Job | null): number => bytesLaid(job, store.state.status);

/** The layers that a stopped job had begun, when the machine does not know its bytes any more. */
const topOf = (job: Job | null, chosen: number | null): number | null =>
  chosen ?? (job && hasStopped(job.state) && job.stopped_layer ? job.stopped_layer : null);

/** The 3D view follows the live stream by itself: no component is drawn again for it. */
function useFollow(view: PartView | null, job: Job | null, top: number | null, loaded: number): void {
  useEffect(() => {
    if (!view) return;
    let shownBytes = -1;
    let shownPlace = '';
    const follow = () => {
      const bytes = laidDown(job);
      if (bytes !== shownBytes) view.show(bytes, topOf(job, top));
      shownBytes = bytes;
      const { status } = store.state;
      const at = status?.connected && (!job || isRunning(job)) ? status.position_mm : null;
      const place = at ? `${at.x} ${at.y} ${at.z}` : '';
      if (place !== shownPlace) view.head(at);
      shownPlace = place;
    };
    view.head(null);
    follow();
    return store.subscribe(follow);
  }, [view, job?.id, job?.state, top, loaded]);
}

function Legend({ features }: { features: number[] }) {
  return (
    <ul class="legend">
      {features.filter((f) => f in FEATURE_NAMES).map((f) => (
        <li key={f}><i ref={(e) => { if (e) e.style.background = cssColour(FEATURE_COLOURS[f]); }} />{FEATURE_NAMES[f]}</li>
      ))}
    </ul>
  );
}

/**
 * Makes the view when its code is there: three.js is by far the largest part of the page, and comes
 * after the rest.
 */
function useView(canvas: { current: HTMLCanvasElement | null }, fail: (text: string) => void) {
  const config = useStore((s) => s.config);
  const [made, setMade] = useState<{ view: PartView; solidFor: (segments: number) => boolean } | null>(null);
  useEffect(() => {
    let gone = false;
    let view: PartView | null = null;
    import('../view').then((module) => {
      if (gone || !canvas.current) return;
      view = new module.PartView(canvas.current, config);
      setMade({ view, solidFor: module.solidFor });
    }).catch(() => gone || fail('This browser shows no 3D here: WebGL is not available.'));
    return () => {
      gone = true;
      setMade(null);
      view?.dispose();
    };
  }, [config]);
  return made;
}

export function Stage({ job }: { job: Job | null }) {
  // A canvas whose view was disposed of has lost its context: another machine gets another canvas.
  const machine = useStore((s) => s.config?.name ?? '');
  return <StageOf key={machine} job={job} />;
}

function StageOf({ job }: { job: Job | null }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const [problem, setProblem] = useState<string | null>(null);
  const [loaded, setLoaded] = useState(0);
  const [top, setTop] = useState<number | null>(null);
  const [features, setFeatures] = useState<number[]>([]);
  const made = useView(canvas, setProblem);
  const view = made?.view ?? null;
  const bare = useStore((s) => lacks(s, 'layers'));
  const box = job?.facts.min_mm && job.facts.max_mm && job.facts.layers ? { min: job.facts.min_mm, max: job.facts.max_mm } : null;
  const look = (from: Direction) => view?.frameOn(box, from);

  useEffect(() => {
    if (!made) return;
    made.view.clear();
    setTop(null);
    setLoaded(0);
    setFeatures([]);
    look('corner');
    if (!job) return;
    if (bare) return setProblem('This printer keeps no picture of the layers.');
    const abort = new AbortController();
    load(made.view, made.solidFor, job.id, abort.signal, (count) => (setLoaded(count), setFeatures(made.view.features())))
      .then(() => setProblem(null))
      .catch((error) => abort.signal.aborted || setProblem((error as Error).message));
    return () => abort.abort();
  }, [made, job?.id, bare]);
  useFollow(view, job, top, loaded);

  return (
    <div class="stage">
      <canvas ref={canvas} data-testid="canvas" role="img" aria-label={job ? `${job.name}, as it is laid down` : 'The empty bed'} />
      {problem && <p class="stage-note">{problem}</p>}
      <div class="looks">
        <button onClick={() => look('corner')} aria-label="Look at the whole part" title="Whole part"><Icon name="fit" /></button>
        <button onClick={() => look('top')}>Top</button>
        <button onClick={() => look('front')}>Front</button>
      </div>
      <Legend features={features} />
      {loaded > 1 && (
        <label class="layer-slider">
          <output>{top === null ? 'All' : top}</output>
          <input type="range" min={1} max={loaded} value={top ?? loaded} aria-label="Layers shown"
            aria-valuetext={top === null ? 'all layers' : `${top} of ${loaded} layers`}
            onInput={(event) => {
              const value = Number(event.currentTarget.value);
              setTop(value >= loaded ? null : value);
            }} />
        </label>
      )}
    </div>
  );
}
