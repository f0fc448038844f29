import type { ComponentChildren, JSX } from 'preact';
import { useEffect, useRef, useState } from 'preact/hooks';
import { act, loadMore, removeJob, repeatSearch, startSearch } from '../api';
import * as format from '../format';
import { useStore } from '../hooks';
import { endedCount, isEnded, isSearch, lineToName, STATE_CHOICES, waitingCount } from '../jobs';
import { ask, isRunning, isStillThere, isWaiting, knownJob, lacks, onTheWall, progressNow, shownJob, store } from '../store';
import type { Job } from '../types';
import { Icon } from './Icon';
import { Name } from './Name';
import { Refusal } from './Refusal';

const TYPING_MS = 300;
const SEARCH_FROM_JOBS = 8; // so few are found by looking
const show = (job: Job) => store.set({ shown: job });
/** A name where only text can stand: a title, a label. */
const plain = (job: Job) => format.visible(job.name);

/** Deletes a job; the focus, which was in its row, goes to the row that takes its place. */
async function remove(job: Job, button: HTMLElement): Promise<void> {
  const row = button.closest('li')!;
  const heirs = [row.nextElementSibling, row.previousElementSibling].filter((each) => each !== null);
  const heading = row.closest('.queue')?.querySelector<HTMLElement>('h2');
  if (!(await ask(`Delete ${format.quoted(job.name)}? Its file is deleted with it.`, 'Delete', (s) => isStillThere(s, job)))) return;
  await removeJob(job.id);
  requestAnimationFrame(() => {
    if (row.isConnected) return;
    const heir = heirs.find((each) => each.isConnected)?.querySelector<HTMLElement>('.name-button');
    (heir ?? heading)?.focus();
  });
}
const change = (job: Job, method: string, path: string, body?: unknown) => act(`job-${job.id}`, method, `jobs/${job.id}${path}`, body);

/** A number that was refused does not stay in its field. */
async function setCopies(job: Job, field: HTMLInputElement): Promise<void> {
  if (!(await change(job, 'PATCH', '', { copies: Number(field.value) }))) field.value = String(knownJob(store.state, job.id)?.copies ?? job.copies);
}

/** Puts `moved` before `before` (null: at the end). */
const move = (moved: number, before: number | null) => act(`job-${moved}`, 'PATCH', `jobs/${moved}`, { before });

function Thumbnail({ job }: { job: Job }) {
  if (job.facts.thumbnail) return <img class="thumb" src={`api/v1/jobs/${job.id}/thumbnail`} alt="" loading="lazy" decoding="async" />;
  return <span class="thumb"><Icon name="box" size={20} /></span>;
}

function Facts({ job, readyIn_s }: { job: Job; readyIn_s: number | undefined }) {
  const parts = [
    job.facts.estimated_s ? format.duration(job.facts.estimated_s) : null,
    readyIn_s === undefined ? null : `ready ${format.clock(readyIn_s, new Date())}`,
    job.copies > 1 ? (job.copies_done > 0 ? `${job.copies_done} of ${job.copies} done` : `×${job.copies}`) : null,
    job.facts.filament_mm ? `${(job.facts.filament_mm / 1000).toFixed(2)} m` : null,
  ].filter(Boolean);
  return (
    <span class="facts" title={format.bytes(job.size)}>
      {job.state === 'held' && <span class="chip small state-paused">On hold</span>}
      {parts.length > 0 ? parts.join(' · ') : format.bytes(job.size)}
    </span>
  );
}

/** The dragged job, and its place among the waiting ones: before that one, or (null) at the end. */
interface Drag {
  id: number;
  before: number | null | undefined;
}

interface RowProps {
  job: Job;
  /** The waiting jobs in their order, as far as they are listed; `more` wait behind them. */
  waiting: Job[];
  more: boolean;
  /** Its place there; -1: it is listed for itself, out of a search. */
  at: number;
  readyIn_s: number | undefined;
  drag: Drag | null;
  setDrag: (drag: Drag | null) => void;
  /** The row whose tools are shown. */
  open: number | null;
  setOpen: (job: number | null) => void;
  /** It is the one that the page shows. */
  current: boolean;
}

/** The name, which shows the job; the row's second line stands under it. */
function NameButton({ job, current, press, children }: { job: Job; current: boolean; press: () => void; children: ComponentChildren }) {
  return (
    <button class="name-button" onClick={press} title={`Show ${plain(job)}`} aria-current={current ? 'true' : undefined}>
      <span class="name"><Name>{job.name}</Name></span>
      {children}
    </button>
  );
}

function WaitingTools({ job, waiting, more, at }: RowProps) {
  const simple = useStore((s) => lacks(s, 'queue'));
  // Behind it are jobs that are not listed: the page does not know the next one.
  const last = at >= waiting.length - (more ? 2 : 1);

  return (
    <div class="tools" id={`tools-${job.id}`}>
      {!simple && <label class="copies">
        Copies <input type="number" inputMode="numeric" min={Math.max(1, job.copies_done)} max={1000} value={job.copies} aria-label={`Copies of ${plain(job)}`}
          onChange={(event) => void setCopies(job, event.currentTarget)} />
      </label>}
      <span class="buttons">
        {at >= 0 && !simple && <button class="quiet" disabled={at === 0} aria-label={`Move ${plain(job)} up`} title="Earlier"
          onClick={() => move(job.id, waiting[at - 1].id)}><Icon name="up" /></button>}
        {at >= 0 && !simple && <button class="quiet" disabled={last} aria-label={`Move ${plain(job)} down`} title="Later"
          onClick={() => move(job.id, waiting[at + 2]?.id ?? null)}><Icon name="down" /></button>}
        {job.state === 'held'
          ? <button class="quiet" onClick={() => change(job, 'POST', '/start')} aria-label={`Release ${plain(job)}`} title="Release"><Icon name="play" /></button>
          : !simple && <button class="quiet" onClick={() => change(job, 'PATCH', '', { hold: true })} aria-label={`Hold ${plain(job)}`} title="Hold"><Icon name="pause" /></button>}
        <button class="quiet" onClick={(event) => void remove(job, event.currentTarget)} aria-label={`Delete ${plain(job)}`} title="Delete"><Icon name="cross" /></button>
      </span>
    </div>
  );
}

function WaitingRow(props: RowProps) {
  const { job, waiting, more, at, drag, setDrag, current } = props;
  const open = props.open === job.id;
  const over = (event: DragEvent) => {
    if (!drag) return;
    event.preventDefault();
    const box = (event.currentTarget as HTMLElement).getBoundingClientRect();
    const after = event.clientY > box.top + box.height / 2;
    if (after && at === waiting.length - 1 && more) return;
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
    <li class={`job ${mark} ${drag?.id === job.id ? 'dragged' : ''} ${current ? 'current' : ''}`} data-testid="job" data-job={job.id} draggable={at >= 0 && !lacks(store.state, 'queue')} onDragOver={over} onDrop={drop}
      onDragStart={(event) => (event.dataTransfer?.setData('text/plain', job.name), setDrag({ id: job.id, before: undefined }))}
      onDragEnd={() => setDrag(null)}>
      <Thumbnail job={job} />
      <NameButton job={job} current={current} press={() => show(job)}><Facts job={job} readyIn_s={props.readyIn_s} /></NameButton>
      <button class="quiet" aria-expanded={open} aria-controls={open ? `tools-${job.id}` : undefined} aria-label={`More for ${plain(job)}`} title="Copies, order, hold, delete"
        onClick={() => props.setOpen(open ? null : job.id)}>⋯</button>
      {open && <WaitingTools {...props} />}
      <Refusal at={`job-${job.id}`} />
    </li>
  );
}

/** In a line: what became of it, and where. Why it failed stands in its card. */
function EndedRow({ job, current }: { job: Job; current: boolean }) {
  const took = job.printed_s ? ` in ${format.duration(job.printed_s)}` : '';
  const words = job.state === 'done' ? `Printed${took}` : job.state === 'cancelled' ? 'Cancelled' : 'Failed';
  const line = lineToName(job, job.stopped_line);
  const place = line ? ` at line ${format.count(line)}` : '';
  return (
    <li class={`job ended ${current ? 'current' : ''}`} data-testid="ended" data-job={job.id} data-state={job.state}>
      <Thumbnail job={job} />
      <NameButton job={job} current={current} press={() => show(job)}>
        <span class={`outcome ${job.state}`} title={job.error ? format.visible(job.error) : undefined}>{words}{place}</span>
      </NameButton>
      <span class="buttons">
        <button class="quiet" onClick={() => change(job, 'POST', '/start')} aria-label={`Print ${plain(job)} again`} title="Print again"><Icon name="again" /></button>
        <button class="quiet" onClick={(event) => void remove(job, event.currentTarget)} aria-label={`Delete ${plain(job)}`} title="Delete"><Icon name="cross" /></button>
      </span>
      <Refusal at={`job-${job.id}`} />
    </li>
  );
}

function RunningRow({ job, current }: { job: Job; current: boolean }) {
  const { thousandths, left } = useStore((s) => {
    const progress = progressNow(job, s.status);
    return { thousandths: Math.floor(progress.fraction * 1000), left: format.duration(progress.remaining_s) };
  });
  return (
    <li class={`job running ${current ? 'current' : ''}`} data-testid="running" data-job={job.id}>
      <Thumbnail job={job} />
      <NameButton job={job} current={current} press={() => store.set({ shown: null })}>
        <progress max={1000} value={thousandths} aria-label="Printed" />
        <span class="facts">{format.done(thousandths / 1000)} · {left} left</span>
      </NameButton>
    </li>
  );
}

/** That everything starts by itself. Why nothing does is said above the columns (WhatNow). */
function Gate() {
  const { held, confirm_bed } = useStore((s) => s.gate);
  return (
    <>
      {confirm_bed === false && (
        <p class="queue-note warn" data-testid="no-confirm">
          Nobody is asked whether the bed is clear: the next job starts by itself, onto whatever lies there.
        </p>
      )}
      {!held && <Refusal at="queue" />}
    </>
  );
}

/** Looks for jobs by name and by state; typing is waited for. */
function SearchRow() {
  const search = useStore((s) => s.search);
  const counts = useStore((s) => s.counts);
  const [text, setText] = useState(search.text);
  const typed = useRef<HTMLInputElement>(null);
  useEffect(() => setText(search.text), [search]);
  useEffect(() => {
    if (text === search.text) return undefined;
    const timer = setTimeout(() => void startSearch({ ...search, text }), TYPING_MS);
    return () => clearTimeout(timer);
  }, [text, search]);
  // Any change in the queue may change the search's result.
  useEffect(() => {
    if (!isSearch(search)) return undefined;
    const timer = setTimeout(() => void repeatSearch(), TYPING_MS);
    return () => clearTimeout(timer);
  }, [counts]);
  return (
    <div class="row search">
      <input ref={typed} type="search" value={text} placeholder="Search by name" aria-label="Search jobs by name" data-testid="search"
        onInput={(event) => setText(event.currentTarget.value)} />
      <select value={search.states} aria-label="Jobs of which state" data-testid="states"
        // A busy computer has not yet drawn what was typed: the field has the last word.
        onChange={(event) => void startSearch({ text: typed.current?.value ?? text, states: event.currentTarget.value })}>
        {STATE_CHOICES.map(({ words, states }) => <option key={states} value={states}>{words}</option>)}
      </select>
    </div>
  );
}

function More({ there, words }: { there: boolean; words: string }) {
  const [busy, setBusy] = useState(false);
  if (!there) return null;
  const more = async () => {
    setBusy(true);
    await loadMore();
    setBusy(false);
  };
  return <button class="more" disabled={busy} data-testid="more" onClick={more}>{busy ? 'Loading …' : words}</button>;
}

/** What a search has found, in one list. */
function Found({ row }: { row: (job: Job, at: number) => JSX.Element }) {
  const found = useStore((s) => s.found);
  if (!found) return <p class="muted empty" role="status">Searching …</p>;
  return (
    <>
      <p class="muted empty" role="status">
        {found.jobs.length === 0 ? 'No such job.' : `${format.count(found.jobs.length)}${found.next_before === null ? '' : ' and more'} found`}
      </p>
      <ol class="list" data-testid="found-list">{found.jobs.map((job) => row(job, -1))}</ol>
      <More there={found.next_before !== null} words="Show more" />
    </>
  );
}

function All({ row }: { row: (job: Job, at: number) => JSX.Element }) {
  const { jobs, older, counts, older_before } = useStore((s) => ({ jobs: s.jobs, older: s.older, counts: s.counts, older_before: s.older_before }));
  const waiting = jobs.filter(isWaiting);
  const ended = [...jobs.filter(isEnded), ...older];
  const hidden = waitingCount(counts) - waiting.length;
  return (
    <>
      {jobs.length === 0 && <p class="muted empty">Nothing yet. Drop a file above, or send one from your slicer.</p>}
      <ol class="list" data-testid="queue">
        {jobs.filter(isRunning).map((job) => row(job, -1))}
        {waiting.map(row)}
      </ol>
      {hidden > 0 && <button class="more" onClick={() => startSearch({ text: '', states: 'queued,held' })}>Show {format.count(hidden)} more that wait</button>}
      {ended.length > 0 && (
        <>
          <h3>Finished <span class="muted">· {format.count(Math.max(ended.length, endedCount(counts)))}</span></h3>
          <ol class="list" data-testid="ended-list">{ended.map((job) => row(job, -1))}</ol>
        </>
      )}
      <More there={older_before !== null && ended.length > 0} words="Show older ones" />
    </>
  );
}

export function Queue() {
  const jobs = useStore((s) => s.jobs);
  const counts = useStore((s) => s.counts);
  const searching = useStore((s) => isSearch(s.search));
  const held = useStore((s) => s.gate.held);
  const simple = useStore((s) => lacks(s, 'queue'));
  const volatile = useStore((s) => (s.gate.durable === false
    ? `Jobs are in its memory alone: without power they are gone.${s.gate.places === 1 ? ' One prints, and one may wait.' : ''}` : null));
  const shown = useStore((s) => shownJob(s)?.id ?? null);
  const ends = useStore((s) => {
    const perMinute: Record<number, number> = {};
    for (const [id, seconds] of Object.entries(s.status?.ready_in_s ?? {})) perMinute[Number(id)] = Math.round((onTheWall(seconds, s.status) ?? 0) / 60) * 60;
    return perMinute;
  });
  const [drag, setDrag] = useState<Drag | null>(null);
  const [open, setOpen] = useState<number | null>(null);
  const waiting = jobs.filter(isWaiting);
  const waitingInAll = Math.max(waiting.length, waitingCount(counts));
  const row = (job: Job, at: number) => (isEnded(job) ? <EndedRow key={job.id} job={job} current={job.id === shown} />
    : isRunning(job) ? <RunningRow key={job.id} job={job} current={job.id === shown} />
    : <WaitingRow key={job.id} job={job} waiting={waiting} more={waitingInAll > waiting.length} at={at} readyIn_s={ends[job.id]} drag={drag} setDrag={setDrag}
        open={open} setOpen={setOpen} current={job.id === shown} />);
  return (
    <div class="card queue">
      <div class="row head">
        <h2 tabIndex={-1}>Queue{waitingInAll > 0 && <span class="muted"> · {format.count(waitingInAll)} waiting</span>}</h2>
        {!held && !simple && waiting.length > 0 && <button class="quiet" onClick={() => act('queue', 'POST', 'queue/hold')} title="The print that runs is finished; no other starts">Hold all</button>}
      </div>
      <Gate />
      {volatile && <p class="muted small-note" data-testid="volatile">{volatile}</p>}
      {(searching || counts.total > SEARCH_FROM_JOBS) && <SearchRow />}
      <Refusal at="list" />
      {searching ? <Found row={row} /> : <All row={row} />}
    </div>
  );
}
