#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Pictures of the page by headless Chromium (docs/images/room.png is one); web/test/screenshots.mjs says which, and of what.
#   scripts/make_screenshots.sh [--report FILE.html] [OUT]    OUT: default out/pictures; --report: of this report instead of a made-up mission
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

report=''
if [ "${1-}" = --report ]; then
  report="$(realpath "$2")"
  shift 2
fi
out="$(realpath -m "${1:-$root/out/pictures}")"
command -v chromium >/dev/null && [ -d "$root/web/node_modules" ] || { echo "run scripts/test_web.sh first: it installs what is missing" >&2; exit 1; }
mkdir -p "$out"
node "$root/web/test/screenshots.mjs" "$out" "$report"
