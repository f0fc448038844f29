#!/usr/bin/env bash
# Builds the browser side into web/ui/dist when it is older than its sources; each file also as gzip
# and brotli.
set -euo pipefail
cd "$(dirname "$0")/../web/ui"
stamp=node_modules/.installed
if [ ! -e "$stamp" ] || [ package-lock.json -nt "$stamp" ]; then
  npm ci --no-audit --no-fund --loglevel=error
  touch "$stamp"
fi
if [ ! -e dist/index.html ] ||
   [ -n "$(find . -path ./node_modules -prune -o -path ./dist -prune -o -type f -newer dist/index.html -print -quit)" ]; then
  npm run --silent build
fi
echo "page: $(du -sk dist | cut -f1) KB in web/ui/dist"
