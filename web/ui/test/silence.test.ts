// What the page does when the service says nothing, when it refuses, and when it is told to stop.
import { afterEach, beforeEach, describe, expect, it, vi } from 'vitest';
import { act, apply, PATIENCE_MS, request, startLive } from '../src/api';
import { asOf, isOld, silenceOf } from '../src/silence';
import { dismissStop, emergencyStop, TRY_MS } from '../src/stop';
import { ask, initialState, isStillRunning, store } from '../src/store';
import type { Job, Status } from '../src/types';
import { STALLED_MS, stallOf } from '../src/uploads';

const heater = { c: 20, reading: true, target_c: 0, duty: 0 };
const status = (state: string, more = {}) => ({ connected: true, state, session: null, fault: null, job: null, hot_end: heater, bed: heater, ...more }) as unknown as Status;
const say = (state: string, more = {}) => apply({ type: 'status', status: status(state, more) });
const answers = (body: unknown, code = 200) => new Response(JSON.stringify(body), { status: code });
/** As fetch() of a service that takes a request and never answers. */
const never = (init?: RequestInit) => new Promise<Response>((_, reject) => {
  init?.signal?.addEventListener('abort', () => reject(new DOMException('aborted', 'AbortError')));
});

beforeEach(() => {
  vi.useFakeTimers({ toFake: ['setTimeout', 'clearTimeout', 'setInterval', 'clearInterval', 'Date', 'performance'] });
  store.state = initialState;
});
afterEach(() => {
  dismissStop();
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

describe('silence', () => {
  it('is said from three seconds on', () => {
    expect([silenceOf(null, 9000), silenceOf(1000, 3999), silenceOf(1000, 4000), silenceOf(1000, 8700)]).toEqual([null, null, 3, 7]);
  });
  it('makes what is shown old, and any word makes it new', () => {
    const at_ms = new Date(2026, 10, 26, 14, 30, 15).getTime();
    const heard = { ...initialState, online: true, newsAt_ms: at_ms };
    expect([isOld(heard), asOf(heard)]).toEqual([false, null]);
    expect([isOld({ ...heard, silent_s: 3 }), asOf({ ...heard, silent_s: 3 })]).toEqual([true, 'as of 14:30:15']);
    expect(asOf({ ...heard, online: false })).toBe('as of 14:30:15');
    store.set({ ...heard, silent_s: 9 });
    apply({ type: 'alive', time: '2026-11-26T14:30:24Z' });
    expect([store.state.silent_s, isOld(store.state)]).toEqual([null, false]);
  });
  it('a request gives up, and does not claim that nothing was done', async () => {
    vi.stubGlobal('fetch', (_: string, init?: RequestInit) => never(init));
    const asked = expect(request('POST', 'machine/pause')).rejects.toThrow(/has not answered for 5 s: whether it was done is not known/);
    await vi.advanceTimersByTimeAsync(PATIENCE_MS);
    await asked;
  });
  it('an answer that breaks off in its middle is no answer', async () => {
    vi.stubGlobal('fetch', async (_: string, init?: RequestInit) => {
      const body = new ReadableStream({ start: (on) => { init?.signal?.addEventListener('abort', () => on.error(new DOMException('aborted', 'AbortError'))); } });
      return new Response(body);
    });
    const asked = expect(request('GET', 'machine')).rejects.toThrow(/has not answered/);
    await vi.advanceTimersByTimeAsync(PATIENCE_MS);
    await asked;
  });
  it('a stream that is open and silent is greyed, given up and opened again', async () => {
    const sockets: { onopen?: () => void; onmessage?: (event: { data: string }) => void; closed: boolean }[] = [];
    vi.stubGlobal('window', globalThis);
    vi.stubGlobal('location', { protocol: 'http:', host: 'printer', href: 'http://printer/' });
    vi.stubGlobal('WebSocket', class {
      closed = false;
      constructor() { sockets.push(this); }
      close() { this.closed = true; }
    });
    vi.stubGlobal('fetch', async () => answers(status('idle')));
    const stop = startLive();
    await vi.advanceTimersByTimeAsync(10);
    expect([sockets.length, store.state.online]).toEqual([1, false]);
    sockets[0].onopen!();
    expect(store.state.online, 'open, but nothing was heard').toBe(false);
    sockets[0].onmessage!({ data: '{"type":"alive","time":""}' });
    expect([store.state.online, isOld(store.state)]).toEqual([true, false]);
    await vi.advanceTimersByTimeAsync(4600);
    expect([store.state.silent_s, store.state.online, sockets[0].closed]).toEqual([4, true, false]);
    await vi.advanceTimersByTimeAsync(6000);
    expect([sockets[0].closed, sockets.length, store.state.online]).toEqual([true, 2, false]);
    sockets[1].onmessage!({ data: '{"type":"alive","time":""}' });
    expect([isOld(store.state), store.state.silent_s]).toEqual([false, null]);
    stop();
  });
  it('ends an upload of which nothing moves, and not one that is checked for long', () => {
    const moved = (...sent: number[]) => sent.map((bytes, i) => ({ at_ms: 1000 * i, sent: bytes }));
    expect(stallOf('sending', moved(0, 10, 20), STALLED_MS, null)).toBeNull();
    expect(stallOf('sending', moved(0, 20, 20), STALLED_MS + 1000, null)).toMatch(/nothing was queued/);
    expect(stallOf('checking', moved(0, 20), 100 * STALLED_MS, null)).toBeNull();
    expect(stallOf('checking', moved(0, 20), 100 * STALLED_MS, STALLED_MS / 1000)).toMatch(/Look whether it is in the queue/);
  });
});

describe('the emergency stop', () => {
  const service = (machine: () => Status | null, takes = () => true) => {
    const asked: string[] = [];
    vi.stubGlobal('fetch', (path: string, init?: RequestInit) => {
      asked.push(`${init?.method} ${path}`);
      if (init?.method === 'POST') return takes() ? Promise.resolve(new Response(null, { status: 202 })) : never(init);
      const now = machine();
      return now ? Promise.resolve(answers(now)) : never(init);
    });
    return asked;
  };
  const phase = () => store.state.stop?.phase;

  it('is confirmed when the service has answered and the machine says that it stands', async () => {
    let state = 'printing';
    const asked = service(() => status(state));
    void emergencyStop();
    expect(phase()).toBe('asked');
    await vi.advanceTimersByTimeAsync(300);
    expect(phase(), 'an answer alone is no stop').toBe('asked');
    state = 'faulted';
    await vi.advanceTimersByTimeAsync(100);
    expect([phase(), store.state.status?.state]).toEqual(['confirmed', 'faulted']);
    expect(asked.filter((one) => one.startsWith('POST'))).toEqual(['POST api/v1/machine/emergency-stop']);
  });
  it('is not confirmed while the service is silent, and goes on trying until it is', async () => {
    let silent = true;
    const asked = service(() => (silent ? null : status('faulted')), () => !silent);
    void emergencyStop();
    await vi.advanceTimersByTimeAsync(TRY_MS + 100);
    expect([phase(), store.state.stop?.reason]).toEqual(['unconfirmed', expect.stringMatching(/has not answered/)]);
    await vi.advanceTimersByTimeAsync(10_000);
    expect(asked.length).toBeGreaterThan(3);
    silent = false;
    await vi.advanceTimersByTimeAsync(TRY_MS + 1000);
    expect(phase()).toBe('confirmed');
    const tries = asked.length;
    await vi.advanceTimersByTimeAsync(10_000);
    expect(asked.length, 'nothing is stopped again afterwards').toBe(tries);
  });
  it('is not confirmed when the machine goes on', async () => {
    service(() => status('printing'));
    void emergencyStop();
    await vi.advanceTimersByTimeAsync(TRY_MS + 200);
    expect([phase(), store.state.stop?.reason]).toEqual(['unconfirmed', expect.stringMatching(/does not say that it stands/)]);
  });
  it('can be given up, and its good news goes with the fault', async () => {
    const asked = service(() => status('printing'));
    void emergencyStop();
    await vi.advanceTimersByTimeAsync(TRY_MS + 200);
    dismissStop();
    const tries = asked.filter((one) => one.startsWith('POST')).length;
    await vi.advanceTimersByTimeAsync(10_000);
    expect([phase(), asked.filter((one) => one.startsWith('POST')).length]).toEqual([undefined, tries]);
    service(() => status('faulted'));
    void emergencyStop();
    await vi.advanceTimersByTimeAsync(100);
    expect(phase()).toBe('confirmed');
    await vi.advanceTimersByTimeAsync(5000);
    say('faulted');
    expect(phase()).toBe('confirmed');
    say('idle');
    expect(phase()).toBeUndefined();
  });
});

describe('questions and refusals', () => {
  const job = (id: number, state: string) => ({ id, state }) as Job;
  const page = (...jobs: Job[]) => ({ type: 'jobs', jobs, next_before: null, counts: initialState.counts, queue: initialState.gate }) as const;
  it('a question is taken back when what it asks about has ended', async () => {
    say('printing', { job: 1 });
    apply(page(job(1, 'printing')));
    const answer = ask('Cancel it?', 'Cancel', (s) => isStillRunning(s, job(1, 'printing')));
    apply({ type: 'alive', time: '' });
    expect(store.state.question?.text).toBe('Cancel it?');
    apply(page(job(1, 'done'), job(2, 'printing')));
    expect(store.state.question).toBeNull();
    expect(await answer).toBe(false);
  });
  it('a question about a print goes with an emergency stop', async () => {
    say('printing', { job: 1 });
    apply(page(job(1, 'printing')));
    const answer = ask('Cancel it?', 'Cancel', (s) => isStillRunning(s, job(1, 'printing')));
    say('faulted', { job: 1 });
    expect(await answer).toBe(false);
  });
  it('a refusal ends with its cause, and not before', async () => {
    vi.stubGlobal('fetch', async () => answers({ error: { message: 'nothing is printing' } }, 409));
    say('idle');
    await act('print', 'POST', 'machine/cancel');
    await act('queue', 'POST', 'queue/release');
    say('idle', { hot_end: { ...heater, c: 25 } });
    expect(store.state.refusals).toEqual({ print: 'Nothing is printing', queue: 'Nothing is printing' });
    say('printing', { job: 2 });
    expect(store.state.refusals, 'the queue is as it was').toEqual({ queue: 'Nothing is printing' });
    apply({ ...page(), queue: { ...initialState.gate, held: true, reason: 'held by a person' } });
    expect(store.state.refusals).toEqual({});
  });
  it('a refused jog ends when the axes are homed', async () => {
    vi.stubGlobal('fetch', async () => answers({ error: { message: 'home first' } }, 409));
    say('idle', { homed: [false, false, false] });
    await act('jog', 'POST', 'machine/jog', { x_mm: 1 });
    expect(store.state.refusals.jog).toBe('Home first');
    say('idle', { homed: [true, false, false] });
    expect(store.state.refusals).toEqual({});
  });
});
