// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/App.hpp>

namespace tutti::app {

/// `tutti compare A B`: where, at which scale and since when two trajectories disagree, and what would fix it. See the
/// command's --help and docs/compare.md.
void add_compare_command(CLI::App& app, int& exit_code);

}  // namespace tutti::app
