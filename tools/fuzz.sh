#!/usr/bin/env bash
# Runs every fuzz target of build/fuzz/fuzz for SECONDS each, one per core at a time. A finding is
# kept in build/fuzz/findings.
#
#   tools/fuzz.sh SECONDS [TARGET…]
set -euo pipefail
cd "$(dirname "$0")/.."
seconds=${1:?seconds per target}; shift
programs=build/fuzz/fuzz
mkdir -p build/fuzz/findings build/fuzz/corpus
targets=("$@")
[ ${#targets[@]} -gt 0 ] || mapfile -t targets < <(cd "$programs" && ls)
[ ${#targets[@]} -gt 0 ] || { echo "no fuzz targets in $programs: build the preset 'fuzz' first"; exit 1; }

run_one() {
  local target=$1 seconds=$2 seeds
  seeds=$(find tests/fuzz -type d -path "*/corpus/$target" | head -n 1)
  mkdir -p "build/fuzz/corpus/$target"
  if "build/fuzz/fuzz/$target" -max_total_time="$seconds" -timeout=10 -rss_limit_mb=2048 -print_final_stats=1 \
      -artifact_prefix="build/fuzz/findings/$target-" "build/fuzz/corpus/$target" ${seeds:+"$seeds"} \
      >"build/fuzz/findings/$target.log" 2>&1; then
    printf '%-26s %s\n' "$target" "$(grep -o 'number_of_executed_units: .*' "build/fuzz/findings/$target.log")"
  else
    printf '%-26s FOUND SOMETHING\n' "$target"
    tail -n 40 "build/fuzz/findings/$target.log"
    return 1
  fi
}
export -f run_one
printf '%s\n' "${targets[@]}" | xargs -P "$(nproc)" -I{} bash -c 'run_one {} '"$seconds"
