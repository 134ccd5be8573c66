// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace CLI {
class App;
}

namespace tutti::app {

void add_settings_command(CLI::App& app, int& exit_code);

}  // namespace tutti::app
