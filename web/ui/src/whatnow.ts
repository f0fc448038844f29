// What a person must do before the next job starts, in the one order in which it works. Pure.
//
//   fault ─► clear it ─► bed ─► clear it ─► queue ─► let it go on
//
// Only the first step has its button: the printer would refuse the others.
import { isEnded, isRunning, isWaiting, stopOf, waitingCount } from './jobs';
import { lacks, type State } from './store';
import type { Job } from './types';

/** A sentence: a name in it is somebody else's text, and shown as such. */
export type Words = (string | { name: string })[];

export interface Step {
  key: 'fault' | 'bed' | 'gate';
  words: Words;
  button: string;
  path: string;
}

export interface WhatNow {
  kind: 'danger' | 'warning';
  title: Words;
  /** The cause, once on the whole page. Empty: the title says it. */
  why: string;
  /** The job that this is about, and where it stopped. Empty: none. */
  where: Words;
  /** At least one. */
  steps: Step[];
}

const placeOf = (job: Job): Words => {
  const { layer } = stopOf(job, null);
  return [{ name: job.name }, layer ? `, layer ${layer}${job.facts.layers ? ` of ${job.facts.layers}` : ''}` : ''];
};

/** The job whose failure has stopped the printer or its queue; null: another reason has. */
export function failedJob({ jobs, status, gate }: State): Job | null {
  const last = jobs.find(isEnded) ?? null;
  return last?.state === 'failed' && (status?.state === 'faulted' || gate.held) ? last : null;
}

function stepsOf(state: State, faulted: boolean, occupied: boolean, next: Job | undefined): Step[] {
  const { jobs, gate, counts } = state;
  const steps: Step[] = [];
  if (faulted) steps.push({ key: 'fault', words: ['See to the cause, then clear the fault.'], button: 'Clear fault', path: 'machine/clear-fault' });
  if (occupied) {
    const left = jobs.find(isEnded)?.name;
    steps.push({ key: 'bed', words: left ? ['Take what ', { name: left }, ' left off the bed, then say so.'] : ['Take what may lie there off the bed, then say so.'], button: 'Bed is clear', path: 'machine/bed-cleared' });
  }
  if (gate.held) {
    const others = waitingCount(counts) - 1;
    const words: Words = !next ? ['Let the queue go on: nothing waits in it now.']
      : ['Let the queue go on with ', { name: next.name }, others > 0 ? `, and ${others} more.` : '.'];
    steps.push({ key: 'gate', words, button: 'Go on with the queue', path: 'queue/release' });
  }
  return steps;
}

/** Null: nothing has to be done. */
export function whatNow(state: State): WhatNow | null {
  const { status, jobs, gate } = state;
  if (!state.online || !status) return null;
  const faulted = status.state === 'faulted';
  const occupied = gate.bed_occupied && !jobs.some(isRunning);
  const next = jobs.find(isWaiting);
  const steps = stepsOf(state, faulted, occupied, next);
  if (steps.length === 0) return null;
  const failed = failedJob(state);
  const where = failed ? placeOf(failed) : [];
  if (faulted) return { kind: 'danger', title: ['Stopped.'], why: status.fault ?? 'the machine has a fault', where, steps };
  if (gate.held && !lacks(state, 'queue')) return { kind: 'warning', title: ['The queue waits.'], why: gate.reason ?? '', where: [], steps };
  const title: Words = next ? [{ name: next.name }, ' waits for a clear bed.'] : ['The next job will wait for a clear bed.'];
  return { kind: 'warning', title, why: 'it would be printed into whatever lies there', where: [], steps };
}
