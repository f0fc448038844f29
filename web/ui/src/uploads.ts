// Uploads: one after the other, so that the queue gets the order in which the files were chosen.
// Each can be cancelled while it is on its way. A refused one stays in the list, with its reason,
// until a person has read it.
import { sentenceOf } from './api';
import * as format from './format';
import { newKey, store, type Upload } from './store';

const RATE_MS = 4000;
const DONE_SHOWN_MS = 2500;
/** A line on which nothing moves for so long is dead. */
export const STALLED_MS = 30_000;

/** Bytes sent by an instant. */
export interface Sample {
  at_ms: number;
  sent: number;
}

/**
 * Bytes in a second over the last seconds of `samples`; null: too little is known. A stall is seen
 * as a falling rate.
 */
export function rateOf(samples: Sample[], now_ms: number): number | null {
  const first = samples.find((each) => each.at_ms >= now_ms - RATE_MS);
  if (!first || now_ms - first.at_ms < 500) return null;
  return ((samples[samples.length - 1].sent - first.sent) / (now_ms - first.at_ms)) * 1000;
}

/**
 * Why an upload is given up; null: it goes on. While it is sent, bytes must move. While it is
 * checked, which may take minutes, the service must be heard.
 */
export function stallOf(phase: Upload['phase'], samples: Sample[], now_ms: number, silent_s: number | null): string | null {
  if (phase === 'checking') {
    return (silent_s ?? 0) * 1000 < STALLED_MS ? null
      : 'The print service fell silent while it checked the file. Look whether it is in the queue before you choose it again.';
  }
  const { sent } = samples[samples.length - 1];
  const moved = samples.find((each) => each.sent === sent)!;
  return now_ms - moved.at_ms < STALLED_MS ? null
    : `Nothing of it has moved for ${format.duration(STALLED_MS / 1000)}: nothing was queued. Choose the file again.`;
}

interface Chosen {
  file: File;
  print: boolean;
  /** Home and heat first, where the file does neither. */
  prologue?: boolean;
}

const files = new Map<number, Chosen>();
let sending: { key: number; abort: () => void } | null = null;

const change = (key: number, part: Partial<Upload>): void =>
  store.update((s) => ({ ...s, uploads: s.uploads.map((one) => (one.key === key ? { ...one, ...part } : one)) }));

export function dismissUpload(key: number): void {
  files.delete(key);
  store.update((s) => ({ ...s, uploads: s.uploads.filter((one) => one.key !== key) }));
}

/** Ends as `phase`: good news leaves by itself. */
function end(key: number, phase: 'queued' | 'cancelled' | 'refused', error: string | null = null, offer = false): void {
  if (!offer) files.delete(key);
  change(key, { phase, error, offer });
  if (phase !== 'refused') setTimeout(() => dismissUpload(key), DONE_SHOWN_MS);
}

export function addUploads(chosen: File[], print: boolean): void {
  const added = chosen.map((file): Upload => {
    const key = newKey();
    files.set(key, { file, print });
    return { key, name: file.name, sent: 0, size: file.size, phase: 'waiting', rate: null, error: null };
  });
  store.update((s) => ({ ...s, uploads: [...s.uploads, ...added] }));
  void sendNext();
}

/** Sends a refused file again, with homing and heating in front of it. */
export function homeAndHeatFirst(key: number): void {
  const chosen = files.get(key);
  if (!chosen) return;
  files.set(key, { ...chosen, prologue: true });
  change(key, { phase: 'waiting', sent: 0, rate: null, error: null, offer: false });
  void sendNext();
}

/** The service says that homing and heating are all that is missing. */
function offersPrologue(body: string): boolean {
  try {
    return typeof JSON.parse(body).error.offer?.prologue === 'string';
  } catch {
    return false;
  }
}

/**
 * Before the whole file is at the printer, nothing is queued. After that it is a job, and deleted
 * as one.
 */
export function cancelUpload(key: number): void {
  if (sending?.key === key) sending.abort();
  else if (files.has(key)) end(key, 'cancelled');
}

async function sendNext(): Promise<void> {
  if (sending) return;
  const next = store.state.uploads.find((one) => one.phase === 'waiting');
  if (!next) return;
  await send(next.key, files.get(next.key)!);
  sending = null;
  void sendNext();
}

function send(key: number, { file, print, prologue }: Chosen): Promise<void> {
  const samples: Sample[] = [{ at_ms: performance.now(), sent: 0 }];
  const note = (sent: number) => {
    const now_ms = performance.now();
    samples.push({ at_ms: now_ms, sent });
    change(key, { sent, rate: rateOf(samples, now_ms) });
  };
  return new Promise((resolve) => {
    const form = new FormData();
    form.append('print', print ? 'true' : 'false');
    if (prologue) form.append('prologue', 'true');
    form.append('file', file, file.name);
    const xhr = new XMLHttpRequest();
    let phase: Upload['phase'] = 'sending';
    const pulse = setInterval(() => {
      if (phase === 'sending') note(samples[samples.length - 1].sent);
      const stall = stallOf(phase, samples, performance.now(), store.state.silent_s);
      if (stall === null) return;
      over('refused', stall);
      xhr.onabort = null;
      xhr.abort();
    }, 1000);
    const over = (phase: 'queued' | 'cancelled' | 'refused', error: string | null = null, offer = false) => {
      clearInterval(pulse);
      end(key, phase, error, offer);
      resolve();
    };
    sending = { key, abort: () => xhr.abort() };
    change(key, { phase: 'sending' });
    xhr.open('POST', 'api/v1/jobs');
    xhr.upload.onprogress = (event) => note(Math.min(file.size, event.loaded));
    xhr.upload.onload = () => {
      phase = 'checking';
      change(key, { phase, sent: file.size });
    };
    xhr.onabort = () => over('cancelled');
    xhr.onerror = () => over('refused', 'The connection was lost: nothing was queued. Choose the file again.');
    xhr.onload = () => {
      if (xhr.status === 201) return over('queued');
      if (xhr.status === 401) store.set({ signedIn: false });
      over('refused', sentenceOf(xhr.responseText, `${xhr.status} ${xhr.statusText}`), offersPrologue(xhr.responseText));
    };
    xhr.send(form);
  });
}
