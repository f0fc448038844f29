// StandardFirmata, unchanged, answers the protocol's reference client. It runs in the simulator at
// the pace of real time, and its Serial is the client's wire. An HX711 on pins 2 and 3 is the
// witness: a clock that stays high switches it off, and its data line then reads high.
//
//   node standard_firmata.test.mjs QDUINO
//
// Both come by `npm ci` in this folder: firmata-io, and the library that node-pixel carries.
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { EventEmitter, once } from 'node:events';
import { existsSync } from 'node:fs';
import { mkdtemp, rm, writeFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';

const HERE = fileURLToPath(new URL('.', import.meta.url));
const SKETCH = join(HERE, 'node_modules/node-pixel/firmware/src/libs/firmata/arduino/examples/StandardFirmata');
if (!existsSync(SKETCH) || !existsSync(join(HERE, 'node_modules/firmata-io'))) {
  console.log('skipped: no packages (npm ci in tests/e2e/firmata)');
  process.exit(77);
}
const { Firmata } = createRequire(import.meta.url)('firmata-io');

const folder = await mkdtemp(join(tmpdir(), 'qduino-firmata-'));
await writeFile(join(folder, 'board.toml'), '[[part]]\nchip = "hx711"\ndata = 2\nclock = 3\n');
const sketch = spawn(process.argv[2], ['sim', SKETCH, '--board', join(folder, 'board.toml'), '--speed', '1', '--for', '300'],
  { cwd: folder, env: { ...process.env, XDG_CACHE_HOME: folder, XDG_STATE_HOME: folder } });
process.on('exit', () => sketch.kill('SIGKILL'));
let report = '';
sketch.stderr.on('data', (bytes) => { report += bytes; });

/** The client's end of the wire. */
class Wire extends EventEmitter {
  constructor() {
    super();
    sketch.stdout.on('data', (bytes) => this.emit('data', bytes));
    setImmediate(() => this.emit('open'));
  }

  write(bytes, done) { sketch.stdin.write(bytes, done); }
}

// It is built first, beside other programs: a sketch that ends is seen at once, whatever this is.
const PATIENCE_MS = 600_000;

/** The first answer of `ask(answer)` that is wanted; an error with what came instead. */
const answer = (what, ask, wanted = () => true) => new Promise((resolve, reject) => {
  const seen = [];
  const giveUp = (why) => reject(new Error(`${what}: ${why}; came: ${JSON.stringify(seen)}\n${report}`));
  const timer = setTimeout(() => giveUp(`nothing for ${PATIENCE_MS / 1000} s`), PATIENCE_MS);
  sketch.once('exit', (status) => giveUp(`the sketch ended with ${status}`));
  ask((value) => {
    seen.push(value);
    if (!wanted(value)) return;
    clearTimeout(timer);
    resolve(value);
  });
});

const board = new Firmata(new Wire(), { reportVersionTimeout: PATIENCE_MS });
await answer('ready', (done) => board.on('ready', () => done('ready')));

assert.equal(`${board.version.major}.${board.version.minor}`, '2.5');
assert.equal(board.firmware.name, 'StandardFirmata.ino');
assert.equal(board.pins.length, 20);
const { MODES, HIGH, LOW } = board;
assert.ok([MODES.INPUT, MODES.OUTPUT].every((mode) => board.pins[2].supportedModes.includes(mode)));
assert.deepEqual(board.analogPins, [14, 15, 16, 17, 18, 19]);
assert.ok(board.pins[14].supportedModes.includes(MODES.ANALOG));

board.pinMode(2, MODES.INPUT);
board.pinMode(3, MODES.OUTPUT);
const levels = new EventEmitter();
board.digitalRead(2, (level) => levels.emit('level', level));
const levelIs = (wanted) => answer(`pin 2 is ${wanted}`, (done) => levels.on('level', done), (level) => level === wanted);
const off = levelIs(HIGH);
board.digitalWrite(3, HIGH);
await off;
await answer('state of pin 3', (done) => board.queryPinState(3, done));
assert.equal(board.pins[3].state, HIGH);
const on = levelIs(LOW);
board.digitalWrite(3, LOW);
await on;
assert.equal(await answer('A0', (done) => board.analogRead(0, done)), 0);  // nothing is wired to it

sketch.removeAllListeners('exit');
sketch.kill('SIGTERM');
await once(sketch, 'exit');
assert.match(report, /hx711 on pins 2 and 3: 0 results read, switched off 1 times/);
await rm(folder, { recursive: true, force: true });
console.log('StandardFirmata answers');
process.exit(0);
