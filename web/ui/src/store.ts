// The page's state, and how live messages change it. reduce() is pure; the store only remembers and tells.
import type { Guarantee, History, Job, LiveMessage, MachineConfig, QueueGate, Status } from './types';

export interface Upload {
  key: number;
  name: string;
  sent: number;
  size: number;
  error: string | null;
  done: boolean;
}

export interface ConsoleLine {
  key: number;
  kind: 'text' | 'warning' | 'error' | 'sent';
  text: string;
}

/** A question that is open, and what happens with its answer. */
export interface Question {
  text: string;
  verb: string;
  answer: (yes: boolean) => void;
}

export interface State {
  signedIn: boolean | null; // null: not known yet
  online: boolean;
  status: Status | null;
  jobs: Job[];
  gate: QueueGate;
  config: MachineConfig | null;
  question: Question | null;
  history: History;
  console: ConsoleLine[];
  uploads: Upload[];
  guarantee: Guarantee | null;
  notice: string | null;
  /** The job that the 3D view shows; null: the one that prints, or the next. */
  shown: number | null;
}

export const HISTORY_SECONDS = 600;
const CONSOLE_LINES = 200;
let keys = 0;
export const newKey = (): number => ++keys;

export const emptyHistory = (): History => ({ t_s: [], hot_end_c: [], hot_end_target_c: [], bed_c: [], bed_target_c: [] });

export const initialState: State = {
  signedIn: null, online: false, status: null, jobs: [], gate: { held: false, reason: null, bed_occupied: false }, config: null,
  question: null, history: emptyHistory(), console: [], uploads: [], guarantee: null, notice: null, shown: null,
};

/** Adds one sample, at most one a second, and forgets what is older than ten minutes. */
export function addSample(history: History, status: Status, now_s: number): History {
  const last = history.t_s[history.t_s.length - 1];
  if (last !== undefined && now_s - last < 1) return history;
  let first = 0;
  while (first < history.t_s.length && history.t_s[first] < now_s - HISTORY_SECONDS) first++;
  const target = (t: number) => (t > 0 ? t : null);
  return {
    t_s: [...history.t_s.slice(first), now_s],
    hot_end_c: [...history.hot_end_c.slice(first), status.hot_end.c],
    hot_end_target_c: [...history.hot_end_target_c.slice(first), target(status.hot_end.target_c)],
    bed_c: [...history.bed_c.slice(first), status.bed.c],
    bed_target_c: [...history.bed_target_c.slice(first), target(status.bed.target_c)],
  };
}

export function reduce(state: State, message: LiveMessage, now_s: number): State {
  switch (message.type) {
    case 'status': {
      const history = message.status.connected ? addSample(state.history, message.status, now_s) : state.history;
      return { ...state, status: message.status, history };
    }
    case 'jobs': {
      // A print that begins is what people want to see, whatever they looked at before.
      const begun = message.jobs.find(isRunning)?.id;
      const same = begun === undefined || begun === state.jobs.find(isRunning)?.id;
      return { ...state, jobs: message.jobs, gate: message.queue ?? initialState.gate, shown: same ? state.shown : null };
    }
    case 'history': {
      const zeroIsOff = (list: (number | null)[]) => list.map((t) => (t ? t : null));
      return {
        ...state,
        history: {
          t_s: message.t_s, hot_end_c: message.hot_end_c, bed_c: message.bed_c,
          hot_end_target_c: zeroIsOff(message.hot_end_target_c), bed_target_c: zeroIsOff(message.bed_target_c),
        },
      };
    }
    case 'reply':
      return addConsole(state, message.kind, message.text);
    case 'upload':
      return state; // the page knows its own uploads better
  }
}

export function addConsole(state: State, kind: ConsoleLine['kind'], text: string): State {
  const lines = text.split('\n').map((line) => ({ key: newKey(), kind, text: line }));
  return { ...state, console: [...state.console, ...lines].slice(-CONSOLE_LINES) };
}

/** The job to look at: the chosen one, the one that prints, the next one, or the last one that was printed. */
export function shownJob(state: State): Job | null {
  const by = (test: (job: Job) => boolean) => state.jobs.find(test) ?? null;
  return (
    by((job) => job.id === state.shown) ??
    by((job) => job.state === 'printing' || job.state === 'paused') ??
    by((job) => job.state === 'queued') ??
    by((job) => job.state === 'done') ?? state.jobs[0] ?? null
  );
}

export const isRunning = (job: Job): boolean => job.state === 'printing' || job.state === 'paused';
export const isWaiting = (job: Job): boolean => job.state === 'queued' || job.state === 'held' || job.state === 'uploading';

export interface Progress {
  fraction: number;
  remaining_s: number | null;
}

/**
 * How far the job is, by the newest status: the list of jobs comes only when it changes, the status ten times a second.
 * The time that is left is the file's own estimate for the bytes that are left, or else goes by what the others took.
 */
export function progressOf(job: Job, status: Status | null): Progress {
  if (!status || status.job !== job.id || job.size <= 0) return job.progress;
  const fraction = Math.min(1, status.bytes_executed / job.size);
  if (job.facts.estimated_s) return { fraction, remaining_s: job.facts.estimated_s * (1 - fraction) };
  return { fraction, remaining_s: fraction > 0.01 ? status.print_time_s / fraction - status.print_time_s : null };
}

/**
 * Seconds from now until each waiting job is done, by id; only as far down the queue as every estimate is known, and
 * none while the queue does not go on by itself.
 */
export function queueEnds(state: Pick<State, 'jobs' | 'status' | 'gate'>): Map<number, number> {
  const ends = new Map<number, number>();
  const machine = state.status?.state;
  if (state.gate.held || state.gate.bed_occupied || machine === 'faulted' || machine === 'disconnected') return ends;
  let at = 0;
  for (const job of state.jobs) {
    if (job.state === 'held' || !(isRunning(job) || isWaiting(job))) continue;
    const left = isRunning(job) ? progressOf(job, state.status).remaining_s : job.facts.estimated_s;
    if (left === null || left === undefined) break;
    const copies = Math.max(0, job.copies - job.copies_done - 1);
    at += left + copies * (job.facts.estimated_s ?? 0);
    if (isWaiting(job)) ends.set(job.id, at);
  }
  return ends;
}

type Listener = () => void;
class Store {
  state = initialState;
  private listeners = new Set<Listener>();
  subscribe(listener: Listener): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }
  update(change: (state: State) => State): void {
    this.state = change(this.state);
    this.listeners.forEach((listener) => listener());
  }
  set(part: Partial<State>): void {
    this.update((state) => ({ ...state, ...part }));
  }
}
export const store = new Store();

/** Asks the person; true when the answer is yes. */
export function ask(text: string, verb: string): Promise<boolean> {
  store.state.question?.answer(false);
  return new Promise((resolve) => {
    const answer = (yes: boolean) => {
      store.set({ question: null });
      resolve(yes);
    };
    store.set({ question: { text, verb, answer } });
  });
}
