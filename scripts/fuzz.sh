#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Fuzzes every decoder of bytes from outside, one after the other, and reports how many inputs there were: the long form
# of the tests fuzz/TARGET, with mutations that CI has not seen. Stops at the first failing input, which is then in a
# file here.
#   scripts/fuzz.sh TUTTI_FUZZ SECONDS SEED     seconds of CPU for each target; docs/results/robustness.md
set -euo pipefail
[ $# -eq 3 ] || {
  echo "usage: $0 BUILD/tests/tutti_fuzz SECONDS SEED" >&2
  exit 2
}
corpus="$(cd "$(dirname "${BASH_SOURCE[0]}")/../tests/fuzz/corpus" && pwd)"
all=0
for folder in "$corpus"/*/; do
  said="$("$1" "$(basename "$folder")" "$2" "$corpus" "$3")"
  echo "$said"
  inputs="${said#*: }"
  all=$((all + ${inputs%% *}))
done
echo "$all inputs, no failure"
