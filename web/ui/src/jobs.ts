// The list of jobs as pages. The live stream brings the first page whenever it changes; older pages
// are fetched. Pure.
//
//     jobs   running, the first waiting ones, the newest ended ones      live, replaced as a whole
//     older  ended ones behind those, as far as a person has gone back   kept while they still join
//                                                                        the first page
import type { Job, JobCounts, JobState, Status } from './types';

export const PAGE_JOBS = 100;
export const RELOAD_JOBS_MAX = 1000;

export const isRunning = (job: Job): boolean => job.state === 'printing' || job.state === 'paused';
export const isWaiting = (job: Job): boolean => job.state === 'queued' || job.state === 'held' || job.state === 'uploading';
export const isEnded = (job: Job): boolean => !isRunning(job) && !isWaiting(job);

/** What a person looks for; both empty: everything, in its usual order. */
export interface Search {
  text: string;
  /** Joined by commas, as the interface takes them. */
  states: string;
}
export const STATE_CHOICES: readonly { words: string; states: string }[] = [
  { words: 'All jobs', states: '' }, { words: 'Waiting', states: 'queued,held' }, { words: 'Printed', states: 'done' },
  { words: 'Cancelled', states: 'cancelled' }, { words: 'Failed', states: 'failed' },
];
export const isSearch = (search: Search): boolean => search.text.trim() !== '' || search.states !== '';

/** The query of GET /api/v1/jobs. */
export function listPath(search: Search, limit: number, before: number | null): string {
  const query = new URLSearchParams({ limit: String(limit) });
  if (before !== null) query.set('before', String(before));
  if (search.states) query.set('state', search.states);
  if (search.text.trim()) query.set('q', search.text.trim());
  return `jobs?${query}`;
}

/**
 * The ended jobs behind a new first page, out of those that were known in order: what the page has
 * pushed out comes back at the front. None, when the new page does not reach what was known: then
 * there would be a gap.
 */
export function olderBehind(known: Job[], page: Job[]): Job[] {
  const onPage = new Set(page.map((job) => job.id));
  const last = page.filter(isEnded).pop();
  const at = last ? known.findIndex((job) => job.id === last.id) : -1;
  return at < 0 ? [] : known.slice(at + 1).filter((job) => !onPage.has(job.id));
}

/** `list` with what newer answers say of the same jobs. */
export function renewed(list: Job[], newer: Job[]): Job[] {
  const byId = new Map(newer.map((job) => [job.id, job]));
  return list.some((job) => byId.has(job.id)) ? list.map((job) => byId.get(job.id) ?? job) : list;
}

/** Joins a further page, whatever has moved between the two answers. */
export function joined(list: Job[], page: Job[]): Job[] {
  const seen = new Set(list.map((job) => job.id));
  return [...list, ...page.filter((job) => !seen.has(job.id))];
}

export const waitingCount = (counts: JobCounts): number => counts.queued + counts.held;
export const endedCount = (counts: JobCounts): number => counts.done + counts.cancelled + counts.failed;

/**
 * The place where a job stopped: its line and layer, and the executed part of the file; null where
 * unknown.
 */
export interface Stop {
  line: number | null;
  layer: number | null;
  fraction: number | null;
}

/**
 * The line to name for a stopped job. Null where its error names one: that line could not be done,
 * and was read ahead of the one that had been printed by then. Two lines for one failure confuse.
 */
export const lineToName = (job: Job, line: number | null): number | null => (/\bline \d/i.test(job.error ?? '') ? null : line);

/** A stopped job is known best by the machine, as long as it still speaks of it. */
export function stopOf(job: Job, status: Status | null): Stop {
  const fresh = status?.job === job.id ? status : null;
  const line = job.stopped_line ?? (fresh ? fresh.line : null);
  const byte = job.stopped_byte ?? (fresh ? fresh.bytes_executed : null);
  const fraction = byte !== null && job.size > 0 ? byte / job.size : line && job.facts.lines ? line / job.facts.lines : null;
  return { line, layer: job.stopped_layer ?? (fresh ? fresh.layer : null), fraction: fraction === null ? null : Math.min(1, fraction) };
}

/**
 * How many bytes of a job lie on the bed, as the picture of its part needs it: of a running one
 * what is executed, of a stopped one what was until then; else all (Infinity).
 */
export function bytesLaid(job: Job | null, status: Status | null): number {
  if (!job || !(isRunning(job) || hasStopped(job.state))) return Infinity;
  if (status?.job === job.id) return status.bytes_executed;
  if (isRunning(job)) return job.progress.bytes;
  const { fraction } = stopOf(job, null);
  return job.stopped_byte ?? (fraction === null ? Infinity : fraction * job.size);
}

export const hasStopped = (state: JobState): boolean => state === 'failed' || state === 'cancelled';
