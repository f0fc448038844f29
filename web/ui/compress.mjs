// Puts app.js.gz and app.js.br beside each file of the built page that gets smaller by it. The
// service only chooses among them (web/http/static_files.h), so it needs neither time nor a library
// for compression.
//
//   node compress.mjs [FOLDER]      default: dist
import { readFileSync, readdirSync, statSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { brotliCompressSync, constants, gzipSync } from 'node:zlib';

const SMALL = 512; // bytes: below, the answer's head is longer than what is saved
const folder = process.argv[2] ?? fileURLToPath(new URL('dist/', import.meta.url));

const brotli = (bytes) => brotliCompressSync(bytes, {
  params: { [constants.BROTLI_PARAM_QUALITY]: constants.BROTLI_MAX_QUALITY, [constants.BROTLI_PARAM_SIZE_HINT]: bytes.length },
});
const codings = { '.gz': (bytes) => gzipSync(bytes, { level: constants.Z_BEST_COMPRESSION }), '.br': brotli };

function filesBelow(path) {
  return readdirSync(path, { withFileTypes: true }).flatMap((entry) => {
    const below = join(path, entry.name);
    return entry.isDirectory() ? filesBelow(below) : entry.isFile() ? [below] : [];
  });
}

const files = filesBelow(folder).filter((file) => !(/\.(gz|br)$/.test(file)) && statSync(file).size >= SMALL);
const totals = { plain: 0, '.gz': 0, '.br': 0 };
for (const file of files) {
  const bytes = readFileSync(file);
  totals.plain += bytes.length;
  for (const [ending, coded] of Object.entries(codings)) {
    const smaller = coded(bytes);
    const helps = smaller.length < bytes.length * 0.95;
    if (helps) writeFileSync(file + ending, smaller);
    totals[ending] += helps ? smaller.length : bytes.length;
  }
}
const kilobytes = (bytes) => Math.round(bytes / 1000);
console.log(`page as sent: ${kilobytes(totals.plain)} kB, ${kilobytes(totals['.gz'])} kB as gzip, ${kilobytes(totals['.br'])} kB as brotli`);
