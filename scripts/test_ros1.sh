#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Tutti against a real ROS 1 (Debian's): reads what its rosbag records and writes, and lets its rosbag read what Tutti's own
# tests take for bags. Downloads 15 MB of packages into a temporary folder; no part of CI.
#   scripts/test_ros1.sh [PRESET]    of the build whose programs are used; default: ci
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"
source "$root/scripts/private_root.sh"

preset="${1:-ci}"
[ -d "$root/build/$preset" ] || configure "$preset"
build "$preset" tutti test_bags

work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
say "ROS 1"
unpack "$work" python3-rosbag python3-rosmaster python3-rospy python3-nav-msgs python3-sensor-msgs python3-tf2-msgs

# Its recorder expects its plugins below /lib of this path, not in the folder of the architecture.
arch="$(dpkg-architecture -qDEB_HOST_MULTIARCH)"
ln -sf "$arch/ros/librosbag_default_encryption_plugins.so" "$work/root/usr/lib/"
export CMAKE_PREFIX_PATH="$work/root/usr"
export PYTHONPATH="$work/root/usr/lib/python3/dist-packages"
export LD_LIBRARY_PATH="$work/root/usr/lib/$arch:$work/root/usr/lib"
export ROS_HOME="$work/home" ROS_LOG_DIR="$work/home" ROS_PACKAGE_PATH="$work/root/usr/share"
/usr/bin/python3 "$root/tests/counterparts/ros1_test.py" "$root/build/$preset" "$root" "$work/root"
