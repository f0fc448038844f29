// A printer without a printer: serves the built page and the interface of docs/api.md with a
// simulated print. So the page can be worked on and looked at without the service. Plain node, no
// dependencies.
//
//   node mock/server.mjs [--port 8090] [--scene SCENE] [--key KEY]
//   scenes: idle heating printing finished queue30 paused faulted stuck-fault disconnected held bed
//           no-confirm idle-warning idle-off unhomed simulated many
//
// It is a stage set and no reference: printd is, and tests/e2e/browser runs the page against it.
import { createServer } from 'node:http';
import { readFile } from 'node:fs/promises';
import { extname, join, normalize } from 'node:path';
import { fileURLToPath } from 'node:url';
import { countsOf, inspectionOf, isEnded, makeHistory, makeJob, pageOf } from './jobs.mjs';
import { makeCube, makePart } from './part.mjs';
import { acceptWebSocket } from './websocket.mjs';

const DIST = fileURLToPath(new URL('../dist/', import.meta.url));
const TYPES = { '.html': 'text/html; charset=utf-8', '.js': 'text/javascript', '.css': 'text/css', '.svg': 'image/svg+xml' };
const POLICY = "default-src 'self'; img-src 'self' blob: data:; connect-src 'self'; object-src 'none'; base-uri 'none'; frame-ancestors 'none'";
const TICK_MS = 100;
const ESTIMATED_S = 4804;
const FIRST_PAGE = { waiting: 100, ended: 50 };
const IDLE_TIMEOUT_S = 600;

const part = makePart();
const job = (...known) => makeJob(part, ESTIMATED_S, ...known);

/** Half a Gaussian in powers of two, with a thin tail. */
function lateness(count) {
  const weights = [0.02, 0.11, 0.31, 0.33, 0.16, 0.05, 0.015, 0.004, 0.0008, 0.00012, 0.00002];
  return weights.map((w, i) => [2 ** (i + 4) - 1, Math.floor(w * count)]).filter(([, n]) => n > 0);
}

const BEGAN = Date.now();

/** As of now: loop 1 uses a fifth of its core, and was late as often as the printer says. */
function held({ late, factor }) {
  const since_us = (Date.now() - BEGAN) * 1000;
  const periods = (period_us) => ({ releases: Math.floor(since_us / period_us), overruns: 0, dropped: 0, missed: 0, worst_late_us: 0 });
  const used = (share) => ({ cpu_used_us: Math.floor(since_us * share), watched_us: since_us, held_from_outside: 0, escape: '' });
  const kept = { priority_enforced: true, budget_enforced: true };
  return {
    board: 'linux', simulated: factor !== 1, memory_locked: true,
    loops: [
      { id: 1, core: 0, budget_us: 30000, period_us: 100000, ...kept, core_owned: false, shortfall: '', ...used(0.2), ...periods(100000), overruns: late, worst_late_us: late ? 4200 : 0 },
      { id: 2, core: 1, budget_us: 100, period_us: 100, ...kept, core_owned: true, shortfall: 'the timer tick stays on core 1: boot with nohz_full=1',
        cpu_used_us: null, watched_us: null, held_from_outside: 0, escape: '', releases: 1, overruns: 0, dropped: 0, missed: 0, worst_late_us: 0 },
      { id: 3, core: 0, budget_us: 1000, period_us: 8000, ...kept, core_owned: false, shortfall: '', ...used(0.021), ...periods(8000) },
    ],
    cores: [
      { core: 0, interrupts_per_second: 312, worst_gap_us: null, counted_per_second: 470, tick_stopped: false, throttling_lifted: false, note: '' },
      { core: 1, interrupts_per_second: 251, worst_gap_us: 21.4, counted_per_second: null, tick_stopped: false, throttling_lifted: true, note: '' },
    ],
    bottom_halves: [], delays: [],
    trees: [],
    chains: [
      { name: 'thermistors to heaters', way: 'thermistors > loop 3 > heaters', reaction_bound_us: 15600, reaction_limit_us: 16000, age_bound_us: 7600, age_limit_us: 8000,
        reactions: Math.floor(since_us / 8000), worst_reaction_us: late ? 17000 : 8520, worst_age_us: 640, from_first_loop: false },
      { name: 'emergency byte to pins', way: 'uart > io 35 > loop 2 > heaters and motors', reaction_bound_us: 32400, reaction_limit_us: 40000, age_bound_us: null, age_limit_us: null,
        reactions: 0, worst_reaction_us: null, worst_age_us: null, from_first_loop: true },
    ],
    service: {
      name: 'print service', core: 0, budget_us: 10000, period_us: 100000, admitted: true, response_us: 46000, enforced: true, shortfall: '',
      enforced_by: 'cgroup v2', used_us: 812000, lasted_us: 30e6, used_share: 0.024, periods: 290, throttled: 3, throttled_us: 40000,
    },
  };
}

class Printer {
  constructor(scene) {
    this.state = 'idle';
    this.fault = null;
    this.stuck = null; // why the fault cannot be cleared
    this.executed = 0;
    this.elapsed = 0;
    this.gate = { held: false, reason: null, bed_occupied: false, confirm_bed: true };
    this.hotEnd = { c: 24.3, target_c: 0, duty: 0, fault: '', reading: true };
    this.bed = { c: 23.1, target_c: 0, duty: 0, fault: '', reading: true };
    this.fan = 0;
    this.place = [0, 0, 0];
    this.homed = [true, true, true];
    this.idle = { off_in_s: null, timed_out: false, timeout_s: IDLE_TIMEOUT_S };
    this.factor = 1;
    this.late = 0; // releases of loop 1
    this.parked = false;
    this.part = part;
    this.jobs = [];
    this.nextId = 1;
    this.subscribers = new Set();
    this.muted = false;
    this.stage(scene);
  }

  add(name, state, more) {
    this.jobs.push(job(this.nextId++, name, state, more));
    return this.jobs[this.jobs.length - 1];
  }

  heat(hot_end_c, bed_c) {
    Object.assign(this.hotEnd, { c: hot_end_c, target_c: hot_end_c, duty: 0.38 });
    Object.assign(this.bed, { c: bed_c, target_c: bed_c, duty: 0.22 });
  }

  stage(scene) {
    const small = {
      idle: () => {}, empty: () => {},
      finished: () => this.stageFinished(),
      queue30: () => this.stageQueue(),
      disconnected: () => { this.state = 'disconnected'; },
      unhomed: () => { this.homed = [false, false, false]; },
      cube20: () => this.showCube(20), cube140: () => this.showCube(140), 'cube140-dense': () => this.showCube(140, 70),
      many: () => this.stageMany(),
      'idle-warning': () => { this.heat(209, 60); this.idle.off_in_s = 105; },
      'idle-hint': () => { this.heat(209, 60); this.idle.off_in_s = 430; },
      'idle-off': () => { this.idle.timed_out = true; },
      'idle-never': () => { this.heat(209, 0); this.idle.timeout_s = 0; },
      bed: () => this.stageBed(),
      'no-confirm': () => { this.stageBed(); Object.assign(this.gate, { bed_occupied: false, confirm_bed: false }); },
    }[scene];
    if (small) return small();
    this.stagePrint();
    if (scene === 'heating') this.stageHeating();
    if (scene === 'paused') Object.assign(this, { state: 'paused', parked: true });
    if (scene === 'paused-off') Object.assign(this, { state: 'paused', parked: true, idle: { ...this.idle, timed_out: true } });
    if (scene === 'simulated') this.factor = 20;
    if (scene === 'faulted' || scene === 'stuck-fault' || scene === 'held') this.stageFailure(scene);
  }

  /** The first minute of a print. */
  stageHeating() {
    Object.assign(this, { executed: 0, elapsed: 40, activity: 'heating_hot_end', place: [0, 150, 20, 0] });
    this.hotEnd.c = 143;
  }

  stageFinished() {
    this.add('lobed-vase.gcode', 'done', { started: '2026-11-21T05:10:00Z', ended: '2026-11-21T06:35:20Z', printed_s: 5120, copies_done: 1 });
    this.hotEnd.c = 143;
    this.gate.bed_occupied = true;
  }

  stageQueue() {
    this.stagePrint();
    const names = ['bracket-right', 'knob', 'hinge', 'cable-clip', 'spacer'];
    const ended = this.jobs.findIndex(isEnded);
    const fresh = Array.from({ length: 27 }, (_, i) => job(this.nextId++, `${names[i % names.length]}-${String(i + 1).padStart(2, '0')}.gcode`, 'queued'));
    this.jobs.splice(ended, 0, ...fresh);
  }

  stagePrint() {
    this.add('3DBenchy.gcode', 'printing', { started: new Date().toISOString() });
    this.add('lobed-vase.gcode', 'queued', { copies: 3, copies_done: 1 });
    this.add('bracket-left-with-a-rather-long-name_0.2mm_PLA.gcode', 'queued');
    this.add('bracket-right.gcode', 'held');
    this.add('cable-clip.gcode', 'queued');
    this.jobs[1].facts.warnings.push({ line: 14, message: 'M900 is answered, but pressure advance is set in the machine file.' });
    this.add('calibration-cube.gcode', 'done', { started: '2026-11-21T05:10:00Z', ended: '2026-11-21T05:43:20Z', printed_s: 2000 });
    this.add('hook.gcode', 'cancelled', { ended: '2026-11-21T05:00:00Z', stopped_line: 812, stopped_layer: 14, stopped_byte: 27_608 });
    this.executed = part.size * 0.52;
    this.elapsed = ESTIMATED_S * 0.53;
    this.heat(209, 60);
    this.fan = 1;
    this.state = 'printing';
  }

  stageFailure(scene) {
    const reason = scene === 'stuck-fault' ? 'hot end: the sensor gives no reading' : 'hot end: not heating as it should, 2.0 °C expected in 20 s, 0.4 °C seen';
    Object.assign(this.jobs[0], { state: 'failed', error: reason, ended: new Date().toISOString(), ...this.stop() });
    const failed = this.jobs.shift();
    this.jobs.splice(this.jobs.findIndex(isEnded), 0, failed);
    this.gate = { ...this.gate, held: true, reason: `job 1 "3DBenchy.gcode" failed: ${reason}`, bed_occupied: scene === 'held' };
    this.state = scene === 'held' ? 'idle' : 'faulted';
    this.fault = scene === 'held' ? null : reason;
    this.fan = this.hotEnd.target_c = this.bed.target_c = 0;
    if (scene === 'stuck-fault') {
      this.stuck = reason;
      this.hotEnd.reading = false;
    }
  }

  stageBed() {
    this.add('hinge.gcode', 'queued');
    this.add('calibration-cube.gcode', 'done', { started: '2026-11-21T05:10:00Z', ended: '2026-11-21T05:43:20Z' });
    this.gate.bed_occupied = true;
  }

  stageMany() {
    this.jobs = makeHistory(100_000, job);
    this.nextId = 100_001;
    this.stagePrint();
    const fresh = this.jobs.splice(100_000).filter((each) => !isEnded(each));
    for (let i = 0; i < 150; i++) fresh.push(job(this.nextId++, `waiting-${i}.gcode`, 'queued'));
    this.jobs = [...fresh, ...this.jobs];
  }

  /** A finished cube of `edge` millimetres; `step`: its lines in pieces of that length. */
  showCube(edge, step) {
    this.part = makeCube(edge, step);
    const { facts } = this.add(`cube-${edge}.gcode`, 'done');
    Object.assign(facts, { layers: this.part.layers.length, min_mm: this.part.min_mm, max_mm: this.part.max_mm });
  }

  get running() { return this.jobs.find((each) => each.state === 'printing' || each.state === 'paused') ?? null; }

  stop() { return { stopped_line: Math.round(this.executed / 34), stopped_layer: (part.at(this.executed)[3] ?? 0) + 1, stopped_byte: Math.round(this.executed), printed_s: Math.round(this.elapsed) }; }

  tick(seconds) {
    for (const heater of [this.hotEnd, this.bed]) {
      const to = heater.target_c > 0 ? heater.target_c : 23;
      heater.c += (to - heater.c) * Math.min(1, seconds / (heater.target_c > 0 ? 6 : 60)) + (Math.random() - 0.5) * 0.12;
      heater.duty = heater.target_c > 0 ? 0.35 : 0;
    }
    if (this.idle.off_in_s !== null) this.idle.off_in_s = Math.max(0, this.idle.off_in_s - seconds);
    if (this.idle.off_in_s === 0) {
      Object.assign(this.idle, { off_in_s: null, timed_out: true });
      this.hotEnd.target_c = this.bed.target_c = 0;
    }
    const running = this.running;
    if (!running) {
      if (this.state === 'idle' && !this.gate.held && !this.gate.bed_occupied) this.startNext();
      return;
    }
    if (this.state !== 'printing' || this.activity) return;
    this.executed = Math.min(running.size, this.executed + (seconds * this.factor * running.size) / ESTIMATED_S);
    this.elapsed += seconds * this.factor;
    this.place = part.at(this.executed);
    if (this.executed >= running.size) this.finish('done');
  }

  startNext() {
    const next = this.jobs.find((job) => job.state === 'queued');
    if (!next) return;
    next.state = 'printing';
    next.started = new Date().toISOString();
    this.jobs = [next, ...this.jobs.filter((job) => job !== next)];
    this.executed = this.elapsed = 0;
    this.hotEnd.target_c = 209;
    this.state = 'printing';
    this.changed();
  }

  finish(state, error = null) {
    const ended = this.running;
    Object.assign(ended, { state, error, ended: new Date().toISOString(), copies_done: ended.copies_done + (state === 'done' ? 1 : 0) });
    if (state !== 'done') Object.assign(ended, this.stop());
    this.jobs = [...this.jobs.filter((each) => !isEnded(each) && each !== ended), ended, ...this.jobs.filter((each) => isEnded(each) && each !== ended)];
    this.state = 'idle';
    this.parked = false;
    this.hotEnd.target_c = 0;
    if (this.gate.confirm_bed) this.gate.bed_occupied = true;
    this.changed();
  }

  status() {
    const [x, y, z, layer] = this.place;
    const count = Math.round(1_900_000 * (this.elapsed / ESTIMATED_S));
    const hot = this.state !== 'disconnected';
    return {
      connected: hot, session: hot ? '9f31c0ffee0199aa' : null, state: this.state, activity: this.activity ?? null, job: this.running?.id ?? null, fault: this.fault,
      message: '', position_mm: { x, y, z, e: 0 }, homed: this.homed, hot_end: this.hotEnd, bed: this.bed,
      fan: this.fan, feed_factor: 1, flow_factor: 1, layer: this.executed > 0 ? (layer ?? 0) + 1 : 0, line: Math.round(this.executed / 34),
      idle_off_in_s: this.idle.off_in_s, idle_timed_out: this.idle.timed_out, idle_timeout_s: this.idle.timeout_s, time_factor: this.factor,
      parked: this.parked, may_jog: this.state === 'idle' || this.parked,
      bytes_executed: Math.round(this.executed), bytes_accepted: Math.round(this.executed) + 4000, print_time_s: this.elapsed,
      progress: this.progress(), ready_in_s: this.ready(),
      timing: {
        late_steps: count > 0 ? 37 : 0, shift_ns: count > 0 ? 61_250 : 0, starved: 0, ring_fill: 51234, pulses: [count, count, 0, 0],
        lateness_ns: { p50: count ? 71 : 0, p99: count ? 402 : 0, p9999: count ? 2310 : 0, max: count ? 14_320 : 0, count, buckets: lateness(count) },
      },
    };
  }

  progress() {
    const { running, executed, elapsed } = this;
    if (!running) return null;
    const remaining_s = ESTIMATED_S * (1 - executed / running.size);
    return { bytes: Math.round(executed), fraction: elapsed / (elapsed + remaining_s), elapsed_s: elapsed, remaining_s };
  }

  /** Seconds until each waiting job is done; none while the queue does not go on by itself. */
  ready() {
    if (this.gate.held || this.gate.bed_occupied || ['faulted', 'disconnected'].includes(this.state)) return {};
    const ready = {};
    let at = this.progress()?.remaining_s ?? 0;
    for (const each of this.jobs.filter(({ state }) => state === 'queued').slice(0, FIRST_PAGE.waiting)) {
      at += each.facts.estimated_s * (each.copies - each.copies_done);
      ready[each.id] = Math.round(at);
    }
    return ready;
  }

  /** One page of the jobs; the first one, when nothing is asked for. */
  page({ limit = FIRST_PAGE.ended, before = null, states = [], text = '' } = {}) {
    let position = 0;
    const running = this.running;
    for (const each of this.jobs) each.position = each.state === 'queued' || each.state === 'held' ? ++position : null;
    if (running) {
      running.state = this.state === 'paused' ? 'paused' : 'printing';
      running.progress = this.progress();
    }
    return { ...pageOf(this.jobs, { limit, before, states, text }, FIRST_PAGE), counts: countsOf(this.jobs), queue: this.gate };
  }

  jobsMessage() { return { type: 'jobs', ...this.page() }; }

  history() {
    const samples = { t_s: [], hot_end_c: [], hot_end_target_c: [], bed_c: [], bed_target_c: [] };
    const now = Math.floor(Date.now() / 1000);
    for (let age = 599; age >= 0; age--) {
      const on = this.hotEnd.target_c > 0 && age < 480;
      const since = 480 - age;
      samples.t_s.push(now - age);
      samples.hot_end_c.push(on ? 209 - 185 * Math.exp(-since / 38) + Math.sin(since / 5) * 0.5 : 24 + Math.sin(age / 30) * 0.2);
      samples.hot_end_target_c.push(on ? 209 : 0);
      samples.bed_c.push(on ? 60 - 37 * Math.exp(-since / 70) : 23);
      samples.bed_target_c.push(on ? 60 : 0);
    }
    return { type: 'history', ...samples };
  }

  send(message) { if (!this.muted) for (const each of this.subscribers) each.send(JSON.stringify(message)); }
  changed() { this.send(this.jobsMessage()); }
}

// ---- HTTP ---------------------------------------------------------------------------------------

const fail = (status, message, line) => ({ status, body: { error: { code: 'mock', message, ...(line ? { line } : {}) } } });
const accepted = { status: 202, body: {} };

const refuse = (printer, name) => fail(409, `${name} does not apply while the machine is ${printer.state}`);

/** What a person may ask of the machine: each answers with an error, or with nothing. */
const COMMANDS = {
  pause: (printer) => (printer.state === 'printing' ? void Object.assign(printer, { state: 'paused', parked: true }) : refuse(printer, 'pause')),
  resume: (printer) => (printer.state === 'paused' ? void Object.assign(printer, { state: 'printing', parked: false }) : refuse(printer, 'resume')),
  cancel: (printer) => (printer.running ? printer.finish('cancelled') : refuse(printer, 'cancel')),
  'emergency-stop': (printer) => {
    if (printer.running) printer.finish('failed', 'emergency stop');
    Object.assign(printer, { state: 'faulted', fault: 'emergency stop' });
    printer.gate = { ...printer.gate, held: true, reason: 'job failed: emergency stop' };
  },
  'clear-fault': (printer) => (printer.stuck ? fail(409, `the fault is still there: ${printer.stuck}`)
    : printer.state === 'faulted' ? void Object.assign(printer, { state: 'idle', fault: null }) : refuse(printer, 'clear-fault')),
  'bed-cleared': (printer) => { printer.gate.bed_occupied = false; },
  temperature: (printer, { hot_end_c, bed_c }) => {
    if ((hot_end_c ?? 0) > 260) return fail(422, 'hot_end_c must be 0 to 260');
    // As the printer does: a print that loses its heat is paused, and not lost.
    if (hot_end_c === 0 && printer.state === 'printing') Object.assign(printer, { state: 'paused', parked: true });
    if (hot_end_c !== undefined) printer.hotEnd.target_c = hot_end_c;
    if (bed_c !== undefined) printer.bed.target_c = bed_c;
    if (printer.idle.off_in_s !== null) printer.idle.off_in_s = printer.idle.timeout_s;
    printer.idle.timed_out = false;
  },
  fan: (printer, { duty }) => { printer.fan = duty; },
  gcode: (printer, { line }) => {
    const text = line === 'M105' ? `T:${printer.hotEnd.c.toFixed(1)} /${printer.hotEnd.target_c} B:${printer.bed.c.toFixed(1)} /${printer.bed.target_c}` : `unknown command: <b>${line}</b>`;
    setTimeout(() => printer.send({ type: 'reply', kind: line === 'M105' ? 'text' : 'warning', text }), 40);
  },
  home: (printer, { axes }) => {
    if (printer.state !== 'idle') return refuse(printer, 'home');
    printer.homed = printer.homed.map((known, i) => known || axes.includes('xyz'[i]));
  },
  jog: (printer) => (printer.state === 'idle' || printer.parked ? undefined : refuse(printer, 'jog')),
};

function command(printer, name, body) {
  if (!Object.hasOwn(COMMANDS, name)) return fail(404, 'there is nothing of this name');
  const refused = COMMANDS[name](printer, body);
  printer.changed();
  return refused ?? accepted;
}

function patch(printer, which, body) {
  if (body.copies !== undefined && !(body.copies >= 1 && body.copies <= 1000)) return fail(400, 'copies must be 1 to 1000');
  for (const name of ['copies', 'priority']) if (body[name] !== undefined) which[name] = body[name];
  if (body.hold !== undefined) Object.assign(which, { hold: body.hold, state: body.hold ? 'held' : 'queued' });
  if (body.before !== undefined) {
    const rest = printer.jobs.filter((each) => each !== which);
    const at = body.before === null
      ? rest.findLastIndex((each) => ['queued', 'held', 'printing', 'paused'].includes(each.state)) + 1
      : rest.findIndex((each) => each.id === body.before);
    rest.splice(at, 0, which);
    printer.jobs = rest;
  }
  printer.changed();
  return { status: 200, body: which };
}

function addJob(printer, bytes) {
  const text = bytes.toString('latin1');
  const name = /filename="([^"]*)"/.exec(text)?.[1] ?? 'part.gcode';
  if (/M10[49] S999/.test(text)) return fail(422, 'the hot end would be heated to 999 °C, the machine allows 260. Lower the temperature in the slicer.', 2);
  const added = job(printer.nextId++, name, /name="print"\r\n\r\nfalse/.test(text) ? 'held' : 'queued');
  const at = printer.jobs.findIndex(isEnded);
  printer.jobs.splice(at < 0 ? printer.jobs.length : at, 0, added);
  printer.changed();
  return { status: 201, body: added };
}

const THUMBNAIL = Buffer.from('<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 8 8"><rect width="8" height="8" fill="#c96"/></svg>');

function jobRequest(printer, method, [id, verb, range], body) {
  const which = printer.jobs.find((each) => each.id === Number(id));
  if (!which) return fail(404, 'there is no job with this number');
  if (verb === 'layers' && range) {
    const [first, last] = range.split('-').map(Number);
    return { status: 200, bytes: Buffer.concat(printer.part.layers.slice(first, last + 1).map((layer) => layer.buffer)) };
  }
  if (verb === 'layers') return { status: 200, body: { layers: printer.part.layers.map(({ buffer, ...index }) => index) } };
  if (verb === 'thumbnail') return { status: 200, bytes: THUMBNAIL, headers: { 'Content-Type': 'image/svg+xml' } };
  if (verb === 'inspection') {
    if (which.state !== 'done' || which === printer.uninspected) return fail(404, 'there is no report on this job');
    return { status: 200, body: inspectionOf() };
  }
  if (verb === 'start') {
    if (which.state === 'held') return patch(printer, which, { hold: false });
    printer.jobs = printer.jobs.filter((each) => each !== which);
    printer.jobs.splice(printer.running ? 1 : 0, 0, job(printer.nextId++, which.name, 'queued'));
    printer.changed();
    return { status: 200, body: which };
  }
  if (method === 'DELETE') {
    if (which === printer.running) return fail(409, 'the job is being printed');
    printer.jobs = printer.jobs.filter((each) => each !== which);
    printer.changed();
    return { status: 204 };
  }
  return method === 'PATCH' ? patch(printer, which, body) : { status: 200, body: which };
}

function listed(printer, query) {
  const before = query.get('before');
  return { status: 200, body: printer.page({
    limit: Number(query.get('limit') ?? 100), before: before === null ? null : Number(before),
    states: (query.get('state') ?? '').split(',').filter(Boolean), text: query.get('q') ?? '',
  }) };
}

function api(printer, key, request, path, bytes) {
  const json = () => JSON.parse(bytes.toString() || '{}');
  const [what, ...rest] = path.split('/');
  if (what === 'session') {
    if (json().key !== key) return fail(401, 'this key is not known');
    return { status: 204, headers: { 'Set-Cookie': 'session=1; HttpOnly; SameSite=Strict; Path=/' } };
  }
  if (!/session=1/.test(request.headers.cookie ?? '')) return fail(401, 'a key is needed');
  if (what === 'jobs' && rest.length === 0) return request.method === 'POST' ? addJob(printer, bytes) : listed(printer, new URL(request.url, 'http://mock').searchParams);
  if (what === 'jobs') return jobRequest(printer, request.method, rest, request.method === 'PATCH' ? json() : null);
  if (what === 'queue') {
    printer.gate = { ...printer.gate, held: rest[0] === 'hold', reason: rest[0] === 'hold' ? 'held by a person' : null };
    printer.changed();
    return accepted;
  }
  if (what === 'guarantee') return { status: 200, body: held(printer) };
  if (what === 'config') {
    const axis = (max) => ({ steps_per_mm: 80, max_speed_mm_s: 125, min_mm: 0, max_mm: max });
    return { status: 200, body: { name: 'Printrbot Simple Metal', axes: { x: axis(150), y: axis(150), z: axis(150) }, hot_end: { max_c: 260, min_extrude_c: 170 }, bed: { present: true, max_c: 110 } } };
  }
  if (what === 'machine') return rest.length === 0 ? { status: 200, body: printer.status() } : command(printer, rest[0], json());
  return fail(404, 'there is nothing of this name');
}

async function staticFile(path) {
  const name = normalize(path === '/' ? '/index.html' : path);
  try {
    return { status: 200, bytes: await readFile(join(DIST, name)), headers: { 'Content-Type': TYPES[extname(name)] ?? 'application/octet-stream' } };
  } catch {
    return fail(404, 'there is no such page');
  }
}

async function answer(printer, key, request, response) {
  const chunks = [];
  for await (const chunk of request) chunks.push(chunk);
  const path = new URL(request.url, 'http://mock').pathname;
  const found = path.startsWith('/api/v1/')
    ? api(printer, key, request, path.slice(8), Buffer.concat(chunks)) : await staticFile(path);
  response.writeHead(found.status, {
    'Content-Type': found.bytes ? 'application/octet-stream' : 'application/json', 'Content-Security-Policy': POLICY, ...found.headers,
  });
  response.end(found.bytes ?? (found.body === undefined ? '' : JSON.stringify(found.body)));
}

/**
 * Starts a mock; returns {address, printer, mute(on), close()}. Port 0: any free one. While it is
 * muted it keeps its connections, and neither answers nor sends: a service that stands still, or a
 * proxy that swallows.
 */
export async function startMock({ port = 0, scene = 'idle', key = 'mock' } = {}) {
  const printer = new Printer(scene);
  const server = createServer((request, response) => {
    if (printer.muted) return;
    answer(printer, key, request, response).catch((error) => response.writeHead(500).end(JSON.stringify(fail(500, String(error)).body)));
  });
  server.on('upgrade', (request, socket) => {
    if (printer.muted) return;
    const live = acceptWebSocket(request, socket, () => printer.subscribers.delete(live));
    live.send(JSON.stringify({ type: 'status', status: printer.status() }));
    live.send(JSON.stringify(printer.jobsMessage()));
    live.send(JSON.stringify(printer.history()));
    printer.subscribers.add(live);
  });
  const timer = setInterval(() => {
    printer.tick(TICK_MS / 1000);
    printer.send({ type: 'status', status: printer.status() });
  }, TICK_MS);
  await new Promise((resolve) => server.listen(port, '127.0.0.1', resolve));
  const close = () => {
    clearInterval(timer);
    printer.subscribers.forEach((each) => each.close());
    server.close();
    server.closeAllConnections();
  };
  return { address: `http://127.0.0.1:${server.address().port}/#key=${key}`, printer, mute: (on) => { printer.muted = on; }, close };
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const option = (name, otherwise) => {
    const at = process.argv.indexOf(`--${name}`);
    return at < 0 ? otherwise : process.argv[at + 1];
  };
  const mock = await startMock({ port: Number(option('port', 8090)), scene: option('scene', 'printing'), key: option('key', 'mock') });
  console.log(`Open ${mock.address}`);
}
