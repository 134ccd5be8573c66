# SPDX-License-Identifier: BSD-3-Clause
# Sourced by the other scripts: where the project is, how a stage is announced, how a preset is built.

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
jobs="$(nproc)"

say() { printf '\n== %s\n' "$*"; }

# Ends with success, saying why nothing was tried.
skip() {
  echo "skipped: $*"
  echo TUTTI_ALL_SKIPPED # ctest's word for it
  exit 0
}

# Runs a command, showing its output only when it fails.
quietly() {
  local log status=0
  log="$(mktemp)"
  "$@" >"$log" 2>&1 || status=$?
  if [ "$status" -ne 0 ]; then
    cat "$log" >&2
    echo "failed: $*" >&2
  fi
  rm -f "$log"
  return "$status"
}

# configure PRESET [cmake options..]: quick when nothing changed.
configure() {
  local build="$root/build/$1"
  # A checkout that was moved or copied cannot reuse its build folder.
  if [ -f "$build/CMakeCache.txt" ] && ! grep -qxF "CMAKE_HOME_DIRECTORY:INTERNAL=$root" "$build/CMakeCache.txt"; then
    rm -rf "$build"
  fi
  quietly cmake -S "$root" --preset "$1" "${@:2}"
}

# build PRESET [ninja targets..]
build() {
  local preset="$1" flags=()
  shift
  [ -t 1 ] || flags=(--quiet) # progress is for people
  NINJA_STATUS='[%f/%t] ' ninja -C "$root/build/$preset" -j "$jobs" "${flags[@]}" "$@"
}
