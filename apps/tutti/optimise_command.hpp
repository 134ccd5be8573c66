// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace CLI {
class App;
}

namespace tutti::app {

/// `tutti optimise IN.g2o -o OUT.g2o`: one pose graph, from file to file. `exit_code` is set when it runs: 0 done,
/// 1 failed, 2 wrong usage.
void add_optimise_command(CLI::App& app, int& exit_code);

}  // namespace tutti::app
