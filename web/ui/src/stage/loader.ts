// Fetches a job's layers, the lowest first. Runs in the worker: parsing takes time, too.
import { ApiError, sentenceOf } from '../api';
import { chunks, decodeLayers, type LayerRecord } from '../layers';
import type { LayerIndex } from '../types';

const STALL_MS = 5000;
const AGAIN_MS = 3000;

/** All bytes of an answer. It may take its time, but not stand still for STALL_MS. */
async function fetchSteadily(path: string, signal: AbortSignal): Promise<Uint8Array> {
  const stalled = new AbortController();
  const end = () => stalled.abort();
  signal.addEventListener('abort', end);
  let timer = setTimeout(end, STALL_MS);
  try {
    const response = await fetch(path, { credentials: 'same-origin', signal: stalled.signal });
    if (!response.ok) throw new ApiError(sentenceOf(await response.text(), `${response.status} ${response.statusText}`), response.status);
    const parts: Uint8Array[] = [];
    for (const reader = response.body!.getReader(); ;) {
      const { done, value } = await reader.read();
      if (done) break;
      parts.push(value);
      clearTimeout(timer);
      timer = setTimeout(end, STALL_MS);
    }
    return joined(parts);
  } finally {
    clearTimeout(timer);
    signal.removeEventListener('abort', end);
  }
}

function joined(parts: Uint8Array[]): Uint8Array {
  const out = new Uint8Array(parts.reduce((sum, part) => sum + part.length, 0));
  let at = 0;
  for (const part of parts) {
    out.set(part, at);
    at += part.length;
  }
  return out;
}

export interface Sink {
  begin(segments: number): void;
  add(records: LayerRecord[]): void;
  /** Why it does not go on; null: it does. */
  problem(text: string | null, status: number): void;
}

/** What the service refuses is said once; where it is not reached, it is asked again. */
async function persistently<T>(once: () => Promise<T>, signal: AbortSignal, sink: Sink): Promise<T | null> {
  for (;;) {
    try {
      const got = await once();
      sink.problem(null, 0);
      return got;
    } catch (error) {
      if (signal.aborted) return null;
      const status = error instanceof ApiError ? error.status : 0;
      if (status >= 400 && status < 500) {
        sink.problem((error as Error).message, status);
        return null;
      }
      sink.problem('The layers do not come: the print service is not heard. This is tried again.', status);
      await new Promise((resolve) => { setTimeout(resolve, AGAIN_MS); });
      if (signal.aborted) return null;
    }
  }
}

/** `page`: the address that the service's own are relative to. */
export async function loadLayers(page: string, job: number, signal: AbortSignal, sink: Sink): Promise<void> {
  const path = new URL(`api/v1/jobs/${job}/layers`, page).href;
  const index = await persistently(async () => {
    const text = new TextDecoder().decode(await fetchSteadily(path, signal));
    return (JSON.parse(text) as { layers: LayerIndex[] }).layers;
  }, signal, sink);
  if (!index || signal.aborted) return;
  sink.begin(index.reduce((sum, record) => sum + record.segments, 0));
  for (const [first, last] of chunks(index)) {
    const bytes = await persistently(() => fetchSteadily(`${path}/${first}-${last}`, signal), signal, sink);
    if (!bytes || signal.aborted) return;
    try {
      sink.add(decodeLayers(bytes.buffer as ArrayBuffer));
    } catch (error) {
      return sink.problem((error as Error).message, 200);
    }
  }
}
