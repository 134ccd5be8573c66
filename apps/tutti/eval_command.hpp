// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace CLI {
class App;
}

namespace tutti::app {

/// Adds `tutti eval EST REF`: ATE and RPE of one trajectory file against another. When it has run, `exit_code` is 0, or
/// 1 with a message on stderr; both must outlive the parse.
void add_eval_command(CLI::App& app, int& exit_code);

}  // namespace tutti::app
