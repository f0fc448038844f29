import { defineConfig } from 'vite';

// The page runs under a strict Content-Security-Policy: nothing inline, nothing from elsewhere.
// Addresses are relative: the page may stand below a prefix of a proxy (docs/reach.md).
export default defineConfig({
  base: './',
  esbuild: { jsx: 'automatic', jsxImportSource: 'preact' },
  worker: { format: 'es' },
  build: { target: 'es2020', assetsInlineLimit: 0, modulePreload: { polyfill: false }, chunkSizeWarningLimit: 900 },
  server: { proxy: { '/api': { target: process.env.PRINTD ?? 'http://127.0.0.1:8080', ws: true } } },
});
