#!/usr/bin/env bash
# Builds the browser side into web/ui/dist when it is older than its sources.
set -euo pipefail
cd "$(dirname "$0")/../web/ui"
stamp=node_modules/.installed
if [ ! -e "$stamp" ] || [ package-lock.json -nt "$stamp" ]; then
  # The lock file names the optional packages of the platform it was made on; npm ci refuses it on some versions of npm
  # for those of other platforms, and an ordinary install then takes the same versions.
  npm ci --no-audit --no-fund --loglevel=silent || npm install --no-save --no-audit --no-fund --loglevel=error
  touch "$stamp"
fi
if [ ! -e dist/index.html ] ||
   [ -n "$(find . -path ./node_modules -prune -o -path ./dist -prune -o -type f -newer dist/index.html -print -quit)" ]; then
  npm run --silent build
fi
echo "page: $(du -sk dist | cut -f1) KB in web/ui/dist"
