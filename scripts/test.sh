#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Builds everything with warnings as errors and runs all tests; with --sanitize then what has threads under TSan and
# everything once more under ASan and UBSan. Release comes first: it is built faster and finds most mistakes.
#   scripts/test.sh [--sanitize | --label LABEL | --module MODULE]
# LABEL: unit, property, mission or system; MODULE: consistency, for example (only its tests are built).
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

usage() {
  echo "usage: $0 [--sanitize | --label unit|property|mission|system | --module MODULE]" >&2
  exit 2
}

sanitize=no preset=ci targets=() tests=()
case "$#:${1-}" in
  0:) ;;
  1:--sanitize) sanitize=yes ;;
  2:--label)
    case "$2" in unit | property | mission | system) tests=(-L "^$2\$") ;; *) usage ;; esac ;;
  2:--module)
    preset=dev targets=("test_$2") tests=(-R "^$2/")
    [ "$2" != integration ] || targets+=(tutti) # integration/cli runs the program
    ;;
  *) usage ;;
esac

summary="$(mktemp)"
trap 'rm -f "$summary"' EXIT
times=()
started=0 current=''

# stage [NAME]: ends the one before and begins this one, if any.
stage() {
  if [ -n "$current" ]; then
    times+=("$(printf '%6d s  %s' $((SECONDS - started)) "$current")")
  fi
  started=$SECONDS current="$*"
  if [ -n "$current" ]; then
    say "$current ($((SECONDS / 60)) min $((SECONDS % 60)) s since the start)"
  fi
}

# Runs ctest; its summary is shown by the next call or at the very end, below the times.
run_tests() {
  cat "$summary"
  : >"$summary"
  ctest --output-on-failure -j"$((2 * jobs + 2))" "$@" | # slots: tutti_computes(), tutti_waits_for()
    awk -v summary="$summary" '/^[0-9]+% tests passed/ {held = 1} held {print > summary; next} {print; fflush()}'
}

finish() {
  local status=$?
  stage
  say "$((SECONDS / 60)) min $((SECONDS % 60)) s"
  [ "${#times[@]}" -eq 0 ] || printf '%s\n' "${times[@]}"
  [ "${#left_out[@]}" -eq 0 ] || printf '%s\n' "${left_out[@]}"
  cat "$summary"
  rm -f "$summary"
  exit "$status"
}

# build_stage PRESET NAME: builds $targets, or everything.
build_stage() {
  stage "build: $2"
  configure "$1"
  build "$1" "${targets[@]}"
}

# test_stage PRESET NAME [ctest arguments..]
test_stage() {
  stage "test: $2"
  run_tests --test-dir "$root/build/$1" "${@:3}"
}

# is_over MINUTES WHAT: whether so many have gone by since the start, in CI alone; says what is left out for it. CI is
# stopped from outside after 90 minutes and has then tested nothing, which some machines would come to.
left_out=()
is_over() {
  [ -n "${TUTTI_CI-}" ] && [ $((SECONDS / 60)) -ge "$1" ] || return 1
  left_out+=("LEFT OUT, after $((SECONDS / 60)) minutes: $2")
}

stage "packages"
options=(--tests)
[ "$sanitize" = no ] || options+=(--sanitize)
"$root/scripts/install_dependencies.sh" "${options[@]}"
trap finish EXIT
build_stage "$preset" Release
test_stage "$preset" Release "${tests[@]}"
[ "$sanitize" = yes ] || exit 0
export ASAN_OPTIONS=detect_stack_use_after_return=1:strict_string_checks=1
export LSAN_OPTIONS=suppressions=$root/cmake/leaks_of_others.txt:print_suppressions=0
export UBSAN_OPTIONS=print_stacktrace=1
targets=(test_bus test_feed test_verifiers test_integration test_program)
build_stage tsan TSan
test_stage tsan TSan -R '^(bus|feed|verifiers|program)/|^integration/mission$'
targets=()
! is_over 50 "ASan and UBSan" || exit 0
build_stage asan "ASan + UBSan"
! is_over 75 "tests under ASan and UBSan" || exit 0
# A mission is run under TSan as well, and the kernels that all of them spend their time in have unit tests.
! is_over 45 "missions under ASan and UBSan" || tests=(-LE mission)
! is_over 62 "missions and programs under ASan and UBSan" || tests=(-LE "mission|system")
test_stage asan "ASan + UBSan" "${tests[@]}"
