#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Installs the Debian packages with apt into minimal systems of Debian 12 that are made for it, as in the Dockerfiles,
# and runs Tutti there. Needs root, network and mmdebstrap; no part of CI. Prints megabytes and seconds:
# docs/install.md.
#   scripts/test_packages.sh [--development] [FOLDER]    of packages; without it they are built (preset release, cpack)
# --development: also builds the examples on libtutti-dev there, with all that it recommends and a compiler: 1 GB more.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

development=no
if [ "${1-}" = --development ]; then
  development=yes
  shift
fi
for program in mmdebstrap dpkg-shlibdeps unshare; do
  command -v "$program" >/dev/null || {
    echo "$0: no $program here (packages mmdebstrap, dpkg-dev, util-linux)" >&2
    exit 1
  }
done
[ "$(id -u)" -eq 0 ] || {
  echo "$0: needs root, to make systems and to change into them" >&2
  exit 1
}

if [ $# -eq 0 ]; then
  configure release -DTUTTI_BUILD_PYTHON=ON
  build release
  say "packages"
  rm -rf "$root/build/release/packages"
  quietly cpack -G DEB --config "$root/build/release/CPackConfig.cmake"
  set -- "$root/build/release/packages"
fi
debs="$(cd "$1" && pwd)"
ls -s --block-size=kB "$debs"/*.deb

work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT

# inside SYSTEM COMMAND: by a shell in it, with the packages at /debs. The mounts end with the shell.
inside() {
  mkdir -p "$work/$1/debs"
  unshare --mount --pid --fork sh -euc '
    mount -t proc proc "$1/proc"
    mount --rbind /dev "$1/dev"
    mount --bind "$2" "$1/debs"
    [ ! -e /etc/resolv.conf ] || { cp -L /etc/resolv.conf "$1/etc/resolv.conf"; }
    exec chroot "$1" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8 sh -euc "$3"
  ' sh "$work/$1" "$debs" "$2"
}

size_mb() { du -s --apparent-size --block-size=MB "$work/$1" | sed 's/MB.*//'; }

# The RUN instructions of a Dockerfile, one after the other.
commands_of() {
  sed -e '/^#/d' "$1" | sed -e ':more' -e '/\\$/{N;s/\\\n//;b more' -e '}' | sed -n 's/^RUN \(--mount=[^ ]* *\)\?//p'
}

# install_as NAME: a system as docker/NAME.Dockerfile makes it.
install_as() {
  local began=$SECONDS commands
  commands="$(commands_of "$root/docker/$1.Dockerfile")"
  cp -a "$work/minimal" "$work/$1"
  quietly inside "$1" "$commands"
  echo "$1: $(size_mb "$1") MB, $(($(size_mb "$1") - $(size_mb minimal))) of them installed in $((SECONDS - began)) s"
}

# As Debian's slim images: without documents, and without perl, which usrmerge would bring.
say "a minimal Debian 12"
quietly mmdebstrap --variant=minbase --include=usr-is-merged --hook-dir=/usr/share/mmdebstrap/hooks/merged-usr \
  --dpkgopt='path-exclude=/usr/share/man/*' --dpkgopt='path-exclude=/usr/share/locale/*' --dpkgopt='path-exclude=/usr/share/doc/*' \
  --dpkgopt='path-include=/usr/share/doc/*/copyright' --customize-hook='rm -rf "$1"/var/lib/apt/lists/* "$1"/var/cache/apt/*.bin' bookworm "$work/minimal"
echo "$(size_mb minimal) MB"

say "base station"
install_as base-station
inside base-station '
  tutti --version
  ! ldd /usr/bin/tutti | grep -e opencv -e "not found"
  su tutti -s /bin/sh -c "
    cd; tutti mission up /usr/share/tutti/missions/tunnel.yaml --rate 20 --out out \
      --set \"simulation.robots=[{walk: {duration_s: 120}}, {walk: {duration_s: 120}}]\" | tail -n 22"'

say "everything"
install_as full
inside full '
  ! ldd /usr/bin/tutti | grep "not found"
  [ ! -e /usr/lib/python3/dist-packages/tutti ] || python3 -c "import tutti; print(tutti.__file__)"
  began=$(date +%s)
  su tutti -s /bin/sh -c "cd; tutti demo --out out | tail -n 22"
  echo "tutti demo: $(($(date +%s) - began)) s"'

say "from two bags to a report (docs/your-robots.md)"
inside full '
  su tutti -s /bin/sh -c "set -eu
    cd; tutti simulate /usr/share/tutti/missions/demo.yaml -o recordings >/dev/null
    tutti bag info recordings/alpha
    tutti run --bag alpha=recordings/alpha --bag bravo=recordings/bravo --out mine --map mine.tutti | tail -n 22
    tutti export mine -o mine.mcap
    tutti map export mine.tutti --grid map.yaml
    ls -s mine/report.html mine.mcap map.yaml map.pgm"'

# The commands of docs/security.md, in its order, all on one machine.
say "a base station, two robots and an operator with rights (docs/security.md)"
typed="$(sed -n '/^## A base station/,/^## The model/p' "$root/docs/security.md" | sed -n '/^```/,/^```/{/^```/d;p}' |
  sed -e 's/BASE/127.0.0.1/; s/0\.0\.0\.0/127.0.0.1/; s# \([a-z]*\.cred\)# pki/credentials/\1#; s#/var/lib/tutti-##')"
robot="$(grep '^tutti robot' <<<"$typed")"
{
  echo 'set -eu; cd; mkdir rights; cd rights'
  grep '^tutti pki' <<<"$typed"
  grep '^tutti server' <<<"$typed" | sed 's/$/ >server.out 2>\&1 \&/'
  echo 'until grep -q tls:// server.out; do sleep 0.2; done'
  for name in alpha bravo; do
    sed "s/alpha/$name/g; s#state robot#state $name#; s/\$/ >$name.out 2>\&1 \&/" <<<"$robot"
  done
  status="$(grep '^tutti status' <<<"$typed")"
  echo "for i in \$(seq 60); do $status >status.out 2>&1 || true; grep -q alpha status.out && grep -q bravo status.out && break; sleep 1; done"
  echo 'cat status.out; grep -q alpha status.out; grep -q bravo status.out'
  grep '^tutti map closure' <<<"$typed" | sed 's/$/ >decision.out 2>\&1 || true; cat decision.out/'
  echo '! tutti status --bus tls://127.0.0.1:4222 --insecure >stranger.out 2>&1; cat stranger.out'
  echo 'tutti pki revoke bravo; for i in $(seq 60); do grep -q revoked server/log.txt && break; sleep 1; done; grep revoked server/log.txt | tail -n 1; kill $(jobs -p); wait || true'
} >"$work/full/rights.sh"
cat "$work/full/rights.sh"
inside full 'su tutti -s /bin/bash /rights.sh'

if [ "$development" = yes ]; then
  say "libtutti-dev"
  began=$SECONDS
  cp -a "$work/minimal" "$work/development"
  cp -a "$root/examples/library" "$work/development/examples"
  quietly inside development 'apt-get update; apt-get install -y --no-install-recommends /debs/libtutti-dev_*.deb g++ cmake make'
  # The package depends on what component core needs.
  quietly inside development '
    mkdir /tmp/core; cd /tmp/core
    printf "%s\n" "cmake_minimum_required(VERSION 3.25)" "project(x LANGUAGES C CXX)" "find_package(tutti REQUIRED COMPONENTS core)" \
      "add_executable(x x.cpp)" "target_link_libraries(x PRIVATE tutti::core)" >CMakeLists.txt
    printf "%s\n" "#include \"tutti/geometry/so3.hpp\"" "int main() { return tutti::so3_exp({0, 0, 0}).w() == 1.0 ? 0 : 1; }" >x.cpp
    cmake -S . -B build; cmake --build build; build/x'
  quietly inside development '
    apt-get install -y $(dpkg-query -W -f "\${Recommends}" libtutti-dev | tr -d ,)
    cmake -S /examples -B /tmp/examples; cmake --build /tmp/examples; /tmp/examples/embed'
  echo "libtutti-dev: $(size_mb development) MB with g++ and cmake, examples built and run, $((SECONDS - began)) s"
fi
