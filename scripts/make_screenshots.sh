#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Pictures of the page by headless Chromium; web/test/screenshots.mjs defines which, and of what.
#   scripts/make_screenshots.sh [--report FILE.html | --live URL | --moving FILE.html] [OUT]    OUT: default out/pictures
# Without an option of a made-up mission; --live: of one that runs (docs/images/room.png: tutti demo --live); --moving: the course of a
# mission from its report, as OUT/moving.gif (docs/images/moving.gif: tutti demo), which needs ffmpeg.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

what='' of=''
case "${1-}" in
  --report | --moving)
    what="${1#--}" of="file://$(realpath "$2")"
    shift 2
    ;;
  --live)
    what=live of="$2"
    shift 2
    ;;
esac
out="$(realpath -m "${1:-$root/out/pictures}")"
command -v chromium >/dev/null && [ -d "$root/web/node_modules" ] || { echo "run scripts/test_web.sh first: it installs what is missing" >&2; exit 1; }
mkdir -p "$out"
if [ "$what" = moving ]; then
  command -v ffmpeg >/dev/null || { echo "no ffmpeg: apt-get install ffmpeg" >&2; exit 1; }
  frames="$(mktemp -d)"
  trap 'rm -rf "$frames"' EXIT
  node "$root/web/test/moving_picture.mjs" "$frames" "$of"
  ffmpeg -v error -y -framerate 8 -i "$frames/frame_%03d.png" \
    -vf 'split[a][b];[a]palettegen=max_colors=64:stats_mode=diff[p];[b][p]paletteuse=dither=none:diff_mode=rectangle' "$out/moving.gif"
  ls -l "$out/moving.gif"
else
  node "$root/web/test/screenshots.mjs" "$out" "$what" "$of"
fi
