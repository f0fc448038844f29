// The page in a real browser, in front of the real service, spooler and simulated printer: a
// person's day.
//
//   node tests/e2e/browser/browser.test.mjs
//
// It is started with node itself: `node --test` would swallow the status 77, "skipped". The page
// runs here under a stricter policy than the service sends: no inline style either. No violation
// may occur.
import assert from 'node:assert/strict';
import { after, before, test as nodeTest } from 'node:test';
import { BAD_FILES, makeGcode } from './part.mjs';
import { drop as dropOn, findings, lookAt as lookOn } from './person.mjs';
import { startBrowser, startStack, whatIsMissing } from './stack.mjs';

const missing = whatIsMissing();
if (missing) {
  console.log(`skipped: ${missing}`);
  process.exit(77);
}

const STRICT = "default-src 'self'; img-src 'self' blob: data:; connect-src 'self'; object-src 'none'; base-uri 'none'; frame-ancestors 'none'";
const SPEED = 30;
// The machine may be busy with other tests: nothing here is about timing.
const PATIENCE_MS = 40_000;
const DESKTOP = { width: 1440, height: 900 };
const PHONE = { width: 390, height: 844 };

let stack, browser, context, page;
const problems = [];

before(async () => {
  stack = await startStack({ speed: SPEED });
  browser = await startBrowser();
  context = await browser.newContext({ viewport: DESKTOP, colorScheme: 'light' });
  page = await newPage(context);
});

after(async () => {
  await browser?.close();
  await stack?.stop();
});

/**
 * A watched page: its logged errors, its exceptions and its violations of the policy land in
 * `problems`.
 */
async function newPage(inContext) {
  const fresh = await inContext.newPage();
  fresh.setDefaultTimeout(PATIENCE_MS);
  await fresh.route((url) => url.pathname === '/', async (route) => {
    const response = await route.fetch();
    await route.fulfill({ response, headers: { ...response.headers(), 'content-security-policy': STRICT } });
  });
  fresh.on('pageerror', (error) => problems.push(`thrown: ${error}`));
  fresh.on('console', (message) => {
    // A refused request is logged by the browser itself, with its status: refusals are part of this
    // test.
    if (message.type() === 'error' && !message.text().startsWith('Failed to load resource')) problems.push(message.text());
  });
  return fresh;
}

/**
 * The tests tell one story: when one fails, those after it are skipped instead of waiting in vain.
 */
let broken = false;
const test = (name, body) => nodeTest(name, async (t) => {
  if (broken) return t.skip('a test before this one has failed');
  broken = true;
  await body();
  broken = false;
});

const at = (id, inside = page) => inside.getByTestId(id);
const job = (list, name) => at(list).filter({ hasText: name });

async function until(what, check, patience_ms = PATIENCE_MS) {
  const deadline = Date.now() + patience_ms;
  for (let last; ; await new Promise((resolve) => setTimeout(resolve, 100))) {
    last = await check();
    if (last) return last;
    if (stack.ended()) assert.fail(`${what} cannot come about: ./run has ended\n${stack.said()}`);
    if (Date.now() > deadline) assert.fail(`${what} did not come about; the state is "${await at('state').textContent()}"\n${stack.said()}`);
  }
}

const stateIs = (word) => until(`the state "${word}"`, async () => (await at('state').textContent()) === word);
const percent = async () => Number.parseFloat(await at('percent').textContent());
/** Fails at once, with what the page says of the job, when it has ended in another way. */
async function endedAs(name, state) {
  const [ended] = await job('ended', name).evaluateAll((found) => found.map((each) => ({ state: each.dataset.state, text: each.textContent })));
  if (ended && ended.state !== state) assert.fail(`${name} is not ${state}: ${ended.text}\n${stack.said()}`);
  return ended !== undefined;
}
/**
 * Drags a job onto the upper edge of another, by the events that a mouse makes: on a busy computer
 * a browser loses the mouse on its way.
 */
async function drag(name, onto) {
  const dataTransfer = await page.evaluateHandle(() => new DataTransfer());
  const target = job('job', onto);
  const { x, y } = await target.boundingBox();
  const at = { dataTransfer, clientX: x + 60, clientY: y + 4 };
  await job('job', name).dispatchEvent('dragstart', { dataTransfer });
  await until('a row that is dragged', async () => (await page.locator('.job.dragged').count()) === 1);
  await target.dispatchEvent('dragover', at);
  await until('the place where it would go', async () => (await page.locator('.job.over').count()) === 1);
  await target.dispatchEvent('drop', at);
}
const names = async () => (await at('job').locator('.name').allTextContents());

const drop = (name, bytes) => dropOn(page, name, bytes);
const lookAt = (canvas) => lookOn(page, canvas);
/** Shows the tools of a waiting job. */
const more = (name) => page.getByRole('button', { name: typeof name === 'string' ? `More for ${name}` : name }).click();
const bedIsClear = async () => {
  await page.getByRole('button', { name: 'Bed is clear' }).click();
  await until('a clear bed', async () => (await at('bed').count()) === 0);
};

test('without a key there is nothing but the question for it', async () => {
  await page.goto(stack.address.split('#')[0]);
  await page.getByLabel('Key').fill('not-the-key');
  await page.getByRole('button', { name: 'Sign in' }).click();
  assert.match(await page.getByRole('alert').textContent(), /not the key of this printer/);
  assert.equal(await at('state').count(), 0);
});

test('the link signs in, and its key leaves the address bar', async () => {
  await page.goto('about:blank');
  await page.goto(stack.address);
  await stateIs('Ready');
  assert.ok(!page.url().includes('key'), page.url());
  const { cookies } = await context.storageState();
  assert.ok(cookies.length > 0 && cookies.every((each) => each.httpOnly && each.sameSite === 'Strict'));
  assert.ok(!(await page.evaluate(() => document.cookie + JSON.stringify(localStorage))).includes(stack.key));
  assert.equal(await at('factor').textContent(), `simulated, ${SPEED}×`);
});

for (const { name, bytes, says } of BAD_FILES) {
  test(`${name} is refused with its reason`, async () => {
    await drop(name, bytes);
    const row = job('upload', name);
    await row.locator('.error').waitFor();
    assert.match(await row.locator('.error').textContent(), says);
    await row.getByRole('button').click();
    assert.equal(await at('job').count(), 0);
  });
}

test('a job that brings no homing and no heating is printed with one click', async () => {
  await drop('bare.gcode', Buffer.from(';FLAVOR:Griffin\n;EXTRUDER_TRAIN.0.INITIAL_TEMPERATURE:205\nM82\nG92 E0\nG1 Z0.3 F300\nG1 X60 Y60 F6000\nG1 X90 E2 F1200\nM104 S0\n'));
  const row = job('upload', 'bare.gcode');
  await row.locator('.error').waitFor();
  assert.match(await row.locator('.error').textContent(), /before anything has homed/);
  await row.getByTestId('home-and-heat').click();
  await until('a finished print', () => endedAs('bare.gcode', 'done'));
  await job('ended', 'bare.gcode').locator('.name-button').click();
  await until('its verdict', async () => /what was built is what was asked/.test(await at('report').textContent()));
  await bedIsClear();
});

test('a print ends inspected: what was built is what was asked', async () => {
  await drop('small.gcode', makeGcode({ layers: 5, radius: 12, spacing: 1.5, speed_mm_s: 80, estimated_min: 1 }));
  await until('a finished print', () => endedAs('small.gcode', 'done'));
  await job('ended', 'small.gcode').locator('.name-button').click();
  await at('report').waitFor();
  assert.match(await at('report').textContent(), /what was built is what was asked.*\b0 lost steps/s);
  assert.match(await job('ended', 'small.gcode').textContent(), /Printed in \d/);
  assert.match(await at('what-now').textContent(), /clear bed.*small\.gcode/s);
  await page.locator('.legend li').first().waitFor();
});

test('a dropped file is printed, and the picture grows with it', async () => {
  // Long enough that it still prints when it is cancelled below, however busy the machine is.
  await drop('tower.gcode', makeGcode({ layers: 180, radius: 24, spacing: 1, estimated_min: 97 }));
  await until('a tower that waits for the bed', async () => /tower\.gcode waits/.test(await at('what-now').textContent()));
  await bedIsClear();
  await job('running', 'tower.gcode').waitFor();
  await stateIs('Printing');
  const first = await until('a first percent', percent);
  const early = await lookAt(at('canvas'));
  await until('more percents', async () => (await percent()) > first + 1);
  assert.ok(early.colours > 20, `the canvas has ${early.colours} colours: it is blank`);
  // On a busy machine the picture comes behind the figures.
  await until('a part that grows', async () => {
    const late = await lookAt(at('canvas'));
    return late.warm > 200 && late.warm !== early.warm;
  });
  assert.match(await page.title(), /^\d+ % Printing · .+ · tower\.gcode$/);
  assert.ok(Number.parseFloat(await at('hot-end').textContent()) > 150);
});

test('it can be paused and resumed', async () => {
  await page.getByRole('button', { name: 'Pause', exact: true }).click();
  await stateIs('Paused');
  await until('a parked head', async () => /Parked/.test(await at('pause-note').textContent()));
  assert.ok(await page.getByRole('button', { name: 'X plus 10 mm' }).isEnabled());
  await page.getByRole('button', { name: 'Resume' }).click();
  await stateIs('Printing');
});

test('jobs queue up, move and can be deleted', async () => {
  await page.setInputFiles('[data-testid=file]', [
    { name: 'second.gcode', mimeType: 'text/plain', buffer: makeGcode({ layers: 20, radius: 18, spacing: 1 }) },
    { name: 'third.gcode', mimeType: 'text/plain', buffer: makeGcode({ layers: 20, radius: 16, spacing: 1 }) },
    { name: '<img src=x onerror=alert(1)>.gcode', mimeType: 'text/plain', buffer: makeGcode({ layers: 3, radius: 9 }) },
  ]);
  await until('three jobs that wait', async () => (await names()).length === 3);
  assert.deepEqual((await names()).slice(0, 2), ['second.gcode', 'third.gcode']);
  assert.equal((await names())[2], '<img src=x onerror=alert(1)>.gcode', 'a name is text');
  await more('third.gcode');
  await page.getByRole('button', { name: 'Move third.gcode up' }).click();
  await until('third before second', async () => (await names())[0] === 'third.gcode');
  await page.getByRole('button', { name: 'Move third.gcode down' }).click();
  await until('second before third', async () => (await names())[0] === 'second.gcode');
  await until('third before second, by dragging', async () => {
    await drag('third.gcode', 'second.gcode'); // a starved browser loses one now and then
    return until('it', async () => (await names())[0] === 'third.gcode', 5000).then(() => true, () => false);
  });
  await more('second.gcode');
  await page.getByRole('button', { name: 'Hold second.gcode' }).click();
  await job('job', 'second.gcode').getByText('On hold').waitFor();
  await page.getByRole('button', { name: 'Release second.gcode' }).click();
  await until('second released', async () => (await page.getByText('On hold').count()) === 0);
  await more(/^More for <img/);
  await page.getByRole('button', { name: /^Delete <img/ }).click();
  await at('yes').click();
  await until('two jobs that wait', async () => (await names()).length === 2);
});

test('the console answers', async () => {
  await page.locator('.console summary').click();
  await page.getByLabel('One line of G-code').fill('M105');
  await page.getByLabel('One line of G-code').press('Enter');
  await until('the answer', async () => /T:\s?\d/.test(await at('log').textContent()));
});

test('a phone shows the same, and nothing sticks out', async () => {
  const { cookies } = await context.storageState();
  const pocket = await browser.newContext({ viewport: PHONE, isMobile: true, hasTouch: true, colorScheme: 'dark', deviceScaleFactor: 1 });
  await pocket.addCookies(cookies);
  const phone = await newPage(pocket);
  await phone.goto(stack.address.split('#')[0]);
  await at('percent', phone).waitFor();
  await phone.locator('.legend li').first().waitFor();
  assert.ok((await phone.evaluate(() => document.documentElement.scrollWidth)) <= PHONE.width);
  const small = await phone.locator('button:visible').evaluateAll((buttons) => buttons
    .map((each) => ({ label: each.getAttribute('aria-label') ?? each.textContent, height: each.getBoundingClientRect().height }))
    .filter(({ height }) => height < 40).map(({ label }) => label));
  assert.deepEqual(small, [], 'these buttons are too low for a finger');
  await pocket.close();
});

test('a cancelled print makes way for the next', async () => {
  await page.getByRole('button', { name: 'Cancel', exact: true }).click();
  await at('yes').click();
  await until('a cancelled tower', () => endedAs('tower.gcode', 'cancelled'));
  assert.match(await job('ended', 'tower.gcode').textContent(), /Cancelled at line \d/);
  await bedIsClear();
  await job('running', 'third.gcode').waitFor();
  await stateIs('Printing');
});

test('the emergency stop stops, says so, and can be cleared', async () => {
  await until('lines that are printed', percent);
  await page.getByRole('button', { name: 'Emergency stop' }).click();
  await at('fault').waitFor();
  await stateIs('Stopped by a fault');
  await until('the failed job', async () => (await page.locator('.part-card h2').textContent()) === 'third.gcode');
  await until('where it stopped', async () => /failed at line \d/.test(await at('stopped').textContent()));
  assert.equal(await at('report').count(), 0, 'no older verdict');
  await page.locator('.legend li').first().waitFor();
  await page.getByRole('button', { name: 'Clear fault' }).click();
  await stateIs('Ready');
  assert.equal(await at('fault').count(), 0);
});

test('the queue waits after a failure, and goes on when it is told to', async () => {
  await at('gate').waitFor();
  if ((await at('bed').count()) > 0) await bedIsClear();
  await page.getByRole('button', { name: 'Go on with the queue' }).click();
  await until('an open gate', async () => (await at('gate').count()) === 0);
  await job('running', 'second.gcode').waitFor();
  await stateIs('Printing');
});

test('a service that stands still is said, and a stop is confirmed when it goes on', async () => {
  await until('lines that are printed', percent);
  const printd = await stack.pidOf('printd');
  process.kill(printd, 'SIGSTOP');
  try {
    await until('the silence', async () => (await at('as-of').count()) > 0);
    assert.ok(await page.getByRole('button', { name: 'Cancel', exact: true }).isDisabled());
    await page.getByRole('button', { name: 'Emergency stop', exact: true }).click();
    await until('a word that it is not confirmed', async () => (await at('stop').getAttribute('data-phase')) === 'unconfirmed');
    assert.match(await at('stop').textContent(), /NOT confirmed: cut the power/);
  } finally {
    process.kill(printd, 'SIGCONT');
  }
  await until('a confirmation', async () => (await at('stop').getAttribute('data-phase')) === 'confirmed');
  await until('news', async () => (await at('as-of').count()) === 0);
  await stateIs('Stopped by a fault');
  await page.getByRole('button', { name: 'Clear fault' }).click();
  await stateIs('Ready');
});

test('axe finds nothing on the page, light and dark', async () => {
  for (const colorScheme of ['light', 'dark']) {
    await page.emulateMedia({ colorScheme });
    await page.evaluate(() => scrollTo(0, 0));
    assert.deepEqual(await findings(page), [], colorScheme);
  }
});

test('jobs are found again by name, by the service', async () => {
  const { jobs, counts } = await page.evaluate(async () => (await fetch('/api/v1/jobs?q=tower&state=cancelled&limit=1')).json());
  assert.deepEqual(jobs.map((each) => each.name), ['tower.gcode']);
  assert.ok(counts.total >= 4, JSON.stringify(counts));
});

test('nothing was logged as an error, and the policy was kept', async () => {
  assert.deepEqual(problems, []);
  await page.evaluate(() => document.body.setAttribute('style', 'color: red'));
  await until('the violation that was just made', () => problems.some((text) => /style/.test(text) && /Content Security Policy/.test(text)));
});
