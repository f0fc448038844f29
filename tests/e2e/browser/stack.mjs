// Starts the printer as a person does: ./run on the simulator, on a free port, with a state folder
// of its own. Also starts the browser.
import { spawn } from 'node:child_process';
import { once } from 'node:events';
import { existsSync } from 'node:fs';
import { mkdtemp, readdir, readFile, rm } from 'node:fs/promises';
import { createRequire } from 'node:module';
import { connect } from 'node:net';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';

export const ROOT = fileURLToPath(new URL('../../../', import.meta.url));
const PROGRAMS = ['printd', 'printer', 'printer-sim', 'virtual-machine', 'qduino-supervisor'];
const CHROMIUM = [process.env.CHROMIUM, '/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome'];
// Local network checks: the page's answer is replaced on its way (its policy is made stricter), and
// Chromium takes a replaced page for one from elsewhere, which may not open a socket to this
// machine.
const BROWSER_ARGUMENTS = [
  '--headless=new', '--no-sandbox', '--disable-gpu', '--disable-quic', '--disable-features=LocalNetworkAccessChecks', '--no-first-run',
  '--disable-background-networking', '--disable-component-update', '--disable-sync',
];
const IN_SOFTWARE = ['--enable-unsafe-swiftshader', '--use-angle=swiftshader'];

const chromiumPath = () => CHROMIUM.find((path) => path && existsSync(path));

/** Why no test in a browser can run here; null when it can. */
export function whatNoBrowserCanDoWithout() {
  if (!chromiumPath()) return 'no chromium (apt-get install chromium, or set CHROMIUM)';
  if (!existsSync(join(ROOT, 'web/ui/node_modules/playwright-core'))) return 'no playwright-core (npm ci in web/ui)';
  return null;
}

/** Why no test of the page can run here; null when it can. */
export function whatThePageMisses() {
  const browser = whatNoBrowserCanDoWithout();
  if (browser) return browser;
  if (!existsSync(join(ROOT, 'web/ui/dist/index.html'))) return 'the page is not built (tools/build_page.sh)';
  return null;
}

/** Why no test of the whole can run here; null when it can. */
export function whatIsMissing() {
  const page = whatThePageMisses();
  if (page) return page;
  const absent = PROGRAMS.find((name) => !existsSync(join(ROOT, 'build/release/bin', name)));
  return absent ? `build/release/bin/${absent} is not built (ninja -C build/release printer-programs)` : null;
}

const isTaken = (port) => new Promise((resolve) => {
  const socket = connect(port, '127.0.0.1');
  socket.on('connect', () => (socket.destroy(), resolve(true)));
  socket.on('error', () => resolve(false));
});

async function freePort() {
  for (let port = 8123; port <= 8129; port++) if (!(await isTaken(port))) return port;
  throw new Error('every port from 8123 to 8129 is taken');
}

/** Ends ./run as Ctrl-C does, and waits until everything it started has gone. */
async function stop(child, state) {
  if (child.exitCode === null && child.signalCode === null) {
    const gone = once(child, 'exit');
    child.kill('SIGTERM');
    const timer = setTimeout(() => child.kill('SIGKILL'), 30_000);
    await gone;
    clearTimeout(timer);
  }
  await rm(state, { recursive: true, force: true });
}

/** The process `name` among those that `ancestor` has started, itself or by others. */
async function descendant(ancestor, name) {
  const parents = new Map();
  const found = [];
  for (const entry of await readdir('/proc')) {
    // pid (comm) state ppid: the name may have blanks and brackets.
    const stat = /^\d+$/.test(entry) ? await readFile(`/proc/${entry}/stat`, 'utf8').catch(() => '') : '';
    const [, comm, parent] = /^\d+ \((.*)\) \S (\d+)/s.exec(stat) ?? [];
    if (comm === undefined) continue;
    parents.set(Number(entry), Number(parent));
    if (comm === name) found.push(Number(entry));
  }
  const isBelow = (pid) => pid !== undefined && (pid === ancestor || isBelow(parents.get(pid)));
  const pid = found.find(isBelow);
  if (pid === undefined) throw new Error(`./run has no process ${name}`);
  return pid;
}

/**
 * {address, key, said(), ended(), pidOf(name), stop()}: a printer in the simulator, `speed` times
 * as fast as real time; without `speed` in real time, on the Linux board.
 */
export async function startStack({ speed } = {}) {
  const port = await freePort();
  const state = await mkdtemp(join(tmpdir(), 'qduinomc-browser-'));
  const child = spawn(join(ROOT, 'run'), ['--no-build', ...(speed ? ['--speed', String(speed)] : []), '--port', String(port), '--state', state], { cwd: ROOT });
  // Whatever ends this test early ends what it started.
  process.on('exit', () => child.kill('SIGTERM'));
  for (const signal of ['SIGINT', 'SIGTERM']) process.on(signal, () => process.exit(1));
  let said = '';
  for (const stream of [child.stdout, child.stderr]) stream.on('data', (bytes) => { said += bytes; });
  const deadline = Date.now() + 60_000;
  for (;;) {
    const found = /Open\s+(http:\/\/\S+#key=(\S+))/.exec(said);
    const ended = () => child.exitCode !== null || child.signalCode !== null;
    if (found) return { address: found[1], key: found[2], said: () => said, ended, pidOf: (name) => descendant(child.pid, name), stop: () => stop(child, state) };
    if (child.exitCode !== null || Date.now() > deadline) {
      await stop(child, state);
      throw new Error(`./run gave no address:\n${said}`);
    }
    await new Promise((resolve) => setTimeout(resolve, 100));
  }
}

/**
 * `draws`: with WebGL, in software, which costs more than all else that the page does. `more`:
 * further arguments of Chromium.
 */
export function startBrowser({ draws = true, more = [] } = {}) {
  const { chromium } = createRequire(join(ROOT, 'web/ui/package.json'))('playwright-core');
  return chromium.launch({ executablePath: chromiumPath(), args: [...BROWSER_ARGUMENTS, ...(draws ? IN_SOFTWARE : ['--disable-software-rasterizer']), ...more] });
}
