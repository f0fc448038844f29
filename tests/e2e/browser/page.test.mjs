// The page in a real browser, in front of its mock (web/ui/mock): states that a real printer is not
// brought into easily. browser.test.mjs tests that the page and the service agree.
//
//   node tests/e2e/browser/page.test.mjs
import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { createServer } from 'node:http';
import { after, before, test } from 'node:test';
import { startMock } from '../../../web/ui/mock/server.mjs';
import { drop, findings, lookAt, pictureOf } from './person.mjs';
import { startBrowser, whatThePageMisses } from './stack.mjs';

const missing = whatThePageMisses();
if (missing) {
  console.log(`skipped: ${missing}`);
  process.exit(77);
}

// The machine may be busy with other tests: nothing here is about timing.
const PATIENCE_MS = 120_000;
const DESKTOP = { width: 1440, height: 900 };
const PHONE = { width: 390, height: 844 };
const NARROW = { width: 360, height: 1200 };
const browsers = {};
before(async () => {
  browsers.plain = await startBrowser({ draws: false });
  browsers.drawing = await startBrowser();
});
after(async () => { for (const browser of Object.values(browsers)) await browser.close(); });

/**
 * Opens the page in front of a mock in `scene`; `body` gets {page, mock, at, requests}. No error
 * may be logged meanwhile. `draws`: in a browser with WebGL; `begin`: before the page is opened.
 */
async function inScene(scene, body, { viewport = DESKTOP, key, draws = false, begin = async () => {} } = {}) {
  const mock = await startMock({ scene });
  const context = await (draws ? browsers.drawing : browsers.plain).newContext({ viewport });
  const page = await context.newPage();
  page.setDefaultTimeout(PATIENCE_MS);
  const problems = [];
  const requests = [];
  page.on('request', (request) => requests.push(`${request.method()} ${new URL(request.url()).pathname}${new URL(request.url()).search}`));
  page.on('pageerror', (error) => problems.push(`thrown: ${error}`));
  page.on('console', (message) => message.type() === 'error' && !message.text().startsWith('Failed to load resource') && problems.push(message.text()));
  try {
    await begin(page);
    await page.goto(key ? mock.address.replace(/key=.*/, `key=${key}`) : mock.address);
    await body({ page, mock, requests, at: (id) => page.getByTestId(id), button: (name) => page.getByRole('button', { name, exact: true }) });
    assert.deepEqual(problems, []);
  } finally {
    await context.close();
    mock.close();
  }
}

async function until(what, check) {
  const deadline = Date.now() + PATIENCE_MS;
  for (;;) {
    if (await check()) return;
    if (Date.now() > deadline) assert.fail(`${what} did not come about`);
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
}

const text = (locator) => locator.textContent();

test('after a print one button says that the bed is clear, and until then the next job waits', () =>
  inScene('bed', async ({ mock, requests, at, button }) => {
    await at('bed').waitFor();
    assert.match(await text(at('what-now')), /hinge\.gcode waits for a clear bed.*calibration-cube\.gcode/s);
    assert.equal(mock.printer.state, 'idle');
    assert.equal(await button('Bed is clear').count(), 1);
    await button('Bed is clear').click();
    await at('running').waitFor();
    assert.equal(await at('bed').count(), 0);
    assert.ok(requests.includes('POST /api/v1/machine/bed-cleared'));
  }));

test('where nobody is asked about the bed, the page says so', () =>
  inScene('no-confirm', async ({ at }) => {
    await at('no-confirm').waitFor();
    assert.match(await text(at('no-confirm')), /starts by itself, onto whatever lies there/);
  }));

test('heat that nobody uses is announced with a countdown, can be kept, and its end is explained', () =>
  inScene('idle-warning', async ({ mock, at, button }) => {
    await at('idle-warning').waitFor();
    assert.match(await text(at('idle-warning')), /go off in (1 min \d\d s|\d\d s)/);
    const first = await text(at('idle-warning'));
    await until('a countdown', async () => (await text(at('idle-warning'))) !== first);
    await button('Keep warm').click();
    await until('the end of the warning', async () => (await at('idle-warning').count()) === 0);
    assert.deepEqual([mock.printer.hotEnd.target_c, mock.printer.bed.target_c], [209, 60]);
    assert.match(await text(at('idle-hint')), /go off in (10|9) min/);
    mock.printer.idle.off_in_s = 0.05;
    await at('idle-off').waitFor();
    assert.match(await text(at('idle-off')), /switched off.*Nobody had used them for 10 min.*Set a temperature/s);
  }));

test('where heaters are never switched off by themselves, the page says so', () =>
  inScene('idle-never', async ({ at }) => {
    await at('idle-never').waitFor();
    assert.match(await text(at('idle-never')), /never switched off by themselves/);
  }));

test('a parked print says what may be done, and what resume will do', () =>
  inScene('paused', async ({ mock, page, at, button }) => {
    await at('pause-note').waitFor();
    assert.match(await text(at('pause-note')), /Parked.*filament may be changed.*exactly where it stopped/);
    assert.ok(await button('X plus 10 mm').isEnabled());
    await until('a hot end for filament', () => button('Extrude 10 mm').isEnabled());
    assert.ok(await button('Home X').isDisabled());
    mock.printer.idle.timed_out = true;
    await until('its reason', async () => /switched off: nobody had used them for 10 min.*Resume heats up again first/.test(await text(at('pause-note'))));
    assert.equal(await at('idle-off').count(), 0, 'it is said once');
    mock.printer.parked = false;
    await until('no jog while it is not parked', () => button('X plus 10 mm').isDisabled());
    assert.equal(await page.getByText('Axes move by hand once the head is parked.').count(), 1);
  }));

test('jog before homing is refused beside its button, where homing is offered', () =>
  inScene('unhomed', async ({ at, button }) => {
    await at('unhomed').waitFor();
    assert.match(await text(at('unhomed')), /X, Y and Z are not homed/);
    assert.ok(await button('X plus 10 mm').isDisabled());
    await button('Home X Y Z').click();
    await until('a jog', () => button('X plus 10 mm').isEnabled());
    assert.equal(await at('unhomed').count(), 0);
  }));

test('an emergency stop shows the failed job and where it stopped, not an older one\'s verdict', () =>
  inScene('printing', async ({ mock, page, at, button }) => {
    await at('running').waitFor();
    await page.locator('[data-testid=ended] .name-button').first().click();
    await at('report').waitFor(); // an older print, which matched: a person has chosen to see it
    await button('Back to the print').click();
    await button('Emergency stop').click();
    await at('stopped').waitFor();
    assert.match(await text(at('stopped')), /This print failed at line 1\d.\d{3}, in layer 6\d of 120, after 42 min\./);
    assert.equal((await page.locator('main').innerText()).match(/emergency stop/gi).length, 1, 'the reason stands once');
    assert.equal(await page.locator('.job.current').getAttribute('data-state'), 'failed');
    assert.equal(await at('report').count(), 0);
    assert.equal(await page.locator('.part-card h2').textContent(), '3DBenchy.gcode');
    // The sensor is dead: the fault stays, and its reason stands beside the button.
    mock.printer.stuck = 'hot end: the sensor gives no reading';
    mock.printer.hotEnd.reading = false;
    await at('hot-end').locator('s').waitFor();
    await button('Clear fault').click();
    await at('fault').getByTestId('refusal').waitFor();
    assert.match(await text(at('fault').getByTestId('refusal')), /still there: hot end: the sensor/);
    mock.printer.stuck = null;
    await button('Clear fault').click();
    await until('no fault', async () => (await at('fault').count()) === 0);
    assert.equal(await page.locator('.what-now li.done').count(), 1, 'a step that is done stays, ticked');
  }));

test('after a failure each step has its button when it is its turn', () =>
  inScene('faulted', async ({ mock, at, button }) => {
    mock.printer.gate.bed_occupied = true;
    mock.printer.changed();
    for (const [step, name] of [['fault', 'Clear fault'], ['bed', 'Bed is clear'], ['gate', 'Go on with the queue']]) {
      await until(`the step ${step}`, async () => (await at(step).locator('button').count()) === 1);
      assert.equal(await at('what-now').locator('li button').count(), 1, 'the next button only');
      await button(name).click();
      await until(`the end of the step ${step}`, async () => (await at(step).count()) === 0);
    }
    await at('running').waitFor();
  }));

test('"Off" asks in a print, says what it does, and pauses it', () =>
  inScene('printing', async ({ mock, page, at, button, requests }) => {
    await at('running').waitFor();
    await button('Hot end off').click();
    assert.match(await text(page.getByRole('dialog')), /hot end off in the middle of the print.*paused.*heats up again first/s);
    await page.getByRole('button', { name: 'No, keep it' }).click();
    assert.equal(mock.printer.hotEnd.target_c, 209);
    await page.getByLabel('Hot end target, °C').fill('0');
    await page.getByRole('button', { name: 'Set hot end target' }).click();
    await at('yes').click();
    await at('pause-note').waitFor();
    assert.match(await text(at('pause-note')), /Resume heats up again first/);
    assert.equal(requests.filter((each) => each === 'POST /api/v1/machine/temperature').length, 1);
    await button('Hot end off').waitFor();
    assert.ok(await button('Hot end off').isDisabled());
  }));

test('the end of a print is told to whoever hears the page', () =>
  inScene('printing', async ({ mock, at }) => {
    await at('running').waitFor();
    assert.equal(await text(at('announced')), '');
    mock.printer.gate.held = true;
    mock.printer.finish('done');
    await until('the end, told', async () => (await text(at('announced'))) === '3DBenchy.gcode is printed.');
  }));

test('heating is a state, and the tab tells the printer, the state and the percent', () =>
  inScene('heating', async ({ mock, page, at }) => {
    await until('the state', async () => (await text(at('state'))) === 'Heating');
    assert.match(await text(at('doing')), /1\d\d of 209 °C/);
    assert.equal(await text(at('printer')), 'Printrbot Simple Metal');
    assert.match(await page.title(), /^0 % Heating · Printrbot Simple Metal · 3DBenchy\.gcode$/);
    mock.printer.activity = null;
    await until('printing', async () => (await text(at('state'))) === 'Printing');
    assert.equal(await at('doing').count(), 0);
  }));

test('percents are of the time, the same wherever they stand', () =>
  inScene('printing', async ({ mock, page, at }) => {
    await at('running').waitFor();
    mock.printer.elapsed = 4804; // slow so far: half of the bytes took the time of all
    const same = async () => {
      const told = Math.floor(mock.printer.progress().fraction * 100);
      const [done, row] = [await text(at('percent')), await text(at('running').locator('.facts'))];
      return Math.abs(Number.parseInt(done, 10) - told) <= 1 && row.startsWith(done) && (await page.title()).startsWith(done);
    };
    await until('the share of the time', same);
    assert.ok(mock.printer.progress().fraction > 0.65);
  }));

test('thirty jobs take a line each, whose tools are shown on demand, and a deleted one hands on the focus', () =>
  inScene('queue30', async ({ page, at, button }) => {
    await until('thirty', async () => (await at('job').count()) >= 30);
    const heights = await at('job').evaluateAll((rows) => rows.map((row) => row.getBoundingClientRect().height));
    assert.ok(Math.max(...heights) <= 50, `a row is ${Math.max(...heights)} px high`);
    assert.equal(await page.locator('.queue [aria-current=true]').count(), 1);
    assert.equal(await page.locator('.queue [aria-current=true]').locator('xpath=ancestor::li').getAttribute('data-testid'), 'running');
    await page.locator('.name-button', { hasText: 'knob-02' }).click();
    await until('the shown one', async () => /knob-02/.test(await page.locator('.queue [aria-current=true]').textContent()));
    await button('More for knob-02.gcode').click();
    const copies = page.getByLabel('Copies of knob-02.gcode');
    await copies.fill('-4');
    await copies.press('Tab');
    await at('job').filter({ hasText: 'knob-02' }).getByTestId('refusal').waitFor();
    assert.equal(await copies.inputValue(), '1', 'a refused number does not stay');
    await button('Delete knob-02.gcode').click();
    await at('yes').click();
    await until('it is gone', async () => (await at('job').filter({ hasText: 'knob-02' }).count()) === 0);
    await until('the focus on the next', () => page.evaluate(() => /hinge-03/.test(document.activeElement?.textContent ?? '')));
    assert.deepEqual(await findings(page), []);
  }));

test('a name keeps its direction to itself, and hides nothing', () =>
  inScene('printing', async ({ mock, page, at }) => {
    await at('running').waitFor();
    mock.printer.jobs.find((each) => each.state === 'queued').name = 'a\u202Eedocg.exe';
    mock.printer.changed();
    await until('the name', async () => (await page.locator('.job bdi').allTextContents()).includes('a‹U+202E›edocg.exe'));
    assert.ok(!/[\u202A-\u202E\u2066-\u2069]/.test(await page.locator('body').innerHTML()));
  }));

test('a report that comes after the end of its print is shown when it comes', () =>
  inScene('printing', async ({ mock, at, requests }) => {
    await at('running').waitFor();
    const { printer } = mock;
    const { running } = printer;
    printer.uninspected = running;
    printer.finish('done');
    await until('a first question', () => requests.includes(`GET /api/v1/jobs/${running.id}/inspection`));
    assert.equal(await at('report').count(), 0);
    printer.uninspected = null;
    printer.changed();
    await at('report').waitFor();
  }));

test('a fault while nothing prints shows no older job\'s verdict', () =>
  inScene('bed', async ({ mock, page, at }) => {
    await at('report').waitFor();
    Object.assign(mock.printer, { state: 'faulted', fault: 'bed: the sensor gives no reading' });
    await at('fault').waitFor();
    await until('no verdict', async () => (await at('report').count()) === 0);
    assert.equal(await page.locator('[data-testid=stopped]').count(), 0);
  }));

test('a simulated printer says how fast its time passes', () =>
  inScene('simulated', async ({ at, page, mock }) => {
    await at('factor').waitFor();
    assert.equal(await text(at('factor')), 'simulated, 20×');
    await at('percent').waitFor();
    // Its time goes on while it is looked at: 3 s of ours are a minute.
    const left_min = () => mock.printer.progress().remaining_s / 60;
    await until('what is left, in the printer\'s time', async () => {
      const [shown] = /^\d+(?= min$)/.exec(await text(page.locator('.job-progress dd').nth(1))) ?? [];
      return Math.abs(Number(shown) - left_min()) < 3;
    });
    const [hours, minutes] = (await page.locator('.job-progress dd').nth(2).textContent()).split(':').map(Number);
    const now = new Date();
    const ahead_min = (hours * 60 + minutes - now.getHours() * 60 - now.getMinutes() + 1440) % 1440;
    assert.ok(ahead_min <= 4, `ready in ${ahead_min} min of the wall's time, not in the printer's 38`);
  }));

test('a wrong key is explained in words, in the link and in the form', () =>
  inScene('idle', async ({ page, button }) => {
    assert.match(await text(page.getByRole('alert')), /not the key of this printer.*what follows “key=”/);
    await page.getByLabel('Key').fill('still-wrong');
    await button('Sign in').click();
    await until('an answer', async () => /not the key/.test(await text(page.getByRole('alert'))));
    assert.ok(!/401|Unauthorized/.test(await page.locator('body').innerText()));
    await page.getByLabel('Key').fill('mock');
    await button('Sign in').click();
    await page.getByTestId('state').waitFor();
  }, { key: 'wrong' }));

test('an upload shows what waits, its rate and its time, can be cancelled, and a refusal stays', () =>
  inScene('idle', async ({ mock, page, at, button }) => {
    mock.printer.gate.held = true;
    const network = await page.context().newCDPSession(page);
    await network.send('Network.enable');
    await network.send('Network.emulateNetworkConditions', { offline: false, latency: 0, downloadThroughput: -1, uploadThroughput: 20_000 });
    const big = Buffer.alloc(3_000_000, 'G1 X1\n');
    const file = (name, buffer) => ({ name, mimeType: 'text/plain', buffer });
    await page.setInputFiles('[data-testid=file]', [
      file('big.gcode', big), file('too-hot.gcode', Buffer.from('G28\nM104 S999\n')), file('later.gcode', Buffer.from('G28\n')), file('last.gcode', Buffer.from('G28\n')),
    ]);
    const row = (name) => at('upload').filter({ hasText: name });
    await until('a rate and the time that is left', async () => /B of 3\.0 MB · [\d.]+ [KM]?B\/s · .* left/.test(await text(row('big.gcode'))));
    assert.match(await text(row('later.gcode')), /Waits behind 2/);
    await button('Cancel the upload of later.gcode').click();
    // The line stays slow: a quick one might take the rest of it before the browser has ended it.
    await button('Cancel the upload of big.gcode').click();
    await row('too-hot.gcode').locator('.error').waitFor();
    assert.match(await text(row('too-hot.gcode')), /Not queued\. Line 2: .*999/);
    await at('job').filter({ hasText: 'last.gcode' }).waitFor();
    assert.deepEqual(await page.locator('[data-testid=job] .name').allTextContents(), ['last.gcode'], 'what was cancelled is no job');
    await until('the end of what is over', async () => (await at('upload').count()) === 1);
    await button('Dismiss too-hot.gcode').click();
    assert.equal(await at('upload').count(), 0);
  }));

test('a hundred thousand jobs are listed in pages, found by name and state, and their pictures wait until they are seen', () =>
  inScene('many', async ({ mock, page, at, requests, button }) => {
    await at('search').waitFor();
    assert.match(await text(page.locator('.queue h2')), /· 154 waiting/);
    assert.match(await text(page.locator('.queue h3')), /· 100.000/);
    assert.equal(await at('ended').count(), 50);
    await at('more').click();
    await until('a further page', async () => (await at('ended').count()) === 150);
    // A live message keeps what was asked for, without a hole or a double.
    await page.evaluate(() => { window.still = true; });
    mock.printer.jobs.splice(mock.printer.jobs.findIndex((each) => each.state === 'done'), 1);
    mock.printer.changed();
    await until('the deleted one gone', async () => (await at('ended').count()) === 149);
    const shown = await at('ended').evaluateAll((rows) => rows.map((each) => Number(each.dataset.job)));
    assert.equal(new Set(shown).size, shown.length);
    const truth = mock.printer.jobs.filter((each) => ['done', 'cancelled', 'failed'].includes(each.state)).slice(0, shown.length).map((each) => each.id);
    assert.deepEqual(shown, truth, 'the list is the printer\'s, in its order');

    await at('search').fill('hinge-777');
    await until('what is searched for', async () => (await page.locator('[data-testid=found-list] > li').count()) > 0);
    const names = await page.locator('[data-testid=found-list] .name').allTextContents();
    assert.ok(names.every((name) => name.includes('hinge-777')), String(names));
    await at('search').fill('');
    await at('states').selectOption('failed');
    await until('failed ones alone', async () => (await page.locator('[data-testid=found-list] > li').count()) === 100
      && (await page.locator('[data-testid=found-list] [data-state=failed]').count()) === 100);
    await at('more').click();
    await until('more failed ones', async () => (await page.locator('[data-testid=found-list] > li').count()) === 200);
    // On a busy computer the state is chosen before the page has drawn what was typed: both count.
    await page.evaluate(() => {
      const change = (id, value, kind) => {
        const field = document.querySelector(`[data-testid=${id}]`);
        field.value = value;
        field.dispatchEvent(new Event(kind, { bubbles: true }));
      };
      change('search', 'hinge-77', 'input');
      change('states', 'failed', 'change');
    });
    await until('what was typed at last, and failed', async () => {
      const found = await page.locator('[data-testid=found-list] .name').allTextContents();
      return found.length > 0 && found.every((name) => name.includes('hinge-77'));
    });
    assert.equal(await at('search').inputValue(), 'hinge-77');
    await at('search').fill('');
    await until('all failed ones again', async () => (await page.locator('[data-testid=found-list] > li').count()) === 100);
    await at('states').selectOption('');
    await button('Show 54 more that wait').click();
    await until('all that wait', async () => (await at('job').count()) >= 100);

    assert.ok(requests.some((each) => each.includes('q=hinge-777')) && requests.some((each) => /before=\d+/.test(each)));
    const typed = requests.filter((each) => /[?&]q=/.test(each)).length;
    assert.ok(typed < 'hinge-777'.length, `${typed} searches for one word: typing is not waited for`);
    const pictures = requests.filter((each) => each.includes('/thumbnail')).length;
    assert.ok(pictures < 150, `${pictures} thumbnails were loaded`);
  }));

/** What the worker has told of its drawing: {frames, anew, segments, whole}. */
const drawing = (at) => at('canvas').evaluate(({ dataset }) => ({ frames: Number(dataset.frames ?? 0), anew: Number(dataset.anew ?? 0), segments: Number(dataset.segments ?? 0), ghost: Number(dataset.ghost ?? 0), whole: dataset.whole === 'true' }));
const drawnWhole = (at, segments = 1) => until(`a picture of ${segments} segments that is whole`, async () => {
  const now = await drawing(at);
  return now.whole && now.segments >= segments;
});

test('a part of 140 mm is as bright as one of 20 mm, and one of short pieces, too', async () => {
  const bright = {};
  for (const scene of ['cube20', 'cube140', 'cube140-dense']) {
    await inScene(scene, async ({ page, at, mock }) => {
      await drawnWhole(at, mock.printer.part.layers.reduce((sum, layer) => sum + layer.segments, 0));
      const seen = await lookAt(page, at('canvas'));
      assert.ok(seen.warm > 10_000, `${scene} is hardly there: ${JSON.stringify(seen)}`);
      bright[scene] = seen.brightness;
    }, { viewport: PHONE, draws: true });
  }
  for (const scene of ['cube140', 'cube140-dense']) {
    const ratio = bright[scene] / bright.cube20;
    assert.ok(ratio > 0.96 && ratio < 1.04, `${scene} is ${ratio.toFixed(3)} times as bright as the small one: ${JSON.stringify(bright)}`);
  }
});

test('the part stands on the bed: its foot and the bed around it are darker', async () => {
  /** How dark the bed's ground is: its darkest hundredth over its lightest quarter; 1: alike. */
  const ground = async (page, at) => {
    return page.evaluate((drawing) => {
      const { width, height } = drawing.canvas;
      const { data } = drawing.getImageData(0, Math.round(height * 0.35), width - 60, Math.round(height * 0.5));
      const greys = [];
      for (let i = 0; i < data.length; i += 4) if (Math.max(data[i], data[i + 1], data[i + 2]) - Math.min(data[i], data[i + 1], data[i + 2]) < 20) greys.push(data[i + 1]);
      greys.sort((a, b) => a - b);
      return greys[Math.floor(greys.length / 100)] / greys[Math.floor(greys.length * 0.75)];
    }, await pictureOf(page, at('canvas')));
  };
  const seen = {};
  for (const scene of ['empty', 'cube20']) {
    await inScene(scene, async ({ page, at, mock }) => {
      if (scene !== 'empty') await drawnWhole(at, mock.printer.part.layers.reduce((sum, layer) => sum + layer.segments, 0));
      else await until('the empty bed', async () => (await drawing(at)).frames > 0);
      await settled(page, at);
      seen[scene] = await ground(page, at);
    }, { draws: true });
  }
  assert.ok(seen.empty > 0.75, `the empty bed is shaded: ${JSON.stringify(seen)}`);
  assert.ok(seen.cube20 < 0.75, `nothing stands on the bed: ${JSON.stringify(seen)}`);
});

test('a failed print is drawn to where it came, and no further', () =>
  inScene('held', async ({ page, at, mock }) => {
    const failed = mock.printer.jobs.find(({ state }) => state === 'failed');
    assert.ok(mock.printer.status().job === null, 'the machine speaks of it no more');
    Object.assign(failed, { stopped_line: null, stopped_layer: null }); // the byte alone is known
    await page.reload();
    const all = mock.printer.part.layers.reduce((sum, layer) => sum + layer.segments, 0);
    await until('all layers', async () => (await page.locator('.layer-slider input').getAttribute('max')) === '120');
    await drawnWhole(at);
    const { segments } = await drawing(at);
    assert.ok(segments > all * 0.4 && segments < all * 0.7, `${segments} of ${all} segments are drawn`);
    Object.assign(failed, { state: 'done' });
    mock.printer.changed();
    await drawnWhole(at, all);
  }, { viewport: PHONE, draws: true }));
/** Nothing is drawn any more, and that is told. `whole`: nothing waits to be drawn, either. */
async function settled(page, at, whole = true) {
  let last = null;
  await until('a picture that stays', async () => {
    const now = await drawing(at);
    const same = last !== null && (now.whole || !whole) && now.frames === last.frames;
    last = now;
    await page.waitForTimeout(600);
    return same;
  });
}

test('the part to come is seen from the first second, pale, and gone where it is laid down', () =>
  inScene('heating', async ({ mock, at, page }) => {
    await until('a ghost', async () => {
      const now = await drawing(at);
      return now.whole && now.segments === 0 && now.ghost > 500;
    });
    const pale = await lookAt(page, at('canvas'));
    assert.ok(pale.colours > 100, `${pale.colours} colours: nothing is seen`);
    mock.printer.finish('done');
    await until('no ghost of a finished part', async () => {
      const now = await drawing(at);
      return now.whole && now.segments > 500 && now.ghost === 0;
    });
    assert.ok((await lookAt(page, at('canvas'))).warm > 2 * pale.warm);
  }, { draws: true }));

/** Counts what a page asks its own thread to draw in 3D. */
const countContexts = (page) => page.addInitScript(() => {
  globalThis.contexts = [];
  for (const of of [HTMLCanvasElement, globalThis.OffscreenCanvas]) {
    const { getContext } = of.prototype;
    of.prototype.getContext = function (kind, ...rest) {
      globalThis.contexts.push(kind);
      return getContext.call(this, kind, ...rest);
    };
  }
});

test('the part is drawn by a worker, only what is new, and nothing that nobody sees', () =>
  inScene('printing', async ({ page, mock, at }) => {
    await drawnWhole(at);
    const contexts = await page.evaluate(() => globalThis.contexts);
    assert.deepEqual(contexts.filter((kind) => kind !== '2d'), [], 'the page itself draws in 3D');
    assert.ok(page.workers().length === 1 && (await page.workers()[0].evaluate(() => typeof document)) === 'undefined');
    const before = await drawing(at);
    await until('new beads', async () => (await drawing(at)).segments > before.segments + 20);
    await drawnWhole(at);
    const later = await drawing(at);
    assert.ok(later.frames > before.frames);
    assert.equal(later.anew, before.anew, 'old beads were drawn again, too');

    // Out of sight: the print goes on, and nothing is drawn.
    await page.setViewportSize({ width: 700, height: 400 });
    await page.evaluate(() => scrollTo(0, document.documentElement.scrollHeight));
    await settled(page, at, false);
    const still = await drawing(at);
    const { executed } = mock.printer;
    await until('a print that goes on', async () => mock.printer.executed > executed + 5000);
    assert.deepEqual(await drawing(at), still);
    await page.evaluate(() => scrollTo(0, 0));
    await until('the beads that came meanwhile', async () => (await drawing(at)).segments > still.segments);
  }, { draws: true, begin: countContexts }));

test('the part fills its stage in every size, and is turned, zoomed and shown again by keys', () =>
  inScene('cube20', async ({ page, at }) => {
    const sees = async (what) => {
      await until(what, async () => {
        const { left, right, top, bottom } = (await lookAt(page, at('canvas'), { right: 60, bottom: 80 })).box;
        return (right - left > 0.5 || bottom - top > 0.5) && left > 0 && right < 1 && top > 0;
      });
      return lookAt(page, at('canvas'));
    };
    await drawnWhole(at);
    const first = await sees('a cube that fills the stage');
    await page.setViewportSize(NARROW);
    await sees('one that fills a narrow stage');
    await page.setViewportSize(DESKTOP);
    await sees('one that fills the stage again');
    await at('canvas').focus();
    const changes = async (key) => {
      await settled(page, at);
      const before = (await drawing(at)).frames;
      const was = await lookAt(page, at('canvas'));
      await page.keyboard.press(key);
      await until(`a picture that ${key} has changed`, async () => (await drawing(at)).frames > before && (await drawing(at)).whole);
      await settled(page, at);
      const now = await lookAt(page, at('canvas'));
      assert.notEqual(now.warm, was.warm, `${key} changes nothing`);
      return now;
    };
    await changes('ArrowLeft');
    await changes('ArrowUp');
    const near = await changes('+');
    const far = await changes('-');
    assert.ok(far.warm < near.warm);
    const again = await changes('Home');
    assert.ok(Math.abs(again.warm / first.warm - 1) < 0.05, `${again.warm} and not ${first.warm} warm pixels`);
  }, { draws: true }));

test('a browser without WebGL shows a still picture, and says why', () =>
  inScene('printing', async ({ page, at }) => {
    await at('running').waitFor();
    await at('flat').waitFor();
    assert.match(await text(at('flat')), /WebGL is not available.*still picture/);
    await until('a picture', async () => (await lookAt(page, at('canvas'))).warm > 500);
  }));

test('a browser that gives no canvas to a worker shows the still picture as well', () =>
  inScene('printing', async ({ page, at }) => {
    await at('flat').waitFor();
    await until('a picture', async () => (await lookAt(page, at('canvas'))).warm > 500);
    assert.deepEqual((await page.evaluate(() => globalThis.contexts)).filter((kind) => kind !== '2d'), []);
  }, {
    draws: true,
    begin: async (page) => {
      await countContexts(page);
      await page.addInitScript(() => { delete HTMLCanvasElement.prototype.transferControlToOffscreen; });
    },
  }));

test('an open question neither covers the emergency stop nor keeps the keyboard from it', () =>
  inScene('printing', async ({ page, mock, at, button }) => {
    for (const viewport of [DESKTOP, PHONE, { width: 360, height: 420 }]) {
      await page.setViewportSize(viewport);
      await button('Cancel').click();
      await at('ask').waitFor();
      const stop = await button('Emergency stop').boundingBox();
      for (const [across, down] of [[0.1, 0.1], [0.5, 0.5], [0.9, 0.9]]) {
        const there = await page.evaluate(([x, y]) => document.elementFromPoint(x, y)?.textContent, [stop.x + across * stop.width, stop.y + down * stop.height]);
        assert.equal(there, 'Emergency stop', 'something lies on it');
      }
      // axe cannot tell what lies behind text in several lines, so only the wide page is asked.
      if (viewport === DESKTOP) assert.deepEqual(await findings(page), []);
      await page.keyboard.press('Escape');
      await until('no question', async () => (await at('ask').count()) === 0);
    }
    await button('Cancel').click();
    await at('ask').waitFor();
    const focused = () => page.evaluate(() => document.activeElement.textContent);
    assert.equal(await focused(), 'No, keep it');
    await page.keyboard.press('Shift+Tab');
    assert.equal(await focused(), 'Emergency stop', 'one key before the question');
    await page.keyboard.press('Enter');
    await until('a confirmation', async () => (await at('stop').getAttribute('data-phase')) === 'confirmed');
    assert.equal(mock.printer.state, 'faulted');
    assert.equal(await at('ask').count(), 0, 'its subject has ended');
    assert.match(await text(at('stop')), /Stopped, confirmed/);
    await button('Clear fault').click();
    await until('an end of the good news', async () => (await at('stop').count()) === 0);
  }));

test('a question whose print has ended closes, and asks for nothing', () =>
  inScene('printing', async ({ mock, at, button, requests }) => {
    await button('Cancel').click();
    await at('ask').waitFor();
    mock.printer.finish('done');
    await until('no question', async () => (await at('ask').count()) === 0);
    assert.ok(!requests.includes('POST /api/v1/machine/cancel'));
  }));

test('a silent service is said, its values are grey, and only the stop can be pressed', () =>
  inScene('printing', async ({ page, mock, at, button }) => {
    await at('running').waitFor();
    await until('controls', () => button('Pause').isEnabled());
    const bright = await at('hot-end').evaluate((e) => getComputedStyle(e).color);
    mock.mute(true);
    await at('silent').waitFor();
    assert.match(await text(at('silent')), /^No news for \d+ s$/);
    assert.match(await text(at('as-of').first()), /^as of \d\d:\d\d:\d\d$/);
    assert.notEqual(await at('hot-end').evaluate((e) => getComputedStyle(e).color), bright);
    for (const name of ['Pause', 'Cancel', 'Hot end off', 'Choose files']) assert.ok(await button(name).isDisabled(), `${name} can be pressed`);
    for (const colorScheme of ['light', 'dark']) {
      await page.emulateMedia({ colorScheme, reducedMotion: 'reduce' });
      assert.deepEqual(await findings(page), [], colorScheme);
    }
    await button('Emergency stop').click();
    await until('a word that it is not confirmed', async () => (await at('stop').getAttribute('data-phase')) === 'unconfirmed');
    assert.match(await text(at('stop')), /NOT confirmed: cut the power/);
    for (const colorScheme of ['light', 'dark']) {
      await page.emulateMedia({ colorScheme, reducedMotion: 'reduce' });
      assert.deepEqual(await findings(page), [], colorScheme);
    }
    mock.mute(false);
    await until('a confirmation', async () => (await at('stop').getAttribute('data-phase')) === 'confirmed');
    await until('news', async () => (await at('silent').count()) === 0 && (await at('as-of').count()) === 0);
    assert.ok(await button('Clear fault').isEnabled());
    assert.equal(mock.printer.state, 'faulted');
  }));

test('a refusal ends with its cause', () =>
  inScene('printing', async ({ page, mock, at, button }) => {
    await page.route('**/machine/pause', (route) => route.fulfill({ status: 409, json: { error: { code: 'x', message: 'nothing is printing' } } }));
    await button('Pause').click();
    await at('refusal').waitFor();
    mock.printer.finish('done');
    mock.printer.gate.bed_occupied = false;
    await at('running').waitFor();
    await until('no refusal', async () => (await at('refusal').count()) === 0);
  }));

test('what is guaranteed is as of now', () =>
  inScene('idle', async ({ at, mock }) => {
    const rows = at('loops').locator('tbody tr');
    await until('the loops', async () => (await rows.count()) === 3);
    assert.equal(await text(rows.nth(0).locator('td').last()), '✓');
    assert.match(await text(rows.nth(0)), /20 %/);
    mock.printer.late = 3;
    await until('the late releases', async () => (await text(rows.nth(0).locator('td').last())) === '3 late');
    assert.equal(await text(rows.nth(1).locator('td').last()), '–', 'loop 2 has no periods');
    const chains = at('chains').locator('tbody tr');
    assert.equal(await chains.count(), 2);
    assert.match(await text(chains.nth(0)), /thermistors to heaters.*17.0 ms of 15.6 ms.*640 µs of 7.60 ms/);
    assert.equal(await chains.nth(0).locator('td.bad').count(), 1, 'a reaction beyond its bound is marked');
    assert.match(await text(chains.nth(1)), /emergency byte to pins.*loop 2.*– of 32.4 ms–/);
  }));

// Every state with something of its own on the page; a new page for each of them, and both colour
// schemes on it.
for (const scene of ['heating', 'finished', 'paused-off', 'stuck-fault', 'held', 'bed', 'no-confirm', 'idle-warning', 'idle-never', 'unhomed', 'simulated', 'disconnected']) {
  test(`axe finds nothing: ${scene}`, () => inScene(scene, async ({ page, at, button }) => {
    await at('state').waitFor();
    if (scene === 'stuck-fault') {
      await drop(page, 'too-hot.gcode', Buffer.from('G28\nM104 S999\n'));
      await at('upload').waitFor();
      await button('Clear fault').click();
      await at('refusal').waitFor();
    }
    for (const summary of await page.locator('summary').all()) await summary.click();
    await page.evaluate(() => scrollTo(0, 0));
    assert.equal(await page.locator('h1').count(), 1);
    for (const colorScheme of ['light', 'dark']) {
      await page.emulateMedia({ colorScheme, reducedMotion: 'reduce' });
      assert.deepEqual(await findings(page), [], colorScheme);
    }
  }, { draws: scene === 'paused-off' })); // text above the picture
}

test('axe finds nothing: on a phone, and where the key is asked for', async () => {
  await inScene('paused', async ({ page, at }) => {
    await at('pause-note').waitFor();
    assert.deepEqual(await findings(page), []);
    assert.ok((await page.evaluate(() => document.documentElement.scrollWidth)) <= PHONE.width);
  }, { viewport: PHONE });
  await inScene('idle', async ({ page }) => {
    await page.getByRole('alert').waitFor();
    for (const colorScheme of ['light', 'dark']) {
      await page.emulateMedia({ colorScheme });
      assert.deepEqual(await findings(page), [], colorScheme);
    }
  }, { key: 'wrong' });
});

/** The plotter's files, as `qduino monitor --plot` serves them; `say` sends a line of Serial. */
async function startPlotter() {
  const files = { '/': ['page.html', 'text/html'], '/series.js': ['series.js', 'text/javascript'] };
  const streams = [];
  const server = createServer(async ({ url }, answer) => {
    const [name, type] = files[url] ?? [];
    answer.writeHead(200, { 'Content-Type': type ?? 'text/event-stream' });
    if (name) answer.end(await readFile(new URL(`../../../qduino/monitor/plotter/${name}`, import.meta.url)));
    else streams.push(answer.write(': open\n\n') && answer);
  });
  await new Promise((ready) => { server.listen(0, '127.0.0.1', ready); });
  const say = (line) => streams.forEach((stream) => stream.write(`data: ${JSON.stringify(line)}\n\n`));
  return { address: `http://127.0.0.1:${server.address().port}/`, streams, say, close: () => { server.closeAllConnections(); server.close(); } };
}

test('the plotter draws what a sketch prints, pauses, goes on, and axe finds nothing', async () => {
  const plotter = await startPlotter();
  const context = await browsers.plain.newContext({ viewport: PHONE });
  const page = await context.newPage();
  page.setDefaultTimeout(PATIENCE_MS);
  const button = (name) => page.getByRole('button', { name, exact: true });
  const legend = () => text(page.locator('#legend'));
  const drawn = () => page.evaluate(() => document.getElementById('chart').getContext('2d').getImageData(0, 0, 300, 300).data.some((byte) => byte !== 0));
  try {
    for (const colorScheme of ['light', 'dark']) {
      await page.emulateMedia({ colorScheme });
      await page.goto(plotter.address);
      await page.getByText('No numbers have come yet.').waitFor();
      await until('the stream', () => plotter.streams.length > 0 && page.getByText('live').isVisible());
      assert.equal(await drawn(), false);
      ['hello', 'in:1,out:-2', 'in:2.5 out:4'].forEach(plotter.say);
      await until('two curves', async () => (await legend()) === 'in: 2.5out: 4');
      assert.equal(await drawn(), true);
      assert.deepEqual(await findings(page), [], colorScheme);
      await button('Pause').click();
      plotter.say('in:7 out:8');
      await until('the pause', async () => (await text(page.locator('#state'))) === 'paused');
      assert.equal(await legend(), 'in: 2.5out: 4');
      await button('Go on').click();
      await until('the line that came meanwhile', async () => (await legend()) === 'in: 7out: 8');
      await button('Clear').click();
      await page.getByText('No numbers have come yet.').waitFor();
      plotter.streams.splice(0).forEach((stream) => stream.end());
    }
    assert.ok((await page.evaluate(() => document.documentElement.scrollWidth)) <= PHONE.width);
  } finally {
    await context.close();
    plotter.close();
  }
});
