// Takes docs/screenshots from a printer that runs, by doing what they show: uploads, a refusal, a
// print, a stop.
//
//   node tests/e2e/browser/screenshots.mjs [--into FOLDER] [--layers N]
//   node tests/e2e/browser/screenshots.mjs 'http://127.0.0.1:8080/#key=…' …
//
// Without an address it starts a printer of its own, as `./run` does: in real time, for the timing
// on the pictures is measured, so as root, and when nothing else runs on the computer. It says so
// and ends where it is busy. With an address it takes the printer that runs there. Its queue must
// be empty and the machine ready, so that no other print is touched. It takes about ten minutes,
// ends with an emergency stop that is cleared, and deletes the jobs that it made. Where steps were
// late or missing it ends with an error, and no picture of the print.
import assert from 'node:assert/strict';
import { mkdir, stat } from 'node:fs/promises';
import { cpus, loadavg } from 'node:os';
import { join } from 'node:path';
import { makeGcode } from './part.mjs';
import { drop } from './person.mjs';
import { ROOT, startBrowser, startStack, whatIsMissing } from './stack.mjs';

const DESKTOP = { width: 1440, height: 900 };
const PHONE = { width: 390, height: 844 };
const BYTES_MAX = 300_000; // in the repository
const PRINT_PATIENCE_MS = 45 * 60_000;
const PATIENCE_MS = 60_000;
const WORST_US_MAX = 1000; // what the page marks as late

const words = process.argv.slice(2);
const option = (name, otherwise) => {
  const at = words.indexOf(name);
  return at < 0 ? otherwise : words.splice(at, 2)[1];
};
const layers = Number(option('--layers', 14));
const folder = option('--into', join(ROOT, 'docs/screenshots'));
const [given, ...more] = words;
if (more.length > 0 || (given !== undefined && !given.includes('#key=')) || !folder || !(layers > 2)) {
  console.error("usage: node tests/e2e/browser/screenshots.mjs ['http://…/#key=…'] [--into FOLDER] [--layers N]");
  process.exit(2);
}

/** Why no quiet run in real time can be seen here now; null when it can. */
function whatDisturbs() {
  if (whatIsMissing()) return whatIsMissing();
  if (process.getuid() !== 0) return 'the stepper loop gets a core of its own from root alone: start this as root';
  if (cpus().length < 2) return 'the stepper loop wants a core of its own, and there is one';
  const [load] = loadavg();
  return load > 0.7 ? `the computer is busy (load ${load.toFixed(1)} in the last minute): try again when nothing else runs` : null;
}

const why = given === undefined ? whatDisturbs() : null;
if (why) {
  console.error(why);
  process.exit(1);
}
const own = given === undefined ? await startStack() : null;
const address = given ?? own.address;

async function until(what, check, patience_ms = PATIENCE_MS) {
  const deadline = Date.now() + patience_ms;
  while (!(await check())) {
    assert.ok(Date.now() < deadline, `${what} did not come about`);
    await new Promise((resolve) => setTimeout(resolve, 200));
  }
}

async function picture(page, name) {
  const path = join(folder, `${name}.png`);
  await page.evaluate(() => scrollTo(0, 0));
  await page.mouse.move(0, 0);
  await page.screenshot({ path });
  const { size } = await stat(path);
  console.log(`${path}  ${Math.round(size / 1000)} KB`);
  assert.ok(size < BYTES_MAX, `${name}.png is too large for the repository`);
}

const browser = await startBrowser();
const context = await browser.newContext({ viewport: DESKTOP, colorScheme: 'light' });
const page = await context.newPage();
page.setDefaultTimeout(PATIENCE_MS);
const at = (id) => page.getByTestId(id);
const press = (name) => page.getByRole('button', { name, exact: true }).click();
const stateIs = (word) => until(`the state "${word}"`, async () => (await at('state').textContent()) === word);
const percent = async () => ((await at('percent').count()) > 0 ? Number.parseFloat(await at('percent').textContent()) : 0);
/** The list as the service has it; the session's cookie lets the page ask. */
const jobs = () => page.evaluate(async () => (await (await fetch('/api/v1/jobs')).json()).jobs);
const made = new Set();

/**
 * The README says that every pulse comes at its instant; its picture must not show a computer that
 * was busy with other things. Fails with what was seen.
 */
async function assertQuiet() {
  const { timing } = await page.evaluate(async () => (await fetch('/api/v1/machine')).json());
  const worst_us = timing.lateness_ns.max / 1000;
  assert.ok(timing.starved === 0 && worst_us < WORST_US_MAX,
    `this was no quiet run (the latest step by ${worst_us.toFixed(0)} µs, ran dry ${timing.starved} times): take the pictures when nothing else runs here`);
}

/** Uploads a part and waits until it is a job. */
async function add(name, part) {
  await drop(page, name, makeGcode(part));
  await until(`the job ${name}`, async () => {
    const found = (await jobs()).find((each) => each.name === name && !made.has(each.id));
    if (found) made.add(found.id);
    return found !== undefined;
  });
}

async function begin() {
  await page.goto(address);
  await stateIs('Ready');
  const busy = (await jobs()).filter((each) => !['done', 'cancelled', 'failed'].includes(each.state));
  assert.equal(busy.length, 0, `the queue is not empty: ${busy.map((each) => each.name).join(', ')}`);
  if ((await at('bed').count()) > 0) await press('Bed is clear');
  await page.waitForTimeout(15_000); // some temperatures for the chart
  await picture(page, 'desktop-ready');
  await drop(page, 'too-hot.gcode', Buffer.from('G28\nM104 S999\nG1 X10 Y10 F3000\n'));
  await at('upload').locator('.error').waitFor();
  await picture(page, 'desktop-refused');
  await page.getByRole('button', { name: 'Dismiss too-hot.gcode' }).click();
}

async function print() {
  const part = { layers, radius: 20, spacing: 1.2, speed_mm_s: 60 };
  await add('lobed-vase.gcode', { ...part, estimated_min: Math.max(1, Math.round(layers * 0.5)) });
  await add('hinge.gcode', { ...part, layers: 20, radius: 14, estimated_min: 8 });
  await add('cable-clip.gcode', { ...part, layers: 10, radius: 9, estimated_min: 3 });
  await until('half a print', async () => (await percent()) > 45, PRINT_PATIENCE_MS);
  await assertQuiet();
  await picture(page, 'desktop-printing');
  const pocket = await browser.newContext({ viewport: PHONE, isMobile: true, hasTouch: true, colorScheme: 'dark', deviceScaleFactor: 1 });
  await pocket.addCookies((await context.storageState()).cookies);
  const phone = await pocket.newPage();
  await phone.goto(address.split('#')[0]);
  await phone.locator('.legend li').first().waitFor();
  await picture(phone, 'phone-printing');
  await pocket.close();
  await until('a finished print', async () => (await page.locator('[data-testid=ended][data-state=done]', { hasText: 'lobed-vase.gcode' }).count()) > 0, PRINT_PATIENCE_MS);
  // The page shows what lies on the bed. Only the virtual machine writes a report on it.
  await at('report').waitFor({ timeout: 10_000 }).catch(() => console.log('no inspection: this is no virtual machine'));
  await picture(page, 'desktop-inspected');
}

async function stop() {
  await press('Bed is clear');
  await until('the second print under way', async () => (await percent()) > 5, PRINT_PATIENCE_MS);
  await press('Emergency stop');
  await at('stopped').waitFor();
  await page.locator('.legend li').first().waitFor();
  await picture(page, 'desktop-stopped');
  await press('Clear fault');
  await stateIs('Ready');
}

await mkdir(folder, { recursive: true });
try {
  await begin();
  await print();
  await stop();
} finally {
  for (const id of made) await page.evaluate((job) => fetch(`/api/v1/jobs/${job}`, { method: 'DELETE' }), id).catch(() => undefined);
  await browser.close();
  await own?.stop();
}
