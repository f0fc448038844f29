// Requests to the service, and the live stream. Errors are the service's own words (docs/api.md),
// always as text.
import { circumstances } from './causes';
import * as format from './format';
import { isSearch, joined, listPath, PAGE_JOBS, RELOAD_JOBS_MAX, type Search } from './jobs';
import { silenceOf } from './silence';
import { addConsole, reduce, store, withoutJob } from './store';
import type { Guarantee, Inspection, JobPage, LiveMessage, MachineConfig, Status } from './types';

const ASK_MS = 1000;
/** An answer that takes longer does not come; uploads have a watch of their own (uploads.ts). */
export const PATIENCE_MS = 5000;
/** A stream that is open and says nothing for so long is given up, and opened anew. */
const SILENT_STREAM_MS = 8000;
const LOOK_MS = 500;

export class ApiError extends Error {
  constructor(message: string, readonly status: number) {
    super(message);
  }
}

/** The service's own sentence, with the line of the file that it is about; else the status. */
export function sentenceOf(body: string, status: string): string {
  try {
    const { message, line } = JSON.parse(body).error;
    if (typeof message === 'string') return line && !message.startsWith(`line ${line}`) ? `Line ${line}: ${message}` : format.sentence(message);
  } catch {
    // no JSON, or no error in it
  }
  return status;
}

async function errorOf(response: Response): Promise<ApiError> {
  return new ApiError(sentenceOf(await response.text(), `${response.status} ${response.statusText}`), response.status);
}

interface Manner {
  patience_ms?: number;
  /** Before other requests, and sent even if the page is closed meanwhile. */
  urgent?: boolean;
}

/** Asks the service. Throws an ApiError, of status 0 when no answer comes. */
export async function request<T>(method: string, path: string, body?: unknown, { patience_ms = PATIENCE_MS, urgent = false }: Manner = {}): Promise<T> {
  const abort = new AbortController();
  const timer = setTimeout(() => abort.abort(), Math.max(0, patience_ms));
  try {
    const response = await fetch(`api/v1/${path}`, {
      method,
      credentials: 'same-origin',
      headers: body === undefined ? {} : { 'Content-Type': 'application/json' },
      body: body === undefined ? undefined : JSON.stringify(body),
      signal: abort.signal,
      ...(urgent ? { keepalive: true, priority: 'high' as const } : {}),
    });
    if (response.status === 401) store.set({ signedIn: false });
    if (!response.ok) throw await errorOf(response);
    const text = await response.text();
    return (text ? JSON.parse(text) : undefined) as T;
  } catch (error) {
    if (error instanceof ApiError) throw error;
    throw new ApiError(abort.signal.aborted
      ? `The print service has not answered for ${format.duration(patience_ms / 1000)}: whether it was done is not known.`
      : 'The print service was not reached: nothing was done. Try again.', 0);
  } finally {
    clearTimeout(timer);
  }
}

export function dismissRefusal(place: string): void {
  store.update((s) => {
    const { [place]: _, ...refusals } = s.refusals;
    return { ...s, refusals };
  });
}

/** What the standing refusals are about, by their places. */
const causes = new Map<string, string>();

function refuse(place: string, text: string): void {
  causes.set(place, circumstances(store.state, place));
  store.update((s) => ({ ...s, refusals: { ...s.refusals, [place]: text } }));
}

/** Takes back the refusals whose cause is over. */
function endRefusals(): void {
  const { refusals } = store.state;
  for (const [place, cause] of causes) {
    if (place in refusals && circumstances(store.state, place) === cause) continue;
    causes.delete(place);
    if (place in refusals) dismissRefusal(place);
  }
}

/**
 * Runs a request for its effect. A refusal is shown at `place`, where the request was made
 * (components/Refusal.tsx).
 */
export async function act(place: string, method: string, path: string, body?: unknown): Promise<boolean> {
  if (place in store.state.refusals) dismissRefusal(place);
  try {
    await request(method, path, body);
    return true;
  } catch (error) {
    refuse(place, (error as Error).message);
    return false;
  }
}

/** Deletes a job's row at once: the live stream does not bring rows of an older page. */
export async function removeJob(id: number): Promise<void> {
  if (await act(`job-${id}`, 'DELETE', `jobs/${id}`)) store.update((s) => withoutJob(s, id));
}

/** What is wrong with a key, for people. */
export function keyProblem(error: ApiError): string {
  if (error.status === 401 || error.status === 403) {
    return 'This is not the key of this printer. Copy the whole line “Open http://…” that was printed when the printer was started: the key is what follows “key=”.';
  }
  if (error.status === 429) return 'There were too many wrong keys from here. Wait a minute, then try again.';
  return error.status === 0 ? 'The print service was not reached. Is the printer switched on?' : error.message;
}

/** What is wrong with the proof, for people. */
const problemOf = (proof: Proof, error: ApiError) => ('ticket' in proof && error.status === 401
  ? 'This invitation was used already, or is too old. Choose “Phone” once more on the page that showed it.'
  : keyProblem(error));

export async function signIn(proof: Proof): Promise<void> {
  try {
    await request('POST', 'session', proof);
  } catch (error) {
    store.set({ keyProblem: problemOf(proof, error as ApiError) });
    throw error;
  }
  store.set({ signedIn: true, keyProblem: null });
}

const nextPage = (before: number | null, limit = PAGE_JOBS) => request<JobPage>('GET', listPath(store.state.search, limit, before));

/** Runs `load` unless another search has begun meanwhile. A refusal is shown at the list. */
async function listed(load: () => Promise<JobPage>, take: (page: JobPage) => void): Promise<void> {
  const { search } = store.state;
  try {
    const page = await load();
    if (store.state.search === search) take(page);
    if ('list' in store.state.refusals) dismissRefusal('list');
  } catch (error) {
    refuse('list', (error as Error).message);
  }
}

/** Begins a search; null: ends it. */
export async function startSearch(search: Search): Promise<void> {
  store.set({ search, ...(isSearch(search) ? {} : { found: null }) });
  if (isSearch(search)) await listed(() => nextPage(null), ({ jobs, next_before }) => store.set({ found: { jobs, next_before } }));
}

/** After the queue has changed: the same search again, as far down as it is shown. */
export async function repeatSearch(): Promise<void> {
  const shown = store.state.found?.jobs.length ?? 0;
  if (!isSearch(store.state.search) || shown > RELOAD_JOBS_MAX) return;
  await listed(() => nextPage(null, Math.max(PAGE_JOBS, shown)), ({ jobs, next_before }) => store.set({ found: { jobs, next_before } }));
}

/** The next page of the list: of the search, or else of the ended jobs. */
export async function loadMore(): Promise<void> {
  const { found, older_before } = store.state;
  await listed(() => nextPage(found ? found.next_before : older_before), ({ jobs, next_before }) => store.update((s) => (s.found
    ? { ...s, found: { jobs: joined(s.found.jobs, jobs), next_before } }
    // The live page may have moved on meanwhile: its jobs are not older.
    : { ...s, older: joined([...s.jobs, ...s.older], jobs).slice(s.jobs.length), older_before: next_before })));
}

/** What a link proves: the key, or an invitation's ticket. */
export type Proof = { key: string } | { ticket: string };

/** The proof in the link, if there is one; it leaves the address bar at once. */
export function takeProofFromAddress(): Proof | null {
  const found = /[#&](key|ticket)=([^&]+)/.exec(location.hash);
  if (!found) return null;
  history.replaceState(null, '', location.pathname + location.search);
  const value = decodeURIComponent(found[2]);
  return found[1] === 'key' ? { key: value } : { ticket: value };
}

/** The virtual machine's report on a finished job; null where nobody inspects. */
export async function inspection(job: number): Promise<Inspection | null> {
  return request<Inspection>('GET', `jobs/${job}/inspection`).catch(() => null);
}

export async function loadGuarantee(): Promise<void> {
  try {
    const guarantee = await request<Guarantee>('GET', 'guarantee');
    store.update((s) => ({ ...s, guarantee, guaranteeBefore: s.guarantee }));
  } catch {
    store.set({ guarantee: null, guaranteeBefore: null });
  }
}

async function loadConfig(): Promise<void> {
  if (store.state.config) return;
  const config = await request<MachineConfig>('GET', 'config').catch(() => null);
  store.set({ config });
}

export async function sendLine(line: string): Promise<void> {
  store.update((s) => addConsole(s, 'sent', line));
  await act('console', 'POST', 'machine/gcode', { line });
}

/** Takes in what the service says: news, so nothing that is shown is old. */
export function apply(message: LiveMessage): void {
  const now_ms = Date.now();
  store.update((s) => ({ ...reduce(s, message, now_ms / 1000), newsAt_ms: now_ms, silent_s: null }));
  endRefusals();
}

/** Says how long nothing was heard. Returns what stops it. */
function watchSilence(): () => void {
  const timer = setInterval(() => {
    const silent_s = silenceOf(store.state.newsAt_ms, Date.now());
    if (silent_s !== store.state.silent_s) store.set({ silent_s });
  }, LOOK_MS);
  return () => clearInterval(timer);
}

/** For a printer without a live stream: asks it once a second. Returns what stops it. */
function startAsking(): () => void {
  let stopped = false;
  let timer = 0;
  let listed = '';
  const once = async () => {
    try {
      apply({ type: 'status', status: await request<Status>('GET', 'machine') });
      const page = await request<JobPage>('GET', 'jobs');
      const list = JSON.stringify(page);
      if (list !== listed) apply({ type: 'jobs', ...page });
      listed = list;
      if (!stopped) store.set({ online: true });
    } catch (error) {
      if ((error as ApiError).status === 401) return; // request() has told the page
      store.set({ online: false });
    }
    if (!stopped) timer = window.setTimeout(once, ASK_MS);
  };
  void once();
  return () => {
    stopped = true;
    clearTimeout(timer);
    store.set({ online: false });
  };
}

/** Keeps the page up to date in the way that the printer has. Returns what stops it. */
export function startLive(): () => void {
  let stopped = false;
  let stop = () => {};
  const unwatch = watchSilence();
  void request<Status>('GET', 'machine').then((status) => status.lacks?.includes('live') ?? false, () => false).then((asks) => {
    if (!stopped) stop = asks ? startAsking() : startStream();
  });
  return () => {
    stopped = true;
    unwatch();
    stop();
  };
}

/** The one that is open or opens. `heard_ms`: when it last said something, or began to open. */
interface Stream {
  socket: WebSocket;
  heard_ms: number;
  opened: boolean;
}

/**
 * Keeps one live stream open until it is told to stop, or the session has ended; waits longer after
 * each failure, up to 4 s. One that says nothing is given up: its end may never be told. Returns
 * what stops it.
 */
function startStream(): () => void {
  let wait_ms = 500;
  let stopped = false;
  let stream: Stream | null = null;
  let timer = 0;
  const again = async () => {
    try {
      await request('GET', 'machine');
    } catch (error) {
      if ((error as ApiError).status === 401) return; // request() has told the page
    }
    if (!stopped) stream = openStream(over);
  };
  const over = (ended: Stream) => {
    if (stopped || stream !== ended) return;
    stream = null;
    store.set({ online: false });
    timer = window.setTimeout(again, wait_ms);
    wait_ms = ended.opened ? 500 : Math.min(wait_ms * 2, 4000);
  };
  const watch = setInterval(() => {
    if (!stream || performance.now() - stream.heard_ms < (stream.opened ? SILENT_STREAM_MS : PATIENCE_MS)) return;
    const { socket } = stream;
    over(stream);
    socket.close();
  }, LOOK_MS);
  stream = openStream(over);
  return () => {
    stopped = true;
    clearTimeout(timer);
    clearInterval(watch);
    stream?.socket.close();
    store.set({ online: false });
  };
}

function openStream(over: (ended: Stream) => void): Stream {
  const address = new URL('api/v1/live', location.href);
  address.protocol = location.protocol === 'https:' ? 'wss:' : 'ws:';
  address.hash = '';
  const stream: Stream = { socket: new WebSocket(address), heard_ms: performance.now(), opened: false };
  let session: string | null | undefined;
  stream.socket.onopen = () => {
    Object.assign(stream, { heard_ms: performance.now(), opened: true });
    void loadConfig();
  };
  stream.socket.onmessage = (event) => {
    stream.heard_ms = performance.now();
    const message = JSON.parse(event.data) as LiveMessage;
    apply(message);
    if (!store.state.online) store.set({ online: true });
    if (message.type === 'status' && message.status.session !== session) {
      session = message.status.session;
      if (session !== null) void loadGuarantee();
    }
  };
  stream.socket.onclose = () => over(stream);
  return stream;
}
