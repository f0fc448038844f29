// The page's state, and how live messages change it. reduce() is pure; the store only remembers and
// notifies.
import { isEnded, isRunning, isWaiting, olderBehind, renewed, type Search } from './jobs';
import type { Guarantee, HeaterStatus, History, Job, JobCounts, JobPage, LiveMessage, MachineConfig, Part, Progress, QueueGate, Status } from './types';

export { isRunning, isWaiting };

/** What the printer is called, before its machine file is known. */
export const UNNAMED = 'QduinoMC printer';

export interface Upload {
  key: number;
  name: string;
  sent: number;
  size: number;
  phase: 'waiting' | 'sending' | 'checking' | 'queued' | 'cancelled' | 'refused';
  /** Bytes in a second over the last seconds; null: not known yet. */
  rate: number | null;
  error: string | null;
  /** The file is still at hand, and would be taken with homing and heating in front. */
  offer?: boolean;
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

/** What became of an emergency stop (stop.ts); `reason`: why it is not confirmed. */
export interface Stop {
  phase: 'asked' | 'confirmed' | 'unconfirmed';
  reason: string | null;
}

export interface State {
  signedIn: boolean | null; // null: not known yet
  online: boolean;
  /** Unix time of the last word of the service; null: there was none. */
  newsAt_ms: number | null;
  /** For so long it has said nothing (silence.ts); null: not worth a word. */
  silent_s: number | null;
  stop: Stop | null;
  status: Status | null;
  /** The first page, as the live stream has it: running, the first waiting, the newest ended. */
  jobs: Job[];
  /**
   * Ended ones behind the first page, as far as they were asked for; the next page begins before
   * `older_before`.
   */
  older: Job[];
  older_before: number | null;
  counts: JobCounts;
  search: Search;
  /** The results of the search so far; null: there is no search, or the answer has not come. */
  found: { jobs: Job[]; next_before: number | null } | null;
  gate: QueueGate;
  config: MachineConfig | null;
  question: Question | null;
  history: History;
  console: ConsoleLine[];
  uploads: Upload[];
  guarantee: Guarantee | null;
  /** The one before it. */
  guaranteeBefore: Guarantee | null;
  /** What was refused, by the place on the page where it was asked for. */
  refusals: Record<string, string>;
  /** Why the page asks for the key, in words; null: no reason but that there is none. */
  keyProblem: string | null;
  /** The job that a person has chosen to look at; null: the one that prints, or the next. */
  shown: Job | null;
}

export const HISTORY_SECONDS = 600;
const CONSOLE_LINES = 200;
let keys = 0;
export const newKey = (): number => ++keys;

export const emptyHistory = (): History => ({ t_s: [], hot_end_c: [], hot_end_target_c: [], bed_c: [], bed_target_c: [] });

const NO_JOBS: JobCounts = { queued: 0, held: 0, printing: 0, done: 0, cancelled: 0, failed: 0, total: 0 };
export const initialState: State = {
  signedIn: null, online: false, newsAt_ms: null, silent_s: null, stop: null, status: null, jobs: [], older: [], older_before: null, counts: NO_JOBS,
  search: { text: '', states: '' }, found: null, gate: { held: false, reason: null, bed_occupied: false, confirm_bed: true },
  config: null, question: null, history: emptyHistory(), console: [], uploads: [], guarantee: null, guaranteeBefore: null, refusals: {}, keyProblem: null,
  shown: null,
};

/** Adds one sample, at most one a second, and forgets what is older than ten minutes. */
export function addSample(history: History, status: Status, now_s: number): History {
  const last = history.t_s[history.t_s.length - 1];
  if (last !== undefined && now_s - last < 1) return history;
  let first = 0;
  while (first < history.t_s.length && history.t_s[first] < now_s - HISTORY_SECONDS) first++;
  const target = (t: number) => (t > 0 ? t : null);
  const seen = (heater: HeaterStatus) => (heater.reading === false ? null : heater.c);
  return {
    t_s: [...history.t_s.slice(first), now_s],
    hot_end_c: [...history.hot_end_c.slice(first), seen(status.hot_end)],
    hot_end_target_c: [...history.hot_end_target_c.slice(first), target(status.hot_end.target_c)],
    bed_c: [...history.bed_c.slice(first), seen(status.bed)],
    bed_target_c: [...history.bed_target_c.slice(first), target(status.bed.target_c)],
  };
}

function withFirstPage(state: State, { jobs, next_before, counts, queue }: JobPage): State {
  // A print begins: that is what people want to see, whatever they looked at before.
  const begun = jobs.find(isRunning)?.id;
  const same = begun === undefined || begun === state.jobs.find(isRunning)?.id;
  const older = state.older.length > 0 ? olderBehind([...state.jobs.filter(isEnded), ...state.older], jobs) : [];
  return {
    ...state, jobs, older, counts, gate: queue, shown: same ? state.shown : null,
    older_before: older.length > 0 ? state.older_before : next_before,
    found: state.found && { ...state.found, jobs: renewed(state.found.jobs, jobs) },
  };
}

/** A job that is gone, as the answer to a request has said. */
export function withoutJob(state: State, id: number): State {
  const but = (list: Job[]) => list.filter((job) => job.id !== id);
  return {
    ...state, jobs: but(state.jobs), older: but(state.older), found: state.found && { ...state.found, jobs: but(state.found.jobs) },
    shown: state.shown?.id === id ? null : state.shown,
  };
}

export function reduce(state: State, message: LiveMessage, now_s: number): State {
  switch (message.type) {
    case 'status': {
      const history = message.status.connected ? addSample(state.history, message.status, now_s) : state.history;
      return { ...state, status: message.status, history };
    }
    case 'jobs':
      return withFirstPage(state, message);
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
    case 'alive':
      return state; // that it has come is all that it says
    case 'upload':
      return state; // the page knows its own uploads better
  }
}

export function addConsole(state: State, kind: ConsoleLine['kind'], text: string): State {
  const lines = text.split('\n').map((line) => ({ key: newKey(), kind, text: line }));
  return { ...state, console: [...state.console, ...lines].slice(-CONSOLE_LINES) };
}

/**
 * The job to look at: the chosen one; the one that prints; what lies on the bed or has just failed;
 * the next one; or the last. A machine that has stopped by a fault never shows an older job, whose
 * verdict would be read as this one's.
 */
export function shownJob(state: State): Job | null {
  const { shown, jobs, gate } = state;
  if (shown) return knownJob(state, shown.id) ?? shown;
  const running = jobs.find(isRunning);
  if (running) return running;
  const last = jobs.find(isEnded) ?? null;
  const faulted = state.status?.state === 'faulted';
  if (last?.state === 'failed' && (faulted || gate.held)) return last;
  if (last && gate.bed_occupied && !faulted) return last;
  return jobs.find((job) => job.state === 'queued') ?? (faulted ? null : last ?? jobs[0] ?? null);
}

/**
 * The progress of a job, by the newest message: the list of jobs comes only when it changes, the
 * status ten times a second.
 */
export const progressNow = (job: Job, status: Status | null): Progress => (status?.job === job.id && status.progress ? status.progress : job.progress);

/** The job in any list that the page has. */
export const knownJob = ({ jobs, older, found }: State, id: number): Job | null =>
  [jobs, older, found?.jobs ?? []].flat().find((job) => job.id === id) ?? null;

/** True when the printer has said that it lacks this part. */
export const lacks = (state: State, part: Part): boolean => state.status?.lacks?.includes(part) ?? false;

/** The speed of the printer's time; a simulated printer may be faster than real time. */
export const timeFactor = (status: Status | null): number => (status?.connected && status.time_factor > 0 ? status.time_factor : 1);

/** Seconds of the printer's time as seconds of the clock on the wall. */
export const onTheWall = (seconds: number | null, status: Status | null): number | null => (seconds === null ? null : seconds / timeFactor(status));

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

/** `job` is listed, in the state in which it was shown. */
export const isStillThere = (state: State, job: Job): boolean => knownJob(state, job.id)?.state === job.state;

/** `job` is being printed, or paused. */
export const isStillRunning = (state: State, job: Job): boolean =>
  state.status?.state !== 'faulted' && state.jobs.some((each) => each.id === job.id && isRunning(each));

/**
 * Asks the person; true when the answer is yes. A question about something that has ended, as
 * `still` says, is taken back: the answer is no.
 */
export function ask(text: string, verb: string, still: (state: State) => boolean = () => true): Promise<boolean> {
  store.state.question?.answer(false);
  return new Promise((resolve) => {
    const answer = (yes: boolean) => {
      forget();
      store.set({ question: null });
      resolve(yes);
    };
    const forget = store.subscribe(() => store.state.question?.answer === answer && !still(store.state) && answer(false));
    store.set({ question: { text, verb, answer } });
  });
}
