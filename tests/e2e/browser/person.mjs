// A person in front of the page, for every test that drives a browser: drops files, looks at the
// canvas, and has the page read by axe-core, which finds the obstacles for people who see or hear
// less.
import { readFile } from 'node:fs/promises';
import { join } from 'node:path';
import { ROOT } from './stack.mjs';

/** As a file manager does it: the events of a drop, with the file in them. */
export async function drop(page, name, bytes) {
  const data = await page.evaluateHandle(({ name, text }) => {
    const transfer = new DataTransfer();
    transfer.items.add(new File([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))], name));
    return transfer;
  }, { name, text: bytes.toString('base64') });
  const zone = page.getByTestId('drop');
  await zone.dispatchEvent('dragover', { dataTransfer: data });
  await zone.dispatchEvent('drop', { dataTransfer: data });
}

/** A copy of the canvas as the browser composes it, in the page: its pixels can be read. */
export async function pictureOf(page, canvas) {
  const png = (await canvas.screenshot()).toString('base64');
  return page.evaluateHandle(async (png) => {
    const image = new Image();
    image.src = `data:image/png;base64,${png}`;
    await image.decode();
    const copy = Object.assign(document.createElement('canvas'), { width: image.width, height: image.height });
    const drawing = copy.getContext('2d');
    drawing.drawImage(image, 0, 0);
    return drawing;
  }, png);
}

/**
 * The canvas as the browser composes it: how many colours it has, how many pixels are the part's
 * warm ones (the bed and the ground are grey or blue), the mean brightness of those, 0 to 255
 * (Rec. 709), and their edges in parts of its width and height. `but`: pixels at the right and at
 * the bottom that are not looked at, for the slider and the legend are warm as well.
 */
export async function lookAt(page, canvas, but = { right: 0, bottom: 0 }) {
  return page.evaluate(({ drawing, but }) => {
    const copy = drawing.canvas;
    const bytes = drawing.getImageData(0, 0, copy.width, copy.height).data;
    let warm = 0;
    let light = 0;
    const box = { left: 1, right: 0, top: 1, bottom: 0 };
    for (let i = 0; i < bytes.length; i += 4) {
      const [x, y] = [(i / 4) % copy.width, Math.floor(i / 4 / copy.width)];
      if (bytes[i] <= bytes[i + 2] + 60 || x >= copy.width - but.right || y >= copy.height - but.bottom) continue;
      box.left = Math.min(box.left, x / copy.width);
      box.right = Math.max(box.right, x / copy.width);
      box.top = Math.min(box.top, y / copy.height);
      box.bottom = Math.max(box.bottom, y / copy.height);
      warm++;
      light += 0.2126 * bytes[i] + 0.7152 * bytes[i + 1] + 0.0722 * bytes[i + 2];
    }
    return { colours: new Set(new Uint32Array(bytes.buffer)).size, warm, box, brightness: warm > 0 ? light / warm : 0 };
  }, { drawing: await pictureOf(page, canvas), but });
}

/**
 * What axe-core finds on the page as it is now, with the element that it is about; no finding: an
 * empty list. Text whose background it cannot tell is a finding too: it lies on a picture, where
 * nobody knows that it can be read.
 */
export async function findings(page) {
  await page.evaluate(await readFile(join(ROOT, 'web/ui/node_modules/axe-core/axe.min.js'), 'utf8'));
  return page.evaluate(async () => {
    // Colours that are on their way to others (a theme that was changed, a button that was pressed)
    // are nobody's choice.
    await new Promise((drawn) => { requestAnimationFrame(() => requestAnimationFrame(drawn)); });
    const ends = document.getAnimations().filter(({ effect }) => Number.isFinite(effect?.getComputedTiming().endTime));
    await Promise.allSettled(ends.map(({ finished }) => finished));
    const { violations, incomplete } = await globalThis.axe.run(document, { resultTypes: ['violations', 'incomplete'] });
    const unknown = incomplete.filter(({ id }) => id === 'color-contrast')
      .map((rule) => ({ ...rule, nodes: rule.nodes.filter(({ any }) => !/non-text/.test(any[0]?.message ?? '')) }));
    return [...violations, ...unknown].flatMap(({ id, nodes }) => nodes.map(({ html, any }) => `${id}: ${any[0]?.message ?? ''}: ${html.slice(0, 120)}`));
  });
}
