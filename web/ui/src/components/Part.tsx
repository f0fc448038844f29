import { useEffect, useState } from 'preact/hooks';
import { act, inspection } from '../api';
import * as format from '../format';
import { useStore } from '../hooks';
import { hasStopped, lineToName, stopOf } from '../jobs';
import { activityShares, cssColour } from '../layers';
import type { ActivityShare } from '../layers';
import { ask, isRunning, isStillRunning, onTheWall, progressNow, shownJob, store, timeFactor } from '../store';
import type { Inspection, Job } from '../types';
import { failedJob } from '../whatnow';
import { Name } from './Name';
import { Refusal } from './Refusal';
import { AsOf } from './Silence';
import { Stage } from './Stage';
import { Steered } from './Steered';

/** What a pause has done, and what its end will do. */
function PauseNote() {
  const { state, parked, off, idle, timeout_s } = useStore(({ status, jobs }) => {
    const facts = jobs.find(isRunning)?.facts;
    const lacksHeat = (asked: number | null | undefined, target_c: number | undefined) => (asked ?? 0) > 0 && target_c === 0;
    return {
      state: status?.state, parked: status?.parked, idle: status?.idle_timed_out ?? false, timeout_s: status?.idle_timeout_s ?? 0,
      off: lacksHeat(facts?.hot_end_c, status?.hot_end.target_c) || lacksHeat(facts?.bed_c, status?.bed.target_c),
    };
  });
  if (state !== 'paused') return null;
  return (
    <p class="pause-note" data-testid="pause-note">
      {parked && <><strong>Parked.</strong> The filament may be changed: jog, extrude and heat work. </>}
      {idle && <>The heaters were switched off: nobody had used them for {format.duration(timeout_s)}. </>}
      {off || idle ? 'Resume heats up again first, then ' : 'Resume '}goes back to exactly where it stopped.
    </p>
  );
}

function Actions({ job }: { job: Job }) {
  const state = useStore((s) => s.status?.state);
  const cancel = async () => (await ask(`Cancel ${format.quoted(job.name)}? What is printed so far cannot be continued.`, 'Cancel the print', (s) => isStillRunning(s, job))) && act('print', 'POST', 'machine/cancel');
  return (
    <>
      <PauseNote />
      <div class="actions">
        {state === 'paused' || state === 'pausing'
          ? <button class="primary" disabled={state === 'pausing'} onClick={() => act('print', 'POST', 'machine/resume')}>
              {state === 'pausing' ? 'Pausing …' : 'Resume'}</button>
          : <button class="primary" disabled={state !== 'printing'} onClick={() => act('print', 'POST', 'machine/pause')}>Pause</button>}
        <button class="danger-button" disabled={state === 'cancelling'} onClick={cancel}>
          {state === 'cancelling' ? 'Cancelling …' : 'Cancel'}</button>
      </div>
      <Refusal at="print" />
    </>
  );
}

function Progress({ job }: { job: Job }) {
  const { fraction, left, readyAt, layer, factor } = useStore((s) => {
    const progress = progressNow(job, s.status);
    return {
      fraction: Math.floor(progress.fraction * 1000) / 1000, left: format.duration(progress.remaining_s),
      readyAt: format.clock(onTheWall(progress.remaining_s, s.status), new Date()), layer: s.status?.layer ?? 0,
      factor: timeFactor(s.status),
    };
  });
  return (
    <div class="job-progress" data-testid="progress">
      <progress max={1} value={fraction} aria-label="Printed" />
      <dl class="figures four">
        <div><dt>Done</dt><dd data-testid="percent">{format.done(fraction)}</dd></div>
        <div><dt>Left</dt><dd>{left}</dd></div>
        <div><dt>Ready at</dt><dd>{readyAt}</dd></div>
        <div><dt>Layer</dt><dd>{layer || '–'}{job.facts.layers ? <small> of {job.facts.layers}</small> : ''}</dd></div>
      </dl>
      <AsOf />
      {factor !== 1 && <p class="muted small-note">Simulated: the time left is the printer's, which passes {format.factor(factor)} as fast as the clock on the wall.</p>}
      <Steered><Actions job={job} /></Steered>
    </div>
  );
}

/** A print that did not come to its end: why, and where. */
function Stopped({ job }: { job: Job }) {
  const { line, layer, percent, told } = useStore((s) => {
    const { fraction, ...stop } = stopOf(job, s.status);
    return { line: lineToName(job, stop.line), layer: stop.layer, percent: fraction === null ? null : format.percent(fraction), told: failedJob(s)?.id === job.id };
  });
  const place = [
    line ? `at line ${format.count(line)}` : null,
    layer ? `in layer ${layer}${job.facts.layers ? ` of ${job.facts.layers}` : ''}` : null,
    job.printed_s ? `after ${format.duration(job.printed_s)}` : percent ? `after ${percent} of the file` : null,
  ].filter(Boolean);
  return (
    <div class={`report ${job.state === 'failed' ? 'bad' : 'neutral'}`} data-testid="stopped">
      <p><strong>{job.state === 'failed' ? 'This print failed' : 'This print was cancelled'}{place.length > 0 && ` ${place.join(', ')}`}.</strong></p>
      {job.error && !told && <p><Name>{format.sentence(job.error)}</Name></p>}
    </div>
  );
}

/** What a job is, while it does not print. */
function Facts({ job }: { job: Job }) {
  const { facts } = job;
  const heat = [facts.hot_end_c ? `${Math.round(facts.hot_end_c)} °C` : null, facts.bed_c ? `${Math.round(facts.bed_c)} °C` : null];
  return (
    <dl class="figures four">
      {job.state === 'done' && job.printed_s !== null
        ? <div><dt>Printed in</dt><dd>{format.duration(job.printed_s)}</dd></div>
        : <div><dt>Estimated</dt><dd>{format.duration(facts.estimated_s)}</dd></div>}
      <div><dt>Filament</dt><dd>{facts.filament_mm ? `${(facts.filament_mm / 1000).toFixed(2)} m` : '–'}</dd></div>
      <div><dt>Layers</dt><dd>{facts.layers ?? '–'}</dd></div>
      <div><dt>Hot end · bed</dt><dd>{heat.map((each) => each ?? 'off').join(' · ')}</dd></div>
    </dl>
  );
}

/** What the estimated time goes into: a bar, and its parts in words. */
function TimeShares({ job }: { job: Job }) {
  const shares = activityShares(job.facts.activities_s);
  if (shares.length === 0) return null;
  const paint = (share: ActivityShare) => (e: HTMLElement | null) => {
    if (!e) return;
    e.style.flexGrow = String(share.share);
    if (share.colour) e.style.background = cssColour(share.colour);
  };
  return (
    <details class="time-shares" data-testid="time-shares">
      <summary>
        Time by feature
        <span class="share-bar" aria-hidden="true">{shares.map((share) => <i key={share.name} ref={paint(share)} />)}</span>
      </summary>
      <table>
        <tbody>
          {shares.map((share) => (
            <tr key={share.name}>
              <th scope="row"><i ref={paint(share)} />{share.name}</th>
              <td>{format.duration(share.seconds)}</td>
              <td>{format.percent(share.share)}</td>
            </tr>
          ))}
        </tbody>
      </table>
      <p class="muted small-note">
        Estimated by the printer itself, with its own limits and heaters.
        {job.facts.slicer_s ? ` The slicer says ${format.duration(job.facts.slicer_s)}.` : ''}
      </p>
    </details>
  );
}

/**
 * The virtual machine's own word on a finished print. It may come after the print's end: the list
 * of jobs is sent again when it does, and is asked about then.
 */
function Report({ job }: { job: Job }) {
  const [found, setFound] = useState<Inspection | null>(null);
  const jobs = useStore((s) => s.jobs);
  useEffect(() => {
    if (found) return;
    let gone = false;
    void inspection(job.id).then((report) => gone || setFound(report));
    return () => {
      gone = true;
    };
  }, [job.id, jobs]);
  if (!found) return null;
  const worst_mm = Math.max(0, ...Object.values(found.path_deviation_mm_max ?? {}));
  const lost = Object.values(found.lost_steps ?? {}).reduce((sum, steps) => sum + steps, 0);
  return (
    <div class={`report ${found.matches ? 'good' : 'bad'}`} data-testid="report">
      <p><strong>{found.matches ? 'Inspected: what was built is what was asked.' : 'Inspected: what was built differs from what was asked.'}</strong></p>
      <p class="muted">
        Path within {(worst_mm * 1000).toFixed(1)} µm · {format.count(lost)} lost steps · {found.filament_mm.built.toFixed(1)} of {found.filament_mm.asked.toFixed(1)} mm filament
      </p>
      {found.differences.length > 0 && <ul>{found.differences.slice(0, 5).map((text, i) => <li key={i}><Name>{text}</Name></li>)}</ul>}
    </div>
  );
}

function Remarks({ job }: { job: Job }) {
  const { warnings } = job.facts;
  if (!warnings?.length) return null;
  return (
    <details class="warnings">
      <summary>{warnings.length === 1 ? '1 remark' : `${warnings.length} remarks`} on this file</summary>
      <ul>{warnings.map((one, i) => <li key={i}>{one.line > 0 && `Line ${one.line}: `}<Name>{one.message}</Name></li>)}</ul>
    </details>
  );
}

export function Part() {
  const job = useStore(shownJob);
  const running = useStore((s) => s.jobs.find(isRunning) ?? null);
  const faulted = useStore((s) => s.status?.state === 'faulted');
  const other = running !== null && running.id !== job?.id;
  return (
    <div class="card part-card">
      <div class="row head">
        <h2 class="name">{job ? <Name>{job.name}</Name> : faulted ? 'Stopped, while nothing printed' : 'Nothing to print'}</h2>
        {other && <button class="quiet" onClick={() => store.set({ shown: null })}>Back to the print</button>}
      </div>
      <Stage job={job} />
      {job && !isRunning(job) && <Facts job={job} />}
      {job && hasStopped(job.state) && <Stopped job={job} />}
      {job?.state === 'done' && <Report key={job.id} job={job} />}
      {job && <TimeShares job={job} />}
      {job && <Remarks job={job} />}
      {other && <h3 class="name">Printing <Name>{running.name}</Name></h3>}
      {running && <Progress job={running} />}
    </div>
  );
}
