#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Builds and runs every benchmark on one thread; arguments go to each (for example --benchmark_filter=Kron).
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

"$root/scripts/install_dependencies.sh" --bench
configure bench
say "building"
build bench
for bench in "$root"/build/bench/bench/runtime/bench_*; do
  [ -f "$bench" ] && [ -x "$bench" ] || continue
  say "$(basename "$bench")"
  "$bench" "$@"
done
