// Takes pictures of the page in every state, at two sizes and in both colour schemes: `node
// mock/look.mjs FOLDER [scene…]`.
import { mkdir } from 'node:fs/promises';
import { chromium } from 'playwright-core';
import { startMock } from './server.mjs';

const SCENES = ['empty', 'heating', 'printing', 'finished', 'queue30', 'paused', 'paused-off', 'faulted', 'stuck-fault', 'held', 'bed', 'no-confirm', 'idle-warning', 'idle-hint', 'idle-off',
  'idle-never', 'unhomed', 'simulated', 'many', 'disconnected', 'upload-error', 'wrong-key'];
const SIZES = {
  tablet: { width: 820, height: 1180 }, desktop: { width: 1440, height: 900 }, phone: { width: 390, height: 844 } };
const [folder = 'look', ...wanted] = process.argv.slice(2);
await mkdir(folder, { recursive: true });

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
  args: ['--headless=new', '--no-sandbox', '--disable-gpu', '--enable-unsafe-swiftshader', '--use-angle=swiftshader', '--disable-quic',
    '--no-first-run', '--disable-background-networking', '--disable-component-update', '--disable-sync'],
});
for (const scene of wanted.length ? wanted : SCENES) {
  const mock = await startMock({ scene: ['upload-error', 'wrong-key'].includes(scene) ? 'idle' : scene });
  for (const [size, viewport] of Object.entries(SIZES)) {
    for (const colorScheme of ['light', 'dark']) {
      const page = await browser.newPage({ viewport, colorScheme, isMobile: size === 'phone', hasTouch: size === 'phone' });
      page.on('console', (message) => ['error', 'warning'].includes(message.type()) && !/GPU stall|401/.test(message.text()) && console.log(scene, size, message.text()));
      page.on('pageerror', (error) => console.log(scene, size, String(error)));
      await page.goto(scene === 'wrong-key' ? mock.address.replace(/key=.*/, 'key=wrong') : mock.address);
      if (scene === 'upload-error') {
        await page.setInputFiles('[data-testid=file]', { name: 'too-hot.gcode', mimeType: 'text/plain', buffer: Buffer.from('G28\nM104 S999\n') });
      }
      if (scene === 'stuck-fault') await page.getByRole('button', { name: 'Clear fault' }).click();
      await page.waitForTimeout(scene === 'wrong-key' ? 500 : 2500);
      const wide = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
      if (wide > 0) console.log(`${scene} ${size}: ${wide} px too wide`);
      await page.screenshot({ path: `${folder}/${scene}-${size}-${colorScheme}.png`, fullPage: true });
      await page.close();
    }
  }
  mock.close();
}
await browser.close();
