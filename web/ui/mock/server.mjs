// A printer without a printer: serves the built page and the interface of docs/api.md with a simulated print, so that
// the page can be worked on and looked at without the service. Plain node, no dependencies.
//
//   node mock/server.mjs [--port 8090] [--scene idle|printing|paused|faulted|disconnected|held] [--key KEY]
//
// It is a stage set, not a reference: what the page must really agree with is printd, in tests/e2e/browser.
import { createServer } from 'node:http';
import { readFile } from 'node:fs/promises';
import { extname, join, normalize } from 'node:path';
import { fileURLToPath } from 'node:url';
import { makePart } from './part.mjs';
import { acceptWebSocket } from './websocket.mjs';

const DIST = fileURLToPath(new URL('../dist/', import.meta.url));
const TYPES = { '.html': 'text/html; charset=utf-8', '.js': 'text/javascript', '.css': 'text/css', '.svg': 'image/svg+xml' };
const POLICY = "default-src 'self'; img-src 'self' blob: data:; connect-src 'self'; object-src 'none'; base-uri 'none'; frame-ancestors 'none'";
const TICK_MS = 100;
const ESTIMATED_S = 4804;

const part = makePart();

function makeJob(id, name, state, more = {}) {
  return {
    id, name, size: part.size, sha256: '0'.repeat(64), state, hold: state === 'held', copies: 1, copies_done: 0, priority: 0,
    position: null, created: '2026-11-21T06:00:00Z', started: null, ended: null, error: null,
    facts: {
      estimated_s: ESTIMATED_S, filament_mm: 3918.2, layers: part.layers.length, min_mm: [40, 40, 0.3], max_mm: [110, 110, 36],
      hot_end_c: 209, bed_c: 60, slicer: 'PrusaSlicer 2.5.0', thumbnail: false, warnings: [],
    },
    progress: { bytes: 0, fraction: 0, elapsed_s: 0, remaining_s: null }, ...more,
  };
}

/** Half a Gaussian in powers of two, with a thin tail. */
function lateness(count) {
  const weights = [0.02, 0.11, 0.31, 0.33, 0.16, 0.05, 0.015, 0.004, 0.0008, 0.00012, 0.00002];
  return weights.map((w, i) => [2 ** (i + 4) - 1, Math.floor(w * count)]).filter(([, n]) => n > 0);
}

const HELD = {
  board: 'linux', simulated: false, memory_locked: true,
  loops: [
    { id: 1, core: 0, budget_us: 30000, period_us: 100000, priority_enforced: true, budget_enforced: true, core_owned: false, shortfall: '' },
    { id: 2, core: 1, budget_us: 100, period_us: 100, priority_enforced: true, budget_enforced: true, core_owned: true,
      shortfall: 'the timer tick stays on core 1: boot with nohz_full=1' },
    { id: 3, core: 0, budget_us: 1000, period_us: 8000, priority_enforced: true, budget_enforced: true, core_owned: false, shortfall: '' },
  ],
  cores: [
    { core: 0, interrupts_per_second: 312, worst_gap_us: null, tick_stopped: false, throttling_lifted: false, note: '' },
    { core: 1, interrupts_per_second: 251, worst_gap_us: 21.4, tick_stopped: false, throttling_lifted: true, note: '' },
  ],
};

class Printer {
  constructor(scene) {
    this.state = 'idle';
    this.fault = null;
    this.executed = 0;
    this.elapsed = 0;
    this.gate = { held: false, reason: null, bed_occupied: false };
    this.hotEnd = { c: 24.3, target_c: 0, duty: 0, fault: '' };
    this.bed = { c: 23.1, target_c: 0, duty: 0, fault: '' };
    this.fan = 0;
    this.place = [0, 0, 0];
    this.jobs = [];
    this.nextId = 1;
    this.subscribers = new Set();
    this.stage(scene);
  }

  stage(scene) {
    if (scene === 'idle' || scene === 'empty') return;
    if (scene === 'disconnected') { this.state = 'disconnected'; return; }
    const add = (name, state, more) => this.jobs.push(makeJob(this.nextId++, name, state, more));
    add('3DBenchy.gcode', 'printing', { started: new Date().toISOString() });
    add('lobed-vase.gcode', 'queued', { copies: 3, copies_done: 1 });
    add('bracket-left-with-a-rather-long-name_0.2mm_PLA.gcode', 'queued');
    add('bracket-right.gcode', 'held');
    add('cable-clip.gcode', 'queued');
    this.jobs[1].facts.warnings.push({ line: 14, message: 'M900 is answered, but pressure advance is set in the machine file.' });
    add('calibration-cube.gcode', 'done', { started: '2026-11-21T05:10:00Z', ended: '2026-11-21T05:43:20Z' });
    add('hook.gcode', 'cancelled', { ended: '2026-11-21T05:00:00Z' });
    this.executed = part.size * 0.52;
    this.elapsed = ESTIMATED_S * 0.53;
    Object.assign(this.hotEnd, { c: 209, target_c: 209, duty: 0.38 });
    Object.assign(this.bed, { c: 60, target_c: 60, duty: 0.22 });
    this.fan = 1;
    this.state = scene === 'paused' ? 'paused' : 'printing';
    if (scene === 'faulted' || scene === 'held') {
      const reason = 'hot end: not heating as it should, 2.0 °C expected in 20 s, 0.4 °C seen';
      Object.assign(this.jobs[0], { state: 'failed', error: reason, ended: new Date().toISOString() });
      this.jobs.push(this.jobs.shift());
      this.gate = { held: true, reason: `job 1 "3DBenchy.gcode" failed: ${reason}`, bed_occupied: scene === 'held' };
      this.state = scene === 'held' ? 'idle' : 'faulted';
      this.fault = scene === 'held' ? null : reason;
      this.fan = this.hotEnd.target_c = this.bed.target_c = 0;
    }
  }

  get running() { return this.jobs.find((job) => job.state === 'printing' || job.state === 'paused') ?? null; }

  tick(seconds) {
    for (const heater of [this.hotEnd, this.bed]) {
      const to = heater.target_c > 0 ? heater.target_c : 23;
      heater.c += (to - heater.c) * Math.min(1, seconds / (heater.target_c > 0 ? 6 : 60)) + (Math.random() - 0.5) * 0.12;
      heater.duty = heater.target_c > 0 ? 0.35 : 0;
    }
    const job = this.running;
    if (!job) {
      if (this.state === 'idle' && !this.gate.held && !this.gate.bed_occupied) this.startNext();
      return;
    }
    if (this.state !== 'printing') return;
    this.executed = Math.min(job.size, this.executed + (seconds * job.size) / ESTIMATED_S);
    this.elapsed += seconds;
    this.place = part.at(this.executed);
    if (this.executed >= job.size) this.finish('done');
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

  finish(state) {
    const job = this.running;
    Object.assign(job, { state, ended: new Date().toISOString(), copies_done: job.copies_done + (state === 'done' ? 1 : 0) });
    const ended = (j) => ['done', 'cancelled', 'failed'].includes(j.state);
    this.jobs = [...this.jobs.filter((j) => !ended(j)), job, ...this.jobs.filter((j) => ended(j) && j !== job)];
    this.state = 'idle';
    this.hotEnd.target_c = 0;
    this.changed();
  }

  status() {
    const [x, y, z, layer] = this.place;
    const count = Math.round(1_900_000 * (this.elapsed / ESTIMATED_S));
    const hot = this.state !== 'disconnected';
    return {
      connected: hot, session: hot ? '9f31c0ffee0199aa' : null, state: this.state, job: this.running?.id ?? null, fault: this.fault,
      message: '', position_mm: { x, y, z, e: 0 }, homed: [true, true, this.running !== null], hot_end: this.hotEnd, bed: this.bed,
      fan: this.fan, feed_factor: 1, flow_factor: 1, layer: layer ?? 0, line: Math.round(this.executed / 34),
      bytes_executed: Math.round(this.executed), bytes_accepted: Math.round(this.executed) + 4000, print_time_s: this.elapsed,
      timing: {
        late_steps: count > 0 ? 37 : 0, shift_ns: count > 0 ? 61_250 : 0, starved: 0, ring_fill: 51234, pulses: [count, count, 0, 0],
        lateness_ns: { p50: count ? 71 : 0, p99: count ? 402 : 0, p9999: count ? 2310 : 0, max: count ? 14_320 : 0, count, buckets: lateness(count) },
      },
    };
  }

  jobsMessage() {
    let position = 0;
    const job = this.running;
    for (const each of this.jobs) {
      each.position = each.state === 'queued' || each.state === 'held' ? ++position : null;
      if (each === job) {
        each.state = this.state === 'paused' ? 'paused' : 'printing';
        each.progress = { bytes: Math.round(this.executed), fraction: this.executed / each.size, elapsed_s: this.elapsed, remaining_s: ESTIMATED_S - this.elapsed };
      }
    }
    return { type: 'jobs', jobs: this.jobs, queue: this.gate };
  }

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

  send(message) { for (const each of this.subscribers) each.send(JSON.stringify(message)); }
  changed() { this.send(this.jobsMessage()); }
}

// ---- HTTP ------------------------------------------------------------------------------------------------------

const fail = (status, message, line) => ({ status, body: { error: { code: 'mock', message, ...(line ? { line } : {}) } } });
const accepted = { status: 202, body: {} };

function command(printer, name, body) {
  if (name === 'pause' && printer.state === 'printing') printer.state = 'paused';
  else if (name === 'resume' && printer.state === 'paused') printer.state = 'printing';
  else if (name === 'cancel' && printer.running) printer.finish('cancelled');
  else if (name === 'emergency-stop') {
    if (printer.running) printer.finish('failed');
    Object.assign(printer, { state: 'faulted', fault: 'emergency stop' });
    printer.gate = { held: true, reason: 'job failed: emergency stop', bed_occupied: false };
  } else if (name === 'clear-fault' && printer.state === 'faulted') Object.assign(printer, { state: 'idle', fault: null });
  else if (name === 'bed-cleared') printer.gate.bed_occupied = false;
  else if (name === 'temperature') {
    if ((body.hot_end_c ?? 0) > 260) return fail(422, 'hot_end_c must be 0 to 260');
    if (body.hot_end_c !== undefined) printer.hotEnd.target_c = body.hot_end_c;
    if (body.bed_c !== undefined) printer.bed.target_c = body.bed_c;
  } else if (name === 'fan') printer.fan = body.duty;
  else if (name === 'gcode') {
    const text = body.line === 'M105' ? `T:${printer.hotEnd.c.toFixed(1)} /${printer.hotEnd.target_c} B:${printer.bed.c.toFixed(1)} /${printer.bed.target_c}` : `unknown command: <b>${body.line}</b>`;
    setTimeout(() => printer.send({ type: 'reply', kind: body.line === 'M105' ? 'text' : 'warning', text }), 40);
  } else if (name !== 'home' && name !== 'jog') return fail(409, `${name} does not apply while the machine is ${printer.state}`);
  printer.changed();
  return accepted;
}

function patch(printer, job, body) {
  for (const name of ['copies', 'priority']) if (body[name] !== undefined) job[name] = body[name];
  if (body.hold !== undefined) Object.assign(job, { hold: body.hold, state: body.hold ? 'held' : 'queued' });
  if (body.before !== undefined) {
    const rest = printer.jobs.filter((each) => each !== job);
    const at = body.before === null
      ? rest.findLastIndex((each) => ['queued', 'held', 'printing', 'paused'].includes(each.state)) + 1
      : rest.findIndex((each) => each.id === body.before);
    rest.splice(at, 0, job);
    printer.jobs = rest;
  }
  printer.changed();
  return { status: 200, body: job };
}

function addJob(printer, bytes) {
  const text = bytes.toString('latin1');
  const name = /filename="([^"]*)"/.exec(text)?.[1] ?? 'part.gcode';
  if (/M10[49] S999/.test(text)) return fail(422, 'the hot end would be heated to 999 °C, the machine allows 260. Lower the temperature in the slicer.', 2);
  const job = makeJob(printer.nextId++, name, /name="print"\r\n\r\nfalse/.test(text) ? 'held' : 'queued');
  const at = printer.jobs.findIndex((each) => ['done', 'cancelled', 'failed'].includes(each.state));
  printer.jobs.splice(at < 0 ? printer.jobs.length : at, 0, job);
  printer.changed();
  return { status: 201, body: job };
}

function jobRequest(printer, method, [id, verb, range], body) {
  const job = printer.jobs.find((each) => each.id === Number(id));
  if (!job) return fail(404, 'there is no job with this number');
  if (verb === 'layers' && range) {
    const [first, last] = range.split('-').map(Number);
    return { status: 200, bytes: Buffer.concat(part.layers.slice(first, last + 1).map((layer) => layer.buffer)) };
  }
  if (verb === 'layers') return { status: 200, body: { layers: part.layers.map(({ buffer, ...index }) => index) } };
  if (verb === 'inspection') {
    if (job.state !== 'done') return fail(404, 'there is no report on this job');
    return { status: 200, body: { completed: true, matches: true, differences: [], layer_count: 120, duration_s: 4821, lost_steps: { x: 0, y: 0, z: 0, e: 0 },
      path_deviation_mm_max: { x: 0.0063, y: 0.0062, z: 0.0003, e: 0.005 }, filament_mm: { asked: 3918.2, built: 3918.19 } } };
  }
  if (verb === 'start') {
    if (job.state === 'held') return patch(printer, job, { hold: false });
    printer.jobs = printer.jobs.filter((each) => each !== job);
    printer.jobs.splice(printer.running ? 1 : 0, 0, makeJob(printer.nextId++, job.name, 'queued'));
    printer.changed();
    return { status: 200, body: job };
  }
  if (method === 'DELETE') {
    if (job === printer.running) return fail(409, 'the job is being printed');
    printer.jobs = printer.jobs.filter((each) => each !== job);
    printer.changed();
    return { status: 204 };
  }
  return method === 'PATCH' ? patch(printer, job, body) : { status: 200, body: job };
}

function api(printer, key, request, path, bytes) {
  const json = () => JSON.parse(bytes.toString() || '{}');
  const [what, ...rest] = path.split('/');
  if (what === 'session') {
    if (json().key !== key) return fail(401, 'this key is not known');
    return { status: 204, headers: { 'Set-Cookie': 'session=1; HttpOnly; SameSite=Strict; Path=/' } };
  }
  if (!/session=1/.test(request.headers.cookie ?? '')) return fail(401, 'a key is needed');
  if (what === 'jobs' && rest.length === 0) return request.method === 'POST' ? addJob(printer, bytes) : { status: 200, body: printer.jobsMessage() };
  if (what === 'jobs') return jobRequest(printer, request.method, rest, request.method === 'PATCH' ? json() : null);
  if (what === 'queue') {
    printer.gate = { ...printer.gate, held: rest[0] === 'hold', reason: rest[0] === 'hold' ? 'held by a person' : null };
    printer.changed();
    return accepted;
  }
  if (what === 'guarantee') return { status: 200, body: HELD };
  if (what === 'config') {
    const axis = (max) => ({ steps_per_mm: 80, max_speed_mm_s: 125, min_mm: 0, max_mm: max });
    return { status: 200, body: { name: 'Mock', axes: { x: axis(150), y: axis(150), z: axis(150) }, hot_end: { max_c: 260, min_extrude_c: 170 }, bed: { present: true, max_c: 110 } } };
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

/** Starts a mock; returns {address, printer, close()}. Port 0: any free one. */
export async function startMock({ port = 0, scene = 'idle', key = 'mock' } = {}) {
  const printer = new Printer(scene);
  const server = createServer((request, response) => {
    answer(printer, key, request, response).catch((error) => response.writeHead(500).end(JSON.stringify(fail(500, String(error)).body)));
  });
  server.on('upgrade', (request, socket) => {
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
  return { address: `http://127.0.0.1:${server.address().port}/#key=${key}`, printer, close };
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const option = (name, otherwise) => {
    const at = process.argv.indexOf(`--${name}`);
    return at < 0 ? otherwise : process.argv[at + 1];
  };
  const mock = await startMock({ port: Number(option('port', 8090)), scene: option('scene', 'printing'), key: option('key', 'mock') });
  console.log(`Open ${mock.address}`);
}
