import { useEffect, useRef, useState } from 'preact/hooks';
import { useStore } from '../hooks';
import { cssColour, FEATURE_COLOURS, FEATURE_NAMES } from '../layers';
import { bytesLaid, hasStopped } from '../jobs';
import { StageClient } from '../stage/client';
import type { Direction } from '../stage/orbit';
import { isRunning, lacks, store } from '../store';
import type { Job, MachineConfig } from '../types';
import { Icon } from './Icon';

/** How many bytes of the shown job lie on the bed. */
const laidDown = (job: Job | null): number => bytesLaid(job, store.state.status);

/** The layers that a stopped job had begun, when the machine does not know its bytes any more. */
const topOf = (job: Job | null, chosen: number | null): number | null =>
  chosen ?? (job && hasStopped(job.state) && job.stopped_layer ? job.stopped_layer : null);

/** The picture follows the live stream by itself: no component is drawn again for it. */
function useFollow(client: StageClient | null, job: Job | null, top: number | null): void {
  useEffect(() => {
    if (!client) return;
    let shown = '';
    let place = '';
    const running = job !== null && isRunning(job);
    const follow = () => {
      const bytes = laidDown(job);
      const words = `${bytes} ${topOf(job, top)}`;
      if (words !== shown) client.say({ type: 'show', executed: bytes, top: topOf(job, top), running });
      shown = words;
      const { status } = store.state;
      const at = status?.connected && (!job || running) ? status.position_mm : null;
      const there = at ? `${at.x} ${at.y} ${at.z}` : '';
      if (there !== place) client.say({ type: 'head', at: at && [at.x, at.y, at.z] });
      place = there;
    };
    client.say({ type: 'head', at: null });
    follow();
    return store.subscribe(follow);
  }, [client, job?.id, job?.state, top]);
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

function boxOf(config: MachineConfig | null) {
  const { x, y } = config?.axes ?? { x: { min_mm: 0, max_mm: 150 }, y: { min_mm: 0, max_mm: 150 } };
  return { min: [x.min_mm, y.min_mm, 0], max: [x.max_mm, y.max_mm, 0] };
}

const CONFIG_WAIT_MS = 1500;

/** A canvas that was given away cannot be given again: another machine gets another. */
export function Stage({ job }: { job: Job | null }) {
  const machine = useStore((s) => s.config?.name ?? null);
  const [lost, setLost] = useState(0);
  // The machine's size comes soon, or never: then a usual bed is shown.
  const [late, setLate] = useState(false);
  useEffect(() => {
    const timer = setTimeout(() => setLate(true), CONFIG_WAIT_MS);
    return () => clearTimeout(timer);
  }, []);
  if (machine === null && !late) return <div class="stage" />;
  return <StageOf key={`${machine} ${lost}`} job={job} lost={() => setLost((n) => n + 1)} />;
}

/** What the worker has said. */
interface Told {
  problem: string | null;
  flat: boolean;
  layers: number;
  features: number[];
}

const NOTHING_YET: Told = { problem: null, flat: false, layers: 0, features: [] };

/** Gives the canvases to a worker, which draws on them. */
function useClient(lost: () => void) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const overlay = useRef<HTMLCanvasElement>(null);
  const [client, setClient] = useState<StageClient | null>(null);
  const [told, setTold] = useState(NOTHING_YET);
  useEffect(() => {
    const change = (part: Partial<Told>) => setTold((before) => ({ ...before, ...part }));
    let made: StageClient;
    try {
      made = new StageClient(canvas.current!, overlay.current!, boxOf(store.state.config), {
        begun: (as) => change({ flat: as === 'flat' }),
        loaded: (layers, features) => change({ layers, features }),
        problem: (problem, status) => (status === 401 ? store.set({ signedIn: false }) : change({ problem })),
        lost,
      });
    } catch {
      return change({ problem: 'This browser cannot draw the part.' });
    }
    setClient(made);
    return () => made.dispose();
  }, []);
  return { canvas, overlay, client, told, change: setTold };
}

function StageOf({ job, lost }: { job: Job | null; lost: () => void }) {
  const { canvas, overlay, client, told, change } = useClient(lost);
  const [top, setTop] = useState<number | null>(null);
  const bare = useStore((s) => lacks(s, 'layers'));
  const look = (from: Direction) => client?.say({ type: 'look', from });

  useEffect(() => {
    if (!client) return;
    setTop(null);
    const box = job?.facts.min_mm && job.facts.max_mm && job.facts.layers ? { min: job.facts.min_mm, max: job.facts.max_mm } : null;
    client.say({ type: 'job', job: job && !bare ? job.id : null, box: bare ? null : box });
    change((before) => ({ ...before, problem: job && bare ? 'This printer keeps no picture of the layers.' : null }));
  }, [client, job?.id, bare]);
  useFollow(client, job, top);

  const { layers, features, problem, flat } = told;
  return (
    <div class="stage">
      <canvas ref={canvas} tabIndex={0} data-testid="canvas" role="application" aria-roledescription="3D view"
        aria-label={`${job ? `${job.name}, as it is laid down` : 'The empty bed'}. Arrow keys turn it, plus and minus zoom, Home shows all of it.`} />
      <canvas ref={overlay} class="overlay" aria-hidden="true" />
      {problem && <p class="stage-note">{problem}</p>}
      {flat && <p class="stage-note low" data-testid="flat">This browser shows no 3D here: WebGL is not available. This is a still picture.</p>}
      <div class="looks">
        <button onClick={() => look('corner')} aria-label="Look at the whole part" title="Whole part"><Icon name="fit" /></button>
        <button onClick={() => look('top')}>Top</button>
        <button onClick={() => look('front')}>Front</button>
      </div>
      <Legend features={features} />
      {layers > 1 && (
        <label class="layer-slider">
          <output>{top === null ? 'All' : top}</output>
          <input type="range" min={1} max={layers} value={top ?? layers} aria-label="Layers shown"
            aria-valuetext={top === null ? 'all layers' : `${top} of ${layers} layers`}
            onInput={(event) => {
              const value = Number(event.currentTarget.value);
              setTop(value >= layers ? null : value);
            }} />
        </label>
      )}
    </div>
  );
}
