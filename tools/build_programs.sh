#!/usr/bin/env bash
# Installs what is missing, and builds the page and programs, with a line of progress.
#
#   tools/build_programs.sh [TARGET…]     without one: all programs that ./install installs
set -uo pipefail
cd "$(dirname "$0")/.."
. tools/dependencies.sh

need build web run || exit 1
mkdir -p build

# Its lines are the progress's (tools/build_progress.py). Returns 2, 3 or 4: what could not be made.
build_all() {
  # The page takes one core, and so does cmake.
  tools/build_page.sh >build/page.log 2>&1 &
  local page=$!
  echo "== preparing"
  cmake --preset release >build/release.configure.log 2>&1 || return 2
  # All steps, for the progress. (A dry run would tell of none: it takes cmake for the first.)
  ninja -C build/release -t commands "$@" 2>/dev/null | sed 's/^/plan /'
  cmake --build --preset release --target "$@" 2>&1 | tee build/release.build.log || return 3
  echo "== the page"
  wait "$page" || return 4
}

build_all "${@:-printer-programs}" | python3 -B tools/build_progress.py
status=${PIPESTATUS[0]}
case $status in
  0) ;;
  2) tail -20 build/release.configure.log; say "the build could not be prepared: build/release.configure.log has it all" ;;
  3) grep -E -A12 'error|FAILED|undefined' build/release.build.log | head -40; say "the build failed: build/release.build.log has it all" ;;
  4) tail -20 build/page.log; say "the page could not be built: build/page.log has it all" ;;
  *) say "the build was interrupted" ;;
esac
exit "$status"
