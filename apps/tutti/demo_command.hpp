// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace CLI {
class App;
}

namespace tutti::app {

/// `tutti demo`
void add_demo_command(CLI::App& app, int& exit_code);

}  // namespace tutti::app
