#!/usr/bin/env bash
# Installs what is missing, and builds the page and programs, with a line of progress.
#
#   tools/build_programs.sh [TARGET…]     without one: all programs that ./install installs
set -euo pipefail
cd "$(dirname "$0")/.."
. tools/dependencies.sh

need build web run
mkdir -p build
say "Building (the first time takes a few minutes) …"
# The page takes one core, and so does cmake.
tools/build_page.sh >build/page.log 2>&1 &
page=$!
cmake --preset release >build/release.configure.log 2>&1 || { tail -20 build/release.configure.log; exit 1; }
progress() { grep -E --line-buffered '^\[[0-9]+/[0-9]+\]' | sed -u 's/\] .*/]/' | tr '\n' '\r' >&2 || true; }
cmake --build --preset release --target "${@:-printer-programs}" 2>&1 | tee build/release.build.log | progress ||
  { grep -E -A12 'error|FAILED|undefined' build/release.build.log | head -40; say "the build failed: build/release.build.log has it all"; exit 1; }
wait "$page" || { tail -20 build/page.log; say "the page could not be built: build/page.log has it all"; exit 1; }
say ""
