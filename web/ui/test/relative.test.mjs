// The page may stand below any path of a proxy (docs/reach.md): it names nothing from the root of
// its host.
import { readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { expect, test } from 'vitest';

const folder = fileURLToPath(new URL('../', import.meta.url));
const sources = ['index.html', ...readdirSync(join(folder, 'src'), { recursive: true }).map((name) => join('src', String(name)))]
  .filter((name) => /\.(tsx?|css|html)$/.test(name));

test.each(sources)('%s names nothing from the root of its host', (name) => {
  // Vite takes this one for a file of its own.
  const text = readFileSync(join(folder, name), 'utf8').replace('src="/src/main.tsx"', '');
  expect(text.match(/['"`(]\/(api|assets|icon|src)\b[^'"`)]*/g) ?? []).toEqual([]);
});
