#!/bin/sh
# SPDX-License-Identifier: BSD-3-Clause
# A launcher for one target: compiles or links with another compiler than the project's.
#   compile_with.sh COMPILER [LAUNCHER..] -- THE_PROJECTS_COMPILER ARGUMENTS..
compiler=$1
shift
launcher=
while [ "$1" != -- ]; do
  launcher="$launcher $1"
  shift
done
shift 2
exec $launcher "$compiler" "$@"
