import { useState } from 'preact/hooks';
import { act } from '../api';
import * as format from '../format';
import { useStore } from '../hooks';
import { ask, isRunning, isWaiting, progressOf, queueEnds, shownJob, store } from '../store';
import type { Job } from '../types';
import { Icon } from './Icon';

const ENDED_SHOWN = 30;
const show = (job: Job) => store.set({ shown: job.id });
const remove = async (job: Job) => (await ask(`Delete ${job.name}? Its file is deleted with it.`, 'Delete')) && act('DELETE', `jobs/${job.id}`);

/** Puts `moved` before `before` (null: at the end). */
const move = (moved: number, before: number | null) => act('PATCH', `jobs/${moved}`, { before });

function Thumbnail({ job }: { job: Job }) {
  if (job.facts.thumbnail) return <img class="thumb" src={`/api/v1/jobs/${job.id}/thumbnail`} alt="" loading="lazy" />;
  return <span class="thumb"><Icon name="box" size={24} /></span>;
}

function Facts({ job, readyIn_s }: { job: Job; readyIn_s: number | undefined }) {
  const parts = [
    job.facts.estimated_s ? format.duration(job.facts.estimated_s) : null,
    readyIn_s === undefined ? null : `ready ${format.clock(readyIn_s, new Date())}`,
    job.copies > 1 && job.copies_done > 0 ? `${job.copies_done} of ${job.copies} done` : null,
    job.facts.filament_mm ? `${(job.facts.filament_mm / 1000).toFixed(2)} m` : null,
  ].filter(Boolean);
  return (
    <span class="facts" title={format.bytes(job.size)}>
      {job.state === 'held' && <span class="chip small state-paused">On hold</span>}
      {parts.length > 0 ? parts.join(' · ') : format.bytes(job.size)}
    </span>
  );
}

/** What is dragged, and where among the waiting jobs it would go: before that one, or (null) to the end. */
interface Drag {
  id: number;
  before: number | null | undefined;
}

interface RowProps {
  job: Job;
  waiting: Job[];
  at: number;
  readyIn_s: number | undefined;
  drag: Drag | null;
  setDrag: (drag: Drag | null) => void;
}

function WaitingTools({ job, waiting, at }: RowProps) {
  return (
    <div class="tools">
      <label class="copies">
        ×<input type="number" inputMode="numeric" min={Math.max(1, job.copies_done)} max={1000} value={job.copies} aria-label={`Copies of ${job.name}`}
          onChange={(event) => act('PATCH', `jobs/${job.id}`, { copies: Number(event.currentTarget.value) })} />
      </label>
      <span class="buttons">
        <button class="quiet" disabled={at === 0} aria-label={`Move ${job.name} up`} title="Earlier"
          onClick={() => move(job.id, waiting[at - 1].id)}><Icon name="up" /></button>
        <button class="quiet" disabled={at === waiting.length - 1} aria-label={`Move ${job.name} down`} title="Later"
          onClick={() => move(job.id, waiting[at + 2]?.id ?? null)}><Icon name="down" /></button>
        {job.state === 'held'
          ? <button class="quiet" onClick={() => act('POST', `jobs/${job.id}/start`)} aria-label={`Release ${job.name}`} title="Release"><Icon name="play" /></button>
          : <button class="quiet" onClick={() => act('PATCH', `jobs/${job.id}`, { hold: true })} aria-label={`Hold ${job.name}`} title="Hold"><Icon name="pause" /></button>}
        <button class="quiet" onClick={() => remove(job)} aria-label={`Delete ${job.name}`} title="Delete"><Icon name="cross" /></button>
      </span>
    </div>
  );
}

function WaitingRow(props: RowProps) {
  const { job, waiting, at, drag, setDrag } = props;
  const over = (event: DragEvent) => {
    if (!drag) return;
    event.preventDefault();
    const box = (event.currentTarget as HTMLElement).getBoundingClientRect();
    const after = event.clientY > box.top + box.height / 2;
    setDrag({ id: drag.id, before: after ? (waiting[at + 1]?.id ?? null) : job.id });
  };
  const drop = (event: DragEvent) => {
    if (!drag) return;
    event.preventDefault();
    if (drag.before !== undefined && drag.before !== drag.id) void move(drag.id, drag.before);
    setDrag(null);
  };
  const last = at === waiting.length - 1;
  const mark = !drag || drag.before === undefined ? '' : drag.before === job.id ? 'over' : last && drag.before === null ? 'under' : '';
  return (
    <li class={`job ${mark} ${drag?.id === job.id ? 'dragged' : ''}`} data-testid="job" data-job={job.id} draggable onDragOver={over} onDrop={drop}
      onDragStart={(event) => (event.dataTransfer?.setData('text/plain', job.name), setDrag({ id: job.id, before: undefined }))}
      onDragEnd={() => setDrag(null)}>
      <Thumbnail job={job} />
      <button class="name-button" onClick={() => show(job)} title={`Show ${job.name}`}>
        <span class="name">{job.name}</span>
        <Facts job={job} readyIn_s={props.readyIn_s} />
      </button>
      <WaitingTools {...props} />
    </li>
  );
}

function EndedRow({ job }: { job: Job }) {
  const took_s = job.started && job.ended ? (Date.parse(job.ended) - Date.parse(job.started)) / 1000 : 0;
  const words = job.state === 'done' ? (took_s > 0 ? `Printed in ${format.duration(took_s)}` : 'Printed') : job.state === 'cancelled' ? 'Cancelled' : 'Failed';
  return (
    <li class="job ended" data-testid="ended" data-job={job.id} data-state={job.state}>
      <Thumbnail job={job} />
      <button class="name-button" onClick={() => show(job)} title={`Show ${job.name}`}>
        <span class="name">{job.name}</span>
        <span class={`outcome ${job.state}`}>{words}{job.error && `: ${job.error}`}</span>
      </button>
      <span class="buttons">
        <button class="quiet" onClick={() => act('POST', `jobs/${job.id}/start`)} aria-label={`Print ${job.name} again`} title="Print again"><Icon name="again" /></button>
        <button class="quiet" onClick={() => remove(job)} aria-label={`Delete ${job.name}`} title="Delete"><Icon name="cross" /></button>
      </span>
    </li>
  );
}

function RunningRow({ job }: { job: Job }) {
  const { thousandths, left } = useStore((s) => {
    const progress = progressOf(job, s.status);
    return { thousandths: Math.round(progress.fraction * 1000), left: format.duration(progress.remaining_s) };
  });
  return (
    <li class="job running" data-testid="running" data-job={job.id}>
      <Thumbnail job={job} />
      <button class="name-button" onClick={() => store.set({ shown: null })} title={`Show ${job.name}`}>
        <span class="name">{job.name}</span>
        <progress max={1000} value={thousandths} aria-label="Printed" />
        <span class="facts">{format.wholePercent(thousandths / 1000)} · {left} left</span>
      </button>
    </li>
  );
}

/** Why nothing starts by itself, and the button that lets it. */
function Gate() {
  const gate = useStore((s) => s.gate);
  if (gate.bed_occupied) {
    return (
      <div class="gate" role="status" data-testid="gate">
        <p><strong>Take the part off the bed.</strong> The next job starts when the bed is clear.</p>
        <button class="primary" onClick={() => act('POST', 'machine/bed-cleared')}>The bed is clear</button>
      </div>
    );
  }
  if (!gate.held) return null;
  return (
    <div class="gate" role="status" data-testid="gate">
      <p><strong>The queue waits.</strong> {format.sentence(gate.reason ?? '')}</p>
      <button onClick={() => act('POST', 'queue/release')}>Go on with the queue</button>
    </div>
  );
}

export function Queue() {
  const jobs = useStore((s) => s.jobs);
  const held = useStore((s) => s.gate.held);
  const shown = useStore((s) => shownJob(s)?.id ?? null);
  const ends = useStore((s) => {
    const perMinute: Record<number, number> = {};
    queueEnds(s).forEach((seconds, id) => { perMinute[id] = Math.round(seconds / 60) * 60; });
    return perMinute;
  });
  const [drag, setDrag] = useState<Drag | null>(null);
  const waiting = jobs.filter(isWaiting);
  const ended = jobs.filter((job) => !isRunning(job) && !isWaiting(job));
  return (
    <div class="card queue" data-shown={shown}>
      <div class="row head">
        <h2>Queue{waiting.length > 0 && <span class="muted"> · {waiting.length} waiting</span>}</h2>
        {!held && waiting.length > 0 && <button class="quiet" onClick={() => act('POST', 'queue/hold')} title="The print that runs is finished; no other starts">Hold all</button>}
      </div>
      <Gate />
      {jobs.length === 0 && <p class="muted empty">Nothing yet. Drop a file above, or send one from your slicer.</p>}
      <ol class="list" data-testid="queue">
        {jobs.filter(isRunning).map((job) => <RunningRow key={job.id} job={job} />)}
        {waiting.map((job, at) => (
          <WaitingRow key={job.id} job={job} waiting={waiting} at={at} readyIn_s={ends[job.id]} drag={drag} setDrag={setDrag} />
        ))}
      </ol>
      {ended.length > 0 && (
        <>
          <h3>Finished</h3>
          <ol class="list" data-testid="ended-list">{ended.slice(0, ENDED_SHOWN).map((job) => <EndedRow key={job.id} job={job} />)}</ol>
        </>
      )}
    </div>
  );
}
