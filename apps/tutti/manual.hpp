// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace tutti::app {

/// The --help texts of a program and its subcommands as one page for man(1) (groff's man macros, section 1). Hidden
/// subcommands and options are left out.
std::string manual_page(const CLI::App& program, const std::string& version);
/// A completion script for bash that does not need the package bash-completion. It completes subcommands, options, the
/// values of options with few choices, and folders or files.
std::string bash_completion(const CLI::App& program);

}  // namespace tutti::app
