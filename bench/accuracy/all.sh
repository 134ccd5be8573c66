#!/bin/sh
# SPDX-License-Identifier: BSD-3-Clause
# Makes every generated table of docs/results anew, in one night on two cores, and lists which differ from what is
# committed.
#
# Usage: bench/accuracy/all.sh SHARED [TABLE...]
#
# SHARED has data/ (docs/data.md) and cases/. TABLEs are fleets, map, judge, missions, hku, paper and selection; all
# without any. Builds the preset `bench` first. Runs are kept in out/all/PROGRAM, PROGRAM being a sum over what was
# built: stopped at any time and called again it goes on, and another program begins anew. JOBS=1 leaves a core free
# (default 2).
set -eu
cd "$(dirname "$0")/../.."
[ $# -ge 1 ] || { sed -n '3,10s/^# \{0,1\}//p' "$0"; exit 2; }
shared=$(cd "$1" && pwd)
shift
[ $# -gt 0 ] || set -- fleets map judge missions hku paper selection
jobs=${JOBS:-2}
tutti=$PWD/build/bench/apps/tutti/tutti
calibration=$PWD/build/bench/bench/accuracy/tutti_calibration
judge=$PWD/build/bench/bench/accuracy/tutti_bench_judge
if [ -z "${NO_BUILD:-}" ]; then
  cmake --preset bench > /dev/null
  cmake --build build/bench --target tutti tutti_calibration tutti_bench_judge -j "$jobs" > /dev/null
fi
keep=$PWD/out/all/$(cat "$tutti" "$calibration" "$judge" | sha256sum | cut -c1-12)
mkdir -p "$keep"

run_table() {
  case $1 in
    fleets) python3 bench/accuracy/fleets.py "$tutti" --data "$shared/data" --jobs "$jobs" --out "$keep/fleets" ;;
    map) python3 bench/accuracy/map.py "$tutti" --shared "$shared" --jobs "$jobs" --out "$keep/map" ;;
    judge) python3 bench/accuracy/judge.py "$judge" --out "$keep/judge" ;;
    missions) python3 bench/accuracy/missions.py "$tutti" --data "$shared/data" --keep "$keep/missions" ;;
    hku) python3 bench/accuracy/hku.py "$tutti" --data "$shared/data" --keep "$keep/hku" ;;
    paper) python3 bench/accuracy/paper.py "$tutti" --keep "$keep/paper" ;;
    selection) python3 bench/accuracy/selection.py "$tutti" "$calibration" --data "$shared/data" --keep "$keep/selection" --jobs "$jobs" ;;
    *) echo "no table is called '$1': fleets, map, judge, missions, hku, paper, selection" >&2; return 2 ;;
  esac
}

# One table; how long it took this time is kept beside its runs.
make_table() {
  began=$(date +%s)
  run_table "$1" || return 1  # set -e does not count in what is followed by ||
  echo "$1 $(($(date +%s) - began))" >> "$keep/seconds.txt"
}

failed=
alone=
for table in "$@"; do  # those that make one run after the other, side by side; the others use all cores themselves
  case $table in
    fleets | map | selection) ;;
    *) alone="$alone $table" ;;
  esac
done
if [ "$jobs" -gt 1 ]; then
  lanes=$keep/failed
  : > "$lanes"
  for table in $alone; do echo "$table"; done > "$keep/todo"
  # Two lanes: the paper's table, which takes as long as the others together, and the rest.
  for lane in paper rest; do
    (while read -r table; do
      if { [ "$lane" = paper ] && [ "$table" = paper ]; } || { [ "$lane" = rest ] && [ "$table" != paper ]; }; then
        make_table "$table" || echo "$table" >> "$lanes"
      fi
    done < "$keep/todo") &
  done
  wait
  failed=$(tr '\n' ' ' < "$lanes")
else
  for table in $alone; do make_table "$table" || failed="$failed $table"; done
fi
for table in "$@"; do
  case $table in
    fleets | map | selection) make_table "$table" || failed="$failed $table" ;;
  esac
done

echo
for table in "$@"; do
  file=docs/results/$table.md
  seconds=$(sed -n "s/^$table //p" "$keep/seconds.txt" 2> /dev/null | tail -n 1)
  if git diff --quiet HEAD -- "$file"; then verdict="as committed"; else verdict="DIFFERS from what is committed (git diff $file)"; fi
  case " $failed " in *" $table "*) verdict="FAILED" ;; esac
  echo "$file: $verdict; ${seconds:-?} s this time"
done
echo "docs/results/optimise.md, robustness.md, speed.md and visual.md hold seconds, and are made by the commands that stand in them."
[ -z "$(echo "$failed" | tr -d ' ')" ]
