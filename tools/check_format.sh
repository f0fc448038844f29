#!/usr/bin/env bash
# Checks that every C++ file is as clang-format 14 writes it. `tools/check_format.sh --fix` rewrites
# those that are not.
#
# clang-format leaves comments alone (ReflowComments: false): it cannot tell a paragraph from a
# drawing or a table of this project, and tears them. tools/check_prose.py holds comments to 100
# columns instead.
set -euo pipefail
cd "$(dirname "$0")/.."
command -v clang-format-14 >/dev/null || { echo "clang-format-14 is missing: apt-get install clang-format-14"; exit 1; }
mapfile -t files < <(git ls-files -co --exclude-standard '*.h' '*.cpp' ':!*/third_party/*' | while read -r f; do [ -f "$f" ] && echo "$f"; done)
if [ "${1:-}" = "--fix" ]; then
  clang-format-14 -i "${files[@]}"
else
  clang-format-14 --dry-run --Werror "${files[@]}"
fi
echo "format: ${#files[@]} files"
