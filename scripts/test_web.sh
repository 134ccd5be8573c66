#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The page of web/: types, unit tests in Node, that web/dist is what the sources make, and a headless Chromium that drives it.
# Installs Chromium and Node where they are missing. Skips, and says so, without root or without the npm registry.
#   scripts/test_web.sh [--write | --quick]    --write: renews web/dist instead of comparing it; --quick: no Chromium, installs nothing
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

missing=()
[ "${1-}" = --quick ] || command -v chromium >/dev/null || missing+=(chromium)
command -v npm >/dev/null || missing+=(nodejs npm)
if [ "${#missing[@]}" -gt 0 ]; then
  [ "${1-}" != --quick ] || skip "missing: ${missing[*]}"
  [ "$(id -u)" = 0 ] || skip "not root, and missing: ${missing[*]}"
  say "packages: ${missing[*]}"
  export DEBIAN_FRONTEND=noninteractive
  { quietly apt-get update && quietly apt-get install -y --no-install-recommends "${missing[@]}"; } || skip "apt-get cannot install ${missing[*]}"
fi

cd "$root/web"
if ! cmp -s package-lock.json node_modules/.tutti-lock; then
  say "npm ci"
  timeout 120 npm ping >/dev/null 2>&1 || skip "the npm registry does not answer"
  quietly npm ci --no-audit --no-fund || skip "npm ci fails: the registry lacks something"
  cp package-lock.json node_modules/.tutti-lock
fi
if grep -q '"resolved"' package-lock.json; then
  echo "web/package-lock.json names where packages were loaded from: npm install --omit-lockfile-registry-resolved" >&2
  exit 1
fi

say "types and page"
npx tsc --noEmit
out=dist
if [ "${1-}" != --write ]; then
  out="$(mktemp -d)"
  trap 'rm -rf "$out"' EXIT
fi
quietly npx vite build --outDir "$out" --emptyOutDir
cmp "$out/index.html" dist/index.html || { echo "web/dist is not what the sources make: scripts/test_web.sh --write" >&2; exit 1; }

say "tests in Node"
npm test

if [ "${1-}" != --quick ]; then
  say "tests in Chromium"
  node test/browser.mjs
fi
