// A person at another computer: opens the printed address in Chromium, uploads a part, prints it,
// and invites a phone, which is another browser.
//
//   node visitor.mjs ADDRESS PART PICTURE
import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { setTimeout } from 'node:timers/promises';
import { drop } from '../browser/person.mjs';
import { startBrowser, whatThePageMisses } from '../browser/stack.mjs';

const [address, part, picture] = process.argv.slice(2);
const missing = whatThePageMisses();
if (missing) {
  console.log(`skipped: ${missing}`);
  process.exit(77);
}

const browser = await startBrowser();
try {
  // A person accepts the certificate after a look at its fingerprint.
  const context = await browser.newContext({ viewport: { width: 1280, height: 800 }, ignoreHTTPSErrors: true });
  const page = await context.newPage();
  page.setDefaultTimeout(60_000);
  await page.goto(address);
  await page.getByTestId('state').getByText('Ready').waitFor();
  assert.equal(new URL(page.url()).hash, '', 'the key has left the address bar');
  const [cookie] = await context.cookies();
  assert.deepEqual([cookie.secure, cookie.httpOnly, cookie.sameSite], [true, true, 'Strict']);

  await drop(page, 'part.gcode', await readFile(part));
  const stateOfJob = () => page.evaluate(async () => (await (await fetch('api/v1/jobs')).json()).jobs[0]?.state);
  const ENDED = ['done', 'failed', 'cancelled'];
  let state = null;
  for (const end = Date.now() + 150_000; !ENDED.includes(state) && Date.now() < end;) {
    await setTimeout(500);
    state = await stateOfJob();
  }
  assert.equal(state, 'done');
  await page.getByText('part.gcode').first().waitFor();

  await page.getByTestId('phone').click();
  const link = await page.getByTestId('phone-address').textContent();
  assert.ok(link.startsWith(`${new URL(address).origin}/#ticket=`), link);
  await page.locator('.phone').screenshot({ path: picture });
  assert.ok(await page.getByRole('button', { name: 'Emergency stop' }).isEnabled());
  await page.getByRole('button', { name: 'Emergency stop' }).click({ trial: true });

  const phone = await browser.newContext({ viewport: { width: 390, height: 844 }, ignoreHTTPSErrors: true });
  const there = await phone.newPage();
  await there.goto(link);
  await there.getByTestId('state').getByText('Ready').waitFor();
  const late = await (await browser.newContext({ ignoreHTTPSErrors: true })).newPage();
  await late.goto(link);
  await late.getByRole('alert').getByText('used already').waitFor();
  console.log(`printed, and invited with ${link.replace(/=.*/, '=…')}`);
} finally {
  await browser.close();
}
