#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The page of web/: form, types, unit tests in Node, that web/dist is what the sources make, and a headless Chromium that drives it.
# Skips, and reports it, without what it needs; without an option it installs Chromium and Node where they are missing.
#   scripts/test_web.sh [--write | --quick | --chromium | --programs TUTTI | --log-in TUTTI]
# --write: renews web/dist instead of comparing it; --quick: no Chromium; --chromium: nothing else;
# --programs: Chromium drives the page of this program instead of a made-up mission; --log-in: the
# same with credentials. The last four install no packages.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

mode="${1-}"
program="${2:+$(realpath "$2")}"
missing=()
[ "$mode" = --quick ] || command -v chromium >/dev/null || missing+=(chromium)
command -v npm >/dev/null || missing+=(nodejs npm)
if [ "${#missing[@]}" -gt 0 ]; then
  case "$mode" in --quick | --chromium | --programs | --log-in) skip "missing: ${missing[*]}" ;; esac
  [ "$(id -u)" = 0 ] || skip "not root, and missing: ${missing[*]}"
  say "packages: ${missing[*]}"
  export DEBIAN_FRONTEND=noninteractive
  { quietly apt-get update && quietly apt-get install -y --no-install-recommends "${missing[@]}"; } || skip "apt-get cannot install ${missing[*]}"
fi

cd "$root/web"
exec {turn}>.node_modules.lock # one of two tests installs, the other waits
flock "$turn"
if ! cmp -s package-lock.json node_modules/.tutti-lock; then
  say "npm ci"
  timeout 120 npm ping >/dev/null 2>&1 || skip "the npm registry does not answer"
  quietly npm ci --no-audit --no-fund || skip "npm ci fails: the registry lacks something"
  cp package-lock.json node_modules/.tutti-lock
fi
exec {turn}>&-
if grep -q '"resolved"' package-lock.json; then
  echo "web/package-lock.json names where packages were loaded from: npm install --omit-lockfile-registry-resolved" >&2
  exit 1
fi

if [ "$mode" = --programs ] || [ "$mode" = --log-in ]; then
  PATH="$PATH:/usr/sbin" command -v nats-server >/dev/null || skip "missing: nats-server"
  script=programs
  [ "$mode" = --programs ] || script=log_in
  node "test/$script.mjs" "$program" "$root/tests/system/page_mission.yaml"
  exit
fi

if [ "$mode" != --chromium ]; then
  say "form, types and page"
  npx prettier --check --log-level warn . || { echo "not as the formatter writes it: npx prettier --write . in web/" >&2; exit 1; }
  npx tsc --noEmit
  out=dist
  if [ "$mode" != --write ]; then
    out="$(mktemp -d)"
    trap 'rm -rf "$out"' EXIT
  fi
  quietly npx vite build --outDir "$out" --emptyOutDir
  cmp "$out/index.html" dist/index.html || { echo "web/dist is not what the sources make: scripts/test_web.sh --write" >&2; exit 1; }

  say "tests in Node"
  npm test
fi

if [ "$mode" != --quick ]; then
  say "tests in Chromium"
  node test/browser.mjs
fi
