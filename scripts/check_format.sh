#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# All tracked C++ files are formatted by .clang-format (clang-format 14, Debian 12's; others format differently), and no
# comment or item of a page begins with "Of": subject first.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"
cd "$root"

formatter="$(command -v clang-format-14 || command -v clang-format)" || skip "no clang-format"
[[ "$("$formatter" --version)" =~ version\ 14\. ]] || skip "$("$formatter" --version) is not version 14"
git rev-parse --is-inside-work-tree >/dev/null 2>&1 || skip "not a git checkout"

if git grep -nE '(//+<?|^ *[-*]|[.:;]) Of [a-z]' -- '*.cpp' '*.hpp' '*.proto' '*.md'; then
  echo 'these sentences begin with "Of": begin with the subject' >&2
  exit 1
fi

git ls-files -z -- '*.cpp' '*.hpp' | while IFS= read -r -d '' file; do
  if [ -f "$file" ]; then printf '%s\0' "$file"; fi # deleted, but not yet committed
done | xargs -0 -r "$formatter" --dry-run -Werror
