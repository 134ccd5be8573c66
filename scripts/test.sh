#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Builds everything with warnings as errors and runs all tests; with --sanitize then once more under ASan and UBSan.
# Release comes first: it is built faster and finds most mistakes.
#   scripts/test.sh [--sanitize]
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

sanitize=no
case "$*" in
  '') ;;
  --sanitize) sanitize=yes ;;
  *)
    echo "usage: $0 [--sanitize]" >&2
    exit 2
    ;;
esac

stage() { say "$* ($((SECONDS / 60)) min $((SECONDS % 60)) s since the start)"; }

# build_and_test PRESET NAME
build_and_test() {
  configure "$1"
  stage "build: $2"
  build "$1"
  stage "test: $2"
  ctest --test-dir "$root/build/$1" --output-on-failure -j2
}

"$root/scripts/install_dependencies.sh" --tests
build_and_test ci Release
if [ "$sanitize" = yes ]; then
  export ASAN_OPTIONS=detect_stack_use_after_return=1:strict_string_checks=1
  export UBSAN_OPTIONS=print_stacktrace=1
  build_and_test asan "ASan + UBSan"
fi
