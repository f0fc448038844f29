import { afterEach, describe, expect, it, vi } from 'vitest';
import { bars, chainTimes, chainTitle, periodsOf, usedShare } from '../src/components/Timing';
import * as format from '../src/format';
import { activityShares, chunks, cssColour, decodeLayers, MAGIC, segmentsDone } from '../src/layers';
import { ApiError, keyProblem, sentenceOf, startLive } from '../src/api';
import { doing, tabTitle } from '../src/doing';
import { shallowEqual } from '../src/hooks';
import { bytesLaid, joined, lineToName, listPath, olderBehind, renewed, stopOf } from '../src/jobs';
import { addSample, ask, initialState, progressNow, lacks, onTheWall, reduce, shownJob, store, withoutJob, type State } from '../src/store';
import type { Job, JobPage, LoopGuarantee, Status } from '../src/types';
import { rateOf } from '../src/uploads';
import { failedJob, whatNow } from '../src/whatnow';

/** One record as printer/preflight/layer_packer.h lays it out. */
function record(layer: number, firstByte: number, vertices: [number, number, number, number, number, number][]): ArrayBuffer {
  const buffer = new ArrayBuffer(40 + vertices.length * 20);
  const view = new DataView(buffer);
  view.setUint32(0, MAGIC, true);
  view.setUint32(4, layer, true);
  view.setFloat32(12, 0.2, true);
  view.setUint32(20, vertices.length, true);
  view.setUint32(24, vertices.filter((v) => v[4] === 0).length, true);
  view.setFloat64(32, firstByte, true);
  vertices.forEach(([x, y, z, feature, flags, byte], i) => {
    const at = 40 + i * 20;
    view.setFloat32(at, x, true);
    view.setFloat32(at + 4, y, true);
    view.setFloat32(at + 8, z, true);
    view.setUint8(at + 12, feature);
    view.setUint8(at + 13, flags);
    view.setUint16(at + 14, 450, true);
    view.setUint32(at + 16, byte, true);
  });
  return buffer;
}

function join(...parts: ArrayBuffer[]): ArrayBuffer {
  const out = new Uint8Array(parts.reduce((n, p) => n + p.byteLength, 0));
  let at = 0;
  for (const part of parts) {
    out.set(new Uint8Array(part), at);
    at += part.byteLength;
  }
  return out.buffer;
}

describe('the time by feature', () => {
  it('is in shares of the whole, the longest first', () => {
    const shares = activityShares({ outer_wall: 60, travel: 30, heating: 110, retraction: 0 });
    expect(shares.map(({ name, seconds }) => [name, seconds])).toEqual([['Heating', 110], ['Outer wall', 60], ['Travel', 30]]);
    expect(shares.reduce((sum, { share }) => sum + share, 0)).toBeCloseTo(1);
    expect(shares[1].colour).toEqual([1.00, 0.47, 0.16]);
    expect(shares[2].colour).toBeNull();
  });
  it('shows a word that is new to the page, and nothing of an old job', () => {
    expect(activityShares({ brushing: 5 })[0].name).toBe('brushing');
    expect(activityShares(undefined)).toEqual([]);
  });
  it('has the colours of the part', () => expect(cssColour([1, 0, 0])).toBe('rgb(255 0 0)'));
});

describe('layers', () => {
  const one = record(0, 1000, [[0, 0, 0.2, 0, 1, 0], [10, 0, 0.2, 1, 0, 20], [10, 5, 0.2, 2, 0, 40], [50, 50, 0.2, 0, 1, 60], [60, 50, 0.2, 4, 0, 80]]);
  it('are read as segments, and travel is not', () => {
    const [layer] = decodeLayers(one);
    expect(layer.segments).toBe(3);
    expect([...layer.ends.slice(6, 12)]).toEqual([10, 0, expect.closeTo(0.2), 10, 5, expect.closeTo(0.2)]);
    expect([...layer.ends.slice(12, 18)].map(Math.round)).toEqual([50, 50, 0, 60, 50, 0]);
    expect([...layer.features]).toEqual([1, 2, 4]);
    expect([...layer.bytes]).toEqual([1020, 1040, 1080]);
    expect(layer.widths_um[0]).toBe(450);
  });
  it('stand one after the other', () => {
    expect(decodeLayers(join(one, record(1, 2000, [[0, 0, 0.4, 0, 1, 0], [1, 1, 0.4, 1, 0, 5]]))).map((r) => r.layer)).toEqual([0, 1]);
  });
  it('that are cut off or no layers are refused with their place', () => {
    expect(() => decodeLayers(one.slice(0, 60))).toThrow('byte 0 is cut off');
    expect(() => decodeLayers(join(one, new ArrayBuffer(50)))).toThrow(`no record at byte ${one.byteLength}`);
  });
  it('are drawn as far as the job is executed', () => {
    const [layer] = decodeLayers(one);
    expect([0, 1020, 1021, 1040, 1041, 5000].map((b) => segmentsDone(layer, b))).toEqual([0, 0, 1, 1, 2, 3]);
  });
  it('are asked for in runs of a few megabytes', () => {
    const index = [3e6, 2e6, 1e6, 9e6, 1e6].map((bytes, i) => ({ index: i, layer: i, z_mm: i, segments: 1, bytes, first_byte: 0 }));
    expect(chunks(index)).toEqual([[0, 1], [2, 3], [4, 4]]);
    expect(chunks([])).toEqual([]);
  });
});

describe('format', () => {
  it('durations', () => {
    expect([0, 59, 61, 754, 4804, null, -1].map((s) => format.duration(s))).toEqual(['0 s', '59 s', '1 min 01 s', '13 min', '1 h 20 min', '–', '–']);
  });
  it('bytes', () => expect([5, 1500, 3482129, 150e6, 999999].map(format.bytes)).toEqual(['5 B', '1.5 KB', '3.5 MB', '150 MB', '1.0 MB']));
  it('nanoseconds', () => expect([12, 1500, 51e6, 2e9, -1500].map(format.nanoseconds)).toEqual(['12 ns', '1.50 µs', '51.0 ms', '2.00 s', '−1.50 µs']));
  it('counts', () => expect(format.count(1234567)).toBe('1\u202f234\u202f567'));
  it('brief counts', () => expect([0, 37, 99999, 123456, 999600, 5.52e6, 1.2e9].map(format.briefCount)).toEqual(
    ['0', '37', '99\u202f999', '123 k', '1.00 M', '5.52 M', '1.20 G']));
  it('whole percents, never more than is done', () => expect([0.999, 0.5049, -1, 2].map(format.wholePercent)).toEqual(['99 %', '50 %', '0 %', '100 %']));
  it('percent', () => expect([0, 0.005, 0.5, 1, 1.2].map(format.percent)).toEqual(['0 %', '0.5 %', '50 %', '100 %', '100 %']));
  it('progress, never more than what is done', () => expect([0, 0.0479, 0.0999, 0.579, 0.9999, 1].map(format.done)).toEqual(['0 %', '4.7 %', '9.9 %', '57 %', '99 %', '100 %']));
  it('clock', () => expect(format.clock(3600, new Date(2026, 0, 1, 23, 30))).toBe('00:30'));
});

const status = { connected: true, hot_end: { c: 200, target_c: 210, duty: 1 }, bed: { c: 20, target_c: 0, duty: 0 } } as Status;

describe('state', () => {
  it('keeps one sample a second for ten minutes, and no target when it is off', () => {
    let history = initialState.history;
    for (let t = 0; t < 700; t += 0.5) history = addSample(history, status, t);
    expect(history.t_s.length).toBe(601);
    expect(history.t_s[0]).toBe(99);
    expect(history.bed_target_c[5]).toBeNull();
    expect(history.hot_end_target_c[5]).toBe(210);
  });
  const job = (id: number, state: string) => ({ id, state }) as Job;
  it('shows the printing job, then the next, then the last', () => {
    const jobs = [job(3, 'queued'), job(2, 'done'), job(1, 'printing')];
    expect(shownJob({ ...initialState, jobs })?.id).toBe(1);
    expect(shownJob({ ...initialState, jobs: jobs.slice(0, 2) })?.id).toBe(3);
    expect(shownJob({ ...initialState, jobs: [jobs[1]] })?.id).toBe(2);
    expect(shownJob({ ...initialState, jobs, shown: jobs[1] })?.id).toBe(2);
    expect(shownJob({ ...initialState, jobs: [], shown: jobs[1] })?.id).toBe(2);
    expect(shownJob(initialState)).toBeNull();
  });
  it('shows what has failed or lies on the bed, and at a fault no older verdict', () => {
    const faulted = { ...status, state: 'faulted' } as Status;
    const queued = job(4, 'queued');
    const gate = { ...initialState.gate, held: true };
    const failed = { ...initialState, jobs: [queued, job(3, 'failed'), job(2, 'done')], gate };
    expect(shownJob({ ...failed, status: faulted })?.id).toBe(3);
    expect(shownJob(failed)?.id).toBe(3);
    expect(shownJob({ ...failed, gate: initialState.gate })?.id).toBe(4);
    const done = { ...initialState, jobs: [job(2, 'done')], status: faulted };
    expect(shownJob(done)).toBeNull();
    expect(shownJob({ ...initialState, jobs: [queued, job(3, 'done')], gate: { ...initialState.gate, bed_occupied: true } })?.id).toBe(3);
  });
  it('a sensor that is silent leaves a gap in the curve', () => {
    const dead = { ...status, hot_end: { ...status.hot_end, reading: false } } as Status;
    expect(addSample(initialState.history, dead, 5).hot_end_c).toEqual([null]);
  });
  it('keeps printer text as text, line by line, and not too much of it', () => {
    let state = initialState;
    for (let i = 0; i < 300; i++) state = reduce(state, { type: 'reply', kind: 'text', text: `<b>${i}</b>` }, 0);
    expect(state.console.length).toBe(200);
    expect(state.console[199].text).toBe('<b>299</b>');
    expect(reduce(initialState, { type: 'reply', kind: 'error', text: 'a\nb' }, 0).console.map((l) => l.text)).toEqual(['a', 'b']);
  });
});

describe('progress', () => {
  const job = (id: number, state: string, estimated_s: number | null, more = {}) =>
    ({ id, state, size: 1000, copies: 1, copies_done: 0, facts: { estimated_s }, progress: { fraction: 0.1, remaining_s: 90 }, ...more }) as unknown as Job;
  const at = (bytes_executed: number) => ({ ...status, state: 'printing', job: 1, bytes_executed, print_time_s: 60 }) as Status;
  it('goes by the newest message that speaks of the job', () => {
    const fresh = { bytes: 250, fraction: 0.25, elapsed_s: 60, remaining_s: 150 };
    const now = { ...status, state: 'printing', job: 1, progress: fresh } as Status;
    expect(progressNow(job(1, 'printing', 200), now)).toBe(fresh);
    expect(progressNow(job(2, 'done', 200), now).fraction).toBe(0.1);
    expect(progressNow(job(1, 'printing', 200), { ...now, progress: null }).remaining_s).toBe(90);
    expect(progressNow(job(1, 'printing', 200), null).remaining_s).toBe(90);
  });
  it('a print that begins is shown', () => {
    const looking = { ...initialState, jobs: [job(1, 'printing', 1)], shown: job(7, 'done', 1) };
    const page = (jobs: Job[]) => ({ type: 'jobs', jobs, next_before: null, counts: initialState.counts, queue: initialState.gate }) as const;
    expect(reduce(looking, page([job(1, 'paused', 1)]), 0).shown?.id).toBe(7);
    expect(reduce(looking, page([]), 0).shown?.id).toBe(7);
    expect(reduce(looking, page([job(2, 'printing', 1)]), 0).shown).toBeNull();
  });
  it('is told in the printer\'s time, and the time of day in the wall\'s', () => {
    expect(onTheWall(600, { ...status, time_factor: 20 } as Status)).toBe(30);
    expect(onTheWall(600, null)).toBe(600);
    expect(onTheWall(null, status)).toBeNull();
  });
  it('says where a job has stopped: as the service says it, else as the machine still does', () => {
    const failed = job(1, 'failed', 200, { stopped_line: 50, stopped_layer: 4, facts: { lines: 200 } });
    expect(stopOf(failed, null)).toEqual({ line: 50, layer: 4, fraction: 0.25 });
    expect(stopOf({ ...failed, stopped_byte: 340 }, null).fraction).toBe(0.34);
    expect(stopOf(failed, { ...at(400), layer: 9, line: 90 } as Status)).toEqual({ line: 50, layer: 4, fraction: 0.4 });
    const unknown = job(1, 'failed', 200, { stopped_line: null, stopped_layer: null });
    expect(stopOf(unknown, { ...at(400), layer: 9, line: 90 } as Status)).toEqual({ line: 90, layer: 9, fraction: 0.4 });
    expect(stopOf(unknown, null)).toEqual({ line: null, layer: null, fraction: null });
  });
});

describe('a failure', () => {
  it('has one line, and where its reason names one, that', () => {
    const failed = (error: string) => ({ error, stopped_line: 1498 }) as Job;
    expect(lineToName(failed('emergency stop'), 1498)).toBe(1498);
    expect(lineToName(failed('Line 1759, G1: the hot end is at 169.6 °C'), 1498)).toBeNull();
    expect(lineToName(failed('baseline 3'), 1498)).toBe(1498);
  });
});

describe('the picture of a part', () => {
  const job = (state: string, more = {}) => ({
    id: 1, state, size: 1000, facts: { lines: 200 }, progress: { bytes: 120 }, stopped_line: null, stopped_layer: null, stopped_byte: null, ...more,
  }) as unknown as Job;
  const machine = { ...status, job: 1, bytes_executed: 400 } as Status;
  it('goes as far as a stopped print came, and no further', () => {
    expect(bytesLaid(job('failed', { stopped_byte: 340 }), null)).toBe(340);
    expect(bytesLaid(job('failed', { stopped_byte: 0 }), null)).toBe(0);
    expect(bytesLaid(job('cancelled', { stopped_line: 50 }), null)).toBe(250);
    expect(bytesLaid(job('failed', { stopped_byte: 340 }), { ...machine, job: 2 })).toBe(340);
    expect(bytesLaid(job('failed'), null)).toBe(Infinity);
  });
  it('follows the machine while it prints, and is whole before and after', () => {
    expect(bytesLaid(job('printing'), machine)).toBe(400);
    expect(bytesLaid(job('printing'), { ...machine, job: null })).toBe(120);
    expect(bytesLaid(job('done', { stopped_byte: 3 }), machine)).toBe(Infinity);
    expect(bytesLaid(job('queued'), machine)).toBe(Infinity);
    expect(bytesLaid(null, machine)).toBe(Infinity);
  });
});

describe('what the printer does', () => {
  const heater = (c: number, target_c: number) => ({ c, target_c, reading: true, duty: 0 });
  const at = (more: object) => ({ connected: true, state: 'printing', activity: null, parked: false, hot_end: heater(143.4, 209), bed: heater(60, 60), ...more }) as Status;
  const words = (more: object) => {
    const { word, detail } = doing(true, at(more));
    return `${word} ${detail}`.trim();
  };
  it('is said by what it waits for', () => {
    expect(words({})).toBe('Printing');
    expect(words({ activity: 'homing' })).toBe('Homing');
    expect(words({ activity: 'heating_hot_end' })).toBe('Heating 143 of 209 °C');
    expect(words({ activity: 'heating_bed', bed: heater(41.6, 60) })).toBe('Heating bed 42 of 60 °C');
    expect(words({ activity: 'heating_bed', bed: heater(80, 45) })).toBe('Cooling bed 80 of 45 °C');
    expect(words({ state: 'paused', parked: true })).toBe('Paused · parked');
    expect(words({ state: 'pausing', activity: 'heating_bed' })).toBe('Pausing');
    expect(words({ state: 'idle', hot_end: heater(143.4, 0), bed: heater(50, 0) })).toBe('Ready · cooling, 143 °C');
    expect(words({ state: 'idle', hot_end: heater(31, 0), bed: heater(50, 0) })).toBe('Ready');
    expect(doing(false, at({})).word).toBe('Not reached');
    expect(doing(true, null).word).toBe('Disconnected');
  });
  it('is the name of the tab, with the printer\'s', () => {
    const job = { id: 1, state: 'printing', name: 'part.gcode' } as Job;
    expect(tabTitle(doing(true, at({})), job, 0.579, 'Prusa')).toBe('57 % Printing · Prusa · part.gcode');
    expect(tabTitle(doing(true, at({ state: 'idle', hot_end: heater(20, 0) })), null, 0, 'Prusa')).toBe('Ready · Prusa');
  });
});

describe('what a person must do next', () => {
  const job = (id: number, state: string, more = {}) => ({ id, state, name: `${id}.gcode`, size: 10, facts: { layers: 99 }, stopped_layer: 34, stopped_line: 3, stopped_byte: 4, ...more }) as unknown as Job;
  const gate = { held: false, reason: null, bed_occupied: false, confirm_bed: true };
  const at = (more: object) => ({ ...initialState, online: true, status: { ...status, state: 'idle', fault: null } as unknown as Status, gate, ...more });
  const steps = (state: State) => whatNow(state)?.steps.map(({ key }) => key) ?? [];
  it('is nothing, or steps in the one order that works', () => {
    expect(whatNow(at({}))).toBeNull();
    const faulted = at({
      status: { ...status, state: 'faulted', fault: 'emergency stop' }, jobs: [job(3, 'queued'), job(2, 'failed', { error: 'emergency stop' })],
      gate: { ...gate, held: true, reason: 'job 2 failed: emergency stop', bed_occupied: true },
    });
    expect(steps(faulted)).toEqual(['fault', 'bed', 'gate']);
    expect(whatNow(faulted)).toMatchObject({ kind: 'danger', why: 'emergency stop', where: [{ name: '2.gcode' }, ', layer 34 of 99'] });
    const cleared = { ...faulted, status: { ...status, state: 'idle' } as Status };
    expect(steps(cleared)).toEqual(['bed', 'gate']);
    expect(whatNow(cleared)?.why).toBe('job 2 failed: emergency stop');
    expect(failedJob(cleared)?.id).toBe(2);
    expect(steps({ ...cleared, jobs: [job(3, 'printing')] })).toEqual(['gate']);
    expect(steps({ ...faulted, online: false })).toEqual([]);
  });
  it('names what waits for the bed', () => {
    const state = at({ jobs: [job(3, 'queued'), job(2, 'done')], gate: { ...gate, bed_occupied: true } });
    expect(whatNow(state)?.title).toEqual([{ name: '3.gcode' }, ' waits for a clear bed.']);
    expect(failedJob(state)).toBeNull();
  });
});

describe('a question', () => {
  const job = (id: number, state: string) => ({ id, state }) as Job;
  it('ends with what it is about', async () => {
    store.set({ jobs: [job(1, 'printing')] });
    const answer = ask('Cancel?', 'Cancel', ({ jobs }) => jobs.some(({ id, state }) => id === 1 && state === 'printing'));
    store.set({ keyProblem: null });
    expect(store.state.question).not.toBeNull();
    store.set({ jobs: [job(1, 'done')] });
    expect(await answer).toBe(false);
    expect(store.state.question).toBeNull();
    store.set({ jobs: [] });
  });
});

describe('names of others', () => {
  it('show what turns or hides their letters', () => {
    expect(format.visible('gcode\u202Eedocg.exe')).toBe('gcode‹U+202E›edocg.exe');
    expect(format.visible('a\u2066b\u200Fc\u0007')).toBe('a‹U+2066›b‹U+200F›c‹U+0007›');
    expect(format.visible('Würfel ½ \u05D0 👩\u200D🚀')).toBe('Würfel ½ \u05D0 👩\u200D🚀');
    expect(format.quoted('a\u2069b')).toBe('\u2068a‹U+2069›b\u2069');
  });
});

describe('pages of jobs', () => {
  const ended = (...ids: number[]) => ids.map((id) => ({ id, state: 'done', name: `old ${id}` }) as Job);
  const ids = (list: Job[]) => list.map((job) => job.id);
  const page = (jobs: Job[], next_before: number | null = 1): { type: 'jobs' } & JobPage =>
    ({ type: 'jobs', jobs, next_before, counts: initialState.counts, queue: initialState.gate });
  it('are asked for with what is searched for', () => {
    expect(listPath({ text: ' a&b ', states: 'queued,held' }, 100, 7)).toBe('jobs?limit=100&before=7&state=queued%2Cheld&q=a%26b');
    expect(listPath({ text: '', states: '' }, 50, null)).toBe('jobs?limit=50');
  });
  it('join behind a first page that has moved on', () => {
    expect(ids(olderBehind(ended(9, 8, 7, 6, 5), ended(10, 9, 8)))).toEqual([7, 6, 5]);
    expect(ids(olderBehind(ended(9, 8, 7, 6, 5), ended(9, 7, 6)))).toEqual([5]);
    expect(ids(olderBehind(ended(9, 8, 7), ended(30, 29, 28)))).toEqual([]);
    expect(ids(joined(ended(9, 8), ended(8, 7)))).toEqual([9, 8, 7]);
    expect(renewed(ended(9, 8), [{ id: 8, state: 'queued' } as Job])[1].state).toBe('queued');
  });
  it('a live first page keeps what was loaded, as long as there is no gap', () => {
    const loaded = { ...initialState, jobs: ended(9, 8), older: ended(7, 6), older_before: 6 };
    const next = reduce(loaded, page(ended(10, 9)), 0);
    expect([ids(next.jobs), ids(next.older), next.older_before]).toEqual([[10, 9], [8, 7, 6], 6]);
    const gap = reduce(loaded, page(ended(99, 98), 98), 0);
    expect([ids(gap.jobs), ids(gap.older), gap.older_before]).toEqual([[99, 98], [], 98]);
    expect(reduce({ ...initialState, jobs: ended(9, 8), older_before: 8 }, page(ended(10, 9), 9), 0).older_before).toBe(9);
  });
  it('a deleted job leaves every list', () => {
    const state = { ...initialState, jobs: ended(9), older: ended(8, 7), found: { jobs: ended(8), next_before: null }, shown: ended(8)[0] };
    const left = withoutJob(state, 8);
    expect([ids(left.jobs), ids(left.older), ids(left.found!.jobs), left.shown]).toEqual([[9], [7], [], null]);
  });
  it('a hundred thousand of them move on by one without a hole', () => {
    const many = ended(...Array.from({ length: 100_000 }, (_, i) => 200_000 - i));
    const state = { ...initialState, jobs: many.slice(0, 50), older: many.slice(50) };
    const next = reduce(state, page(ended(200_001, ...ids(many.slice(0, 49)))), 0);
    expect(next.older.length).toBe(99_951);
    expect(next.older[0].id).toBe(many[49].id);
  });
});

describe('uploads', () => {
  it('have a rate over the last seconds, which falls when nothing moves', () => {
    const at = (...samples: [number, number][]) => samples.map(([at_ms, sent]) => ({ at_ms, sent }));
    expect(rateOf(at([0, 0]), 100)).toBeNull();
    expect(rateOf(at([0, 0], [1000, 500], [2000, 1000]), 2000)).toBe(500);
    expect(rateOf(at([0, 0], [1000, 9000], [5000, 9000], [6000, 9000], [7000, 9000]), 7000)).toBe(0);
    expect(rateOf(at([0, 0], [1000, 1000], [2000, 5000], [5000, 17000]), 5000)).toBe(4000);
  });
});

describe('a wrong key', () => {
  it('is explained, not numbered', () => {
    const words = (status: number) => keyProblem(new ApiError('this needs the key: send it as X-Api-Key', status));
    expect(words(401)).toMatch(/not the key of this printer/);
    expect(words(429)).toMatch(/Wait a minute/);
    expect(words(0)).toMatch(/not reached/);
    expect([401, 429, 0].map(words).join()).not.toMatch(/X-Api-Key|\d{3}/);
  });
});

describe('answers of the service', () => {
  it('are said with their line, or by their status', () => {
    expect(sentenceOf('{"error":{"message":"too hot","line":3}}', '422')).toBe('Line 3: too hot');
    expect(sentenceOf('{"error":{"message":"line 3, M104: too hot","line":3}}', '422')).toBe('Line 3, M104: too hot');
    expect(sentenceOf('{"error":{"message":"too hot","line":0}}', '422')).toBe('Too hot');
    expect(sentenceOf('<html>', '502 Bad Gateway')).toBe('502 Bad Gateway');
    expect(sentenceOf('{"error":7}', '500')).toBe('500');
  });
});

describe('drawing again', () => {
  it('happens when a field changes, not when a record is made anew', () => {
    expect(shallowEqual({ a: 1, b: null }, { a: 1, b: null })).toBe(true);
    expect(shallowEqual({ a: 1 }, { a: 2 })).toBe(false);
    expect(shallowEqual({ a: undefined }, { b: undefined })).toBe(false);
    expect(shallowEqual([1, 2], [1, 2, 3])).toBe(false);
    expect(shallowEqual(null, {})).toBe(false);
  });
});

describe('lateness bars', () => {
  it('gather buckets by powers of two, without gaps', () => {
    expect(bars([[15, 5], [31, 2], [1023, 7], [4095, 1]]).map((b) => [b.upTo_ns, b.count])).toEqual(
      [[16, 5], [32, 2], [64, 0], [128, 0], [256, 0], [512, 0], [1024, 7], [2048, 0], [4096, 1]]);
    expect(bars([])).toEqual([]);
  });
});

describe('what is guaranteed', () => {
  const loop = (part: Partial<LoopGuarantee>): LoopGuarantee => ({
    id: 1, core: 0, budget_us: 30_000, period_us: 100_000, priority_enforced: true, budget_enforced: true, core_owned: false, shortfall: '',
    cpu_used_us: 2e6, watched_us: 10e6, held_from_outside: 0, escape: '', releases: 100, overruns: 0, missed: 0, worst_late_us: 0, ...part,
  });
  it('shows the share of the core that was used since the report before', () => {
    expect(usedShare(loop({}))).toBe(0.2);
    expect(usedShare(loop({}), loop({ cpu_used_us: 1.5e6, watched_us: 5e6 }))).toBe(0.1);
  });
  it('takes the whole run where the one before is of another run, or just made', () => {
    expect(usedShare(loop({}), loop({ cpu_used_us: 9e6, watched_us: 90e6 }))).toBe(0.2);
    expect(usedShare(loop({}), loop({ cpu_used_us: 1.9e6, watched_us: 9.5e6 }))).toBe(0.2);
    expect(usedShare(loop({}), loop({ cpu_used_us: 3e6, watched_us: 5e6 }))).toBe(0.2);
  });
  it('shows no share where nobody watches', () => {
    expect(usedShare(loop({ cpu_used_us: null, watched_us: null }))).toBeNull();
    expect(usedShare(loop({ cpu_used_us: 0, watched_us: 0 }))).toBeNull();
  });
  it('counts late releases, and the periods of one that does not end', () => {
    expect(periodsOf(loop({}))).toMatchObject({ text: '✓', bad: false });
    expect(periodsOf(loop({ overruns: 2, worst_late_us: 1500 }))).toEqual({ text: '2 late', title: '100 releases, 2 late, the worst by 1.50 ms', bad: true });
    expect(periodsOf(loop({ missed: 7 }))).toEqual({ text: '7 late', title: '100 releases, 0 late; it is in one for 7 periods now', bad: true });
  });
  it('says nothing of the periods of a loop that does not wait for them', () => {
    expect(periodsOf(loop({ releases: 1 })).text).toBe('–');
    expect(periodsOf(loop({ releases: null, overruns: null, missed: null, worst_late_us: null })).text).toBe('–');
  });
  it('holds the worst that was seen of a chain against its bound', () => {
    expect(chainTimes(8520, 15600)).toEqual({ text: '8.52 ms of 15.6 ms', bad: false });
    expect(chainTimes(15600, 15600).bad).toBe(false);
    expect(chainTimes(15601, 15600).bad).toBe(true);
    expect(chainTimes(null, 15600)).toEqual({ text: '– of 15.6 ms', bad: false });
    expect(chainTimes(null, null)).toEqual({ text: '–', bad: false });
  });
  it('says where a chain is seen from', () => {
    const chain = { name: 'a', way: '', reaction_bound_us: 40, reaction_limit_us: 40_000, age_bound_us: null, age_limit_us: null, reactions: 7, worst_reaction_us: 1, worst_age_us: null, from_first_loop: true };
    expect(chainTitle(chain)).toMatch(/asks for 40.0 ms: 7 reactions, seen from its first loop on$/);
    expect(chainTitle({ ...chain, reaction_limit_us: null, from_first_loop: false })).toMatch(/answers it: 7 reactions$/);
  });
});

describe('a printer that lacks parts', () => {
  const page = { jobs: [], next_before: null, counts: initialState.counts, queue: { ...initialState.gate, durable: false } };
  afterEach(() => vi.unstubAllGlobals());
  const printer = (status: object) => {
    const asked: string[] = [];
    const sockets: string[] = [];
    vi.stubGlobal('location', { protocol: 'http:', host: 'printer', href: 'http://printer/' });
    vi.stubGlobal('window', globalThis);
    vi.stubGlobal('WebSocket', class { constructor(url: string | URL) { sockets.push(String(url)); } close() {} });
    vi.stubGlobal('fetch', async (path: string) => {
      asked.push(path);
      return new Response(JSON.stringify(path.endsWith('/jobs') ? page : status));
    });
    return { asked, sockets };
  };

  it('is asked again and again where it has no live stream', async () => {
    const { asked, sockets } = printer({ connected: false, lacks: ['live', 'hand'] });
    const stop = startLive();
    await vi.waitFor(() => expect(store.state.gate.durable).toBe(false));
    stop();
    expect(store.state.online).toBe(false);
    expect(asked).toEqual(['api/v1/machine', 'api/v1/machine', 'api/v1/jobs']);
    expect(sockets).toEqual([]);
    expect([lacks(store.state, 'hand'), lacks(store.state, 'layers')]).toEqual([true, false]);
  });

  it('is streamed from where it has one', async () => {
    const { asked, sockets } = printer({ connected: false });
    const stop = startLive();
    await vi.waitFor(() => expect(sockets).toEqual(['ws://printer/api/v1/live']));
    stop();
    expect(asked).toEqual(['api/v1/machine']);
  });
});
