#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# `tutti robot --ros` against Fast DDS, the middleware that ROS 2 comes with (Debian's 2.9, its own coder of messages): a robot
# that publishes odometry, scans and transforms as ROS 2 does must be answered for each sample, whichever of ROS's settings of
# discovery configures it. Downloads 3 MB of packages into a temporary folder; no part of CI.
#   scripts/test_fastdds.sh [PRESET]    of the build whose programs are used; default: ci
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"
source "$root/scripts/private_root.sh"

preset="${1:-ci}"
[ -d "$root/build/$preset" ] || configure "$preset"
build "$preset" tutti
tutti="$root/build/$preset/apps/tutti/tutti"

work="$(mktemp -d)"
robot=
finish() {
  [ -z "$robot" ] || kill "$robot" 2>/dev/null || true
  wait
  rm -rf "$work"
}
trap finish EXIT
say "Fast DDS"
unpack "$work" libfastrtps-dev
arch="$(dpkg-architecture -qDEB_HOST_MULTIARCH)"
libraries="$work/root/usr/lib/$arch"
g++ -std=c++20 -O1 -isystem "$work/root/usr/include" -isystem "$work/root/usr/include/$arch" \
  "$root/tests/counterparts/fastdds_robot.cpp" -o "$work/robot" -L"$libraries" -lfastrtps -lfastcdr \
  -Wl,-rpath-link,"$libraries"

export ROS_DOMAIN_ID=87
for setting in jazzy-nothing-set-or-range-subnet jazzy-range-localhost-or-localhost-only jazzy-static-peer-loopback \
  humble-localhost-only off; do
  say "$setting"
  "$tutti" robot --ros --name r1 --bus nats://127.0.0.1:1 --state "$work/$setting" >"$work/said" 2>&1 &
  robot=$!
  LD_LIBRARY_PATH="$libraries" "$work/robot" "$ROS_DOMAIN_ID" r1 200 "$setting" || {
    cat "$work/said" >&2
    exit 1
  }
  [ "$setting" = off ] || python3 - "$work/$setting/status.json" <<'EOF'
# A scan has 19 kB, and the robot wants one of each keyframe.
import json, sys
feed = json.load(open(sys.argv[1]))["feed"]
print({name: feed[name] for name in ("client", "bytes", "scans_left_out", "samples_joined")})
assert feed["bytes"] > 100_000 and feed["scans_left_out"] == 0, feed
EOF
  kill "$robot"
  wait "$robot" || true
  robot=
done
echo "test_fastdds: every sample was answered"
