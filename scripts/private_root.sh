# SPDX-License-Identifier: BSD-3-Clause
# Sourced by tests that need Debian packages which nothing else does.

# unpack FOLDER PACKAGE..: downloads packages, and those that they need and this system does not have, and unpacks them
# below FOLDER/root. Nothing is installed, so root is not needed. Prints how many there were.
unpack() {
  local folder="$1" packages
  shift
  mkdir -p "$folder/debs" "$folder/root"
  packages="$(apt-get install --simulate --no-install-recommends "$@" | awk '/^Inst /{print $2}')"
  # shellcheck disable=SC2086
  [ -z "$packages" ] || (cd "$folder/debs" && quietly apt-get download $packages)
  for deb in "$folder"/debs/*.deb; do
    [ ! -e "$deb" ] || dpkg-deb --extract "$deb" "$folder/root"
  done
  echo "$(wc -w <<<"$packages") packages"
}
