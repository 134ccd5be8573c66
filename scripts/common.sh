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

# Prints ninja's lines that are no progress, and of progress one in half a minute.
sparsely() {
  local next=0 line
  while IFS= read -r line; do
    case "$line" in
      "ninja: Entering"* | "ninja: no work"*) ;;
      \[*/*\]*)
        ((SECONDS < next)) && continue
        next=$((SECONDS + 30))
        echo "${line%%]*}] built"
        ;;
      *) printf '%s\n' "$line" ;;
    esac
  done
}

# build PRESET [ninja targets..]
build() {
  local preset="$1"
  shift
  if [ -t 1 ]; then
    NINJA_STATUS='[%f/%t] ' ninja -C "$root/build/$preset" -j "$jobs" "$@"
  else
    NINJA_STATUS='[%f/%t] ' ninja -C "$root/build/$preset" -j "$jobs" "$@" | sparsely
  fi
}
