// Requests to the service, and the live stream. Errors are the service's own words (docs/api.md), always as text.
import * as format from './format';
import { addConsole, newKey, reduce, store } from './store';
import type { Guarantee, Inspection, Job, LayerIndex, LiveMessage, MachineConfig } from './types';

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

export async function request<T>(method: string, path: string, body?: unknown): Promise<T> {
  const response = await fetch(`/api/v1/${path}`, {
    method,
    credentials: 'same-origin',
    headers: body === undefined ? {} : { 'Content-Type': 'application/json' },
    body: body === undefined ? undefined : JSON.stringify(body),
  });
  if (response.status === 401) store.set({ signedIn: false });
  if (!response.ok) throw await errorOf(response);
  const text = await response.text();
  return (text ? JSON.parse(text) : undefined) as T;
}

/** Runs a request for its effect; what goes wrong is shown to the person. */
export async function act(method: string, path: string, body?: unknown): Promise<void> {
  try {
    await request(method, path, body);
  } catch (error) {
    store.set({ notice: (error as Error).message });
  }
}

export async function signIn(key: string): Promise<void> {
  await request('POST', 'session', { key });
  store.set({ signedIn: true });
}

/** The key in the link, if there is one; it leaves the address bar at once. */
export function takeKeyFromAddress(): string | null {
  const found = /[#&]key=([^&]+)/.exec(location.hash);
  if (!found) return null;
  history.replaceState(null, '', location.pathname + location.search);
  return decodeURIComponent(found[1]);
}

export async function layerIndex(job: number): Promise<LayerIndex[]> {
  return (await request<{ layers: LayerIndex[] }>('GET', `jobs/${job}/layers`)).layers;
}

/** The virtual machine's report on a finished job; null where nobody inspects. */
export async function inspection(job: number): Promise<Inspection | null> {
  return request<Inspection>('GET', `jobs/${job}/inspection`).catch(() => null);
}

export async function layerBytes(job: number, first: number, last: number, signal: AbortSignal): Promise<ArrayBuffer> {
  const response = await fetch(`/api/v1/jobs/${job}/layers/${first}-${last}`, { credentials: 'same-origin', signal });
  if (!response.ok) throw await errorOf(response);
  return response.arrayBuffer();
}

export async function loadGuarantee(): Promise<void> {
  try {
    store.set({ guarantee: await request<Guarantee>('GET', 'guarantee') });
  } catch {
    store.set({ guarantee: null });
  }
}

async function loadConfig(): Promise<void> {
  if (store.state.config) return;
  const config = await request<MachineConfig>('GET', 'config').catch(() => null);
  store.set({ config });
}

/** Uploads one file with progress; the answer is shown where the upload is. */
export function upload(file: File, print: boolean): Promise<Job | null> {
  const key = newKey();
  const change = (part: object) =>
    store.update((s) => ({ ...s, uploads: s.uploads.map((u) => (u.key === key ? { ...u, ...part } : u)) }));
  store.update((s) => ({
    ...s, uploads: [...s.uploads, { key, name: file.name, sent: 0, size: file.size, error: null, done: false }],
  }));
  return new Promise((resolve) => {
    const form = new FormData();
    form.append('print', print ? 'true' : 'false');
    form.append('file', file, file.name);
    const xhr = new XMLHttpRequest();
    xhr.open('POST', '/api/v1/jobs');
    xhr.upload.onprogress = (event) => change({ sent: event.loaded, size: event.total || file.size });
    xhr.onerror = () => (change({ error: 'The connection was lost: nothing was queued. Try again.' }), resolve(null));
    xhr.onload = () => {
      if (xhr.status === 201) {
        change({ done: true, sent: file.size, size: file.size });
        setTimeout(() => dismissUpload(key), 2500);
        return resolve(JSON.parse(xhr.responseText) as Job);
      }
      if (xhr.status === 401) store.set({ signedIn: false });
      change({ error: sentenceOf(xhr.responseText, `${xhr.status} ${xhr.statusText}`) });
      resolve(null);
    };
    xhr.send(form);
  });
}

export function dismissUpload(key: number): void {
  store.update((s) => ({ ...s, uploads: s.uploads.filter((u) => u.key !== key) }));
}

export async function sendLine(line: string): Promise<void> {
  store.update((s) => addConsole(s, 'sent', line));
  await act('POST', 'machine/gcode', { line });
}

/**
 * Keeps one live stream open until it is told to stop, or the session has ended; waits longer after each failure, up
 * to 8 s. Returns what stops it.
 */
export function startLive(): () => void {
  let wait_ms = 500;
  let stopped = false;
  let socket: WebSocket | null = null;
  let timer = 0;
  const again = async () => {
    try {
      await request('GET', 'machine');
    } catch (error) {
      if ((error as ApiError).status === 401) return; // request() has told the page
    }
    if (!stopped) open();
  };
  const open = () => {
    const scheme = location.protocol === 'https:' ? 'wss' : 'ws';
    let session: string | null | undefined;
    socket = new WebSocket(`${scheme}://${location.host}/api/v1/live`);
    socket.onopen = () => {
      wait_ms = 500;
      store.set({ online: true });
      void loadConfig();
    };
    socket.onmessage = (event) => {
      const message = JSON.parse(event.data) as LiveMessage;
      store.update((s) => reduce(s, message, Date.now() / 1000));
      if (message.type === 'status' && message.status.session !== session) {
        session = message.status.session;
        if (session !== null) void loadGuarantee();
      }
    };
    socket.onclose = () => {
      if (stopped) return;
      store.set({ online: false });
      timer = window.setTimeout(again, wait_ms);
      wait_ms = Math.min(wait_ms * 2, 8000);
    };
  };
  open();
  return () => {
    stopped = true;
    clearTimeout(timer);
    socket?.close();
    store.set({ online: false });
  };
}
