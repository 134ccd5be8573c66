// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace CLI {
class App;
}

namespace tutti::app {

/// Adds `tutti map closure` to `tutti map`.
void add_map_closure_command(CLI::App& map, int& exit_code);
/// Adds `log`, `diff` and `revert`.
void add_map_versions_commands(CLI::App& map, int& exit_code);
void add_map_publish_command(CLI::App& map, int& exit_code);

}  // namespace tutti::app
