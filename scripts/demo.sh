#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Installs what is missing, builds, and runs `tutti demo`; arguments go to it (for example --seed 7).
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

"$root/scripts/install_dependencies.sh"
configure release
say "building (the first time takes some minutes)"
build release tutti

out=(--out "$root/out/demo")
for argument in "$@"; do
  case "$argument" in --out | --out=* | -h | --help) out=() ;; esac
done
say "tutti demo"
exec "$root/build/release/apps/tutti/tutti" demo "${out[@]}" "$@"
