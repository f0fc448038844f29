// A person behind a proxy: opens the page below its path, and watches the printer live.
//
//   node behind.mjs ADDRESS
import assert from 'node:assert/strict';
import { startBrowser, whatThePageMisses } from '../browser/stack.mjs';

const [address] = process.argv.slice(2);
const missing = whatThePageMisses();
if (missing) {
  console.log(`skipped: ${missing}`);
  process.exit(77);
}

const browser = await startBrowser({ more: ['--host-resolver-rules=MAP * 127.0.0.1'] });
try {
  const context = await browser.newContext({ ignoreHTTPSErrors: true });
  const page = await context.newPage();
  page.setDefaultTimeout(40_000);
  const asked = [];
  page.on('request', (request) => asked.push(request.url()));
  page.on('websocket', (socket) => asked.push(socket.url().replace('wss:', 'https:')));
  await page.goto(address);
  await page.getByTestId('state').getByText('Ready').waitFor(); // the live stream says so
  const { origin, pathname } = new URL(address);
  assert.ok(asked.some((url) => url.endsWith('/api/v1/live')), asked.join('\n'));
  assert.deepEqual(asked.filter((url) => !url.startsWith(origin + pathname) && !url.startsWith('data:') && !url.startsWith('blob:')), []);
  const [cookie] = await context.cookies();
  assert.deepEqual([cookie.secure, cookie.path], [true, pathname]);
  await page.getByTestId('phone').click();
  assert.ok((await page.getByTestId('phone-address').textContent()).startsWith(`${origin}${pathname}#ticket=`));
} finally {
  await browser.close();
}
