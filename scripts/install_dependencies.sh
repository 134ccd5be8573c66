#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Installs the Debian packages that are missing, and nothing when none is.
#   scripts/install_dependencies.sh [--tests] [--sanitize] [--bench] [--python]
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

packages=(
  cmake ninja-build g++ ccache pkg-config
  libeigen3-dev libsuitesparse-dev libopenblas-dev liblapacke-dev libspectra-dev libnanoflann-dev libceres-dev
  libprotobuf-dev protobuf-compiler libzstd-dev zlib1g-dev liblz4-dev libbz2-dev libssl-dev libpng-dev libturbojpeg0-dev libsqlite3-dev libnats-dev nats-server cyclonedds-dev libcpp-httplib-dev
  libexpected-dev libfmt-dev libspdlog-dev libsystemd-dev libcli11-dev libyaml-cpp-dev nlohmann-json3-dev
  libopencv-core-dev libopencv-imgproc-dev libopencv-features2d-dev libopencv-video-dev
)
clang=() # compiles what sanitizers check; another Debian or Ubuntu has another one, and GCC does it too, in twice the time
for option in "$@"; do
  case "$option" in
    --tests) packages+=(libgtest-dev libgmock-dev librapidcheck-dev clang-format python3 python3-protobuf python3-numpy pybind11-dev python3-dev python3-venv mold dpkg-dev groff-base universal-ctags) ;;
    --sanitize) clang=(clang-16 libclang-rt-16-dev) ;;
    --python) packages+=(pybind11-dev python3-dev python3-numpy python3-venv) ;;
    --bench) packages+=(libbenchmark-dev) ;;
    *)
      echo "usage: $0 [--tests] [--sanitize] [--bench] [--python]" >&2
      exit 2
      ;;
  esac
done

if ! command -v apt-get >/dev/null; then
  echo "$0: no apt-get here. Install what these Debian packages hold: ${packages[*]}" >&2
  exit 1
fi

# For the page's tests, where there is Node: 123 MB to load, 411 MB of disk. Ubuntu has no such package, and the tests skip then.
browser=''
[[ " $* " != *" --tests "* ]] || ! command -v npm >/dev/null || command -v chromium >/dev/null || browser=chromium

is_installed() { [ "$(dpkg-query -W -f='${db:Status-Status}' "$1" 2>/dev/null || true)" = installed ]; }
missing=()
for package in "${packages[@]}"; do
  is_installed "$package" || missing+=("$package")
done
optional=(${browser:+"$browser"})
for package in "${clang[@]}"; do
  is_installed "$package" || optional+=("$package")
done
[ "$((${#missing[@]} + ${#optional[@]}))" -gt 0 ] || exit 0

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  if ! command -v sudo >/dev/null; then
    [ "${#missing[@]}" -gt 0 ] || exit 0 # it does without the optional ones
    echo "$0: needs root or sudo to install: ${missing[*]}" >&2
    exit 1
  fi
  as_root=(sudo)
fi

say "installing $((${#missing[@]} + ${#optional[@]})) packages: ${missing[*]} ${optional[*]}"
apt_get=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq -o DPkg::Lock::Timeout=300)
quietly "${apt_get[@]}" update
[ "${#missing[@]}" = 0 ] || quietly "${apt_get[@]}" install -y --no-install-recommends "${missing[@]}"
for package in "${optional[@]}"; do
  "${apt_get[@]}" install -y --no-install-recommends "$package" >/dev/null || echo "no $package: tests do without it"
done
