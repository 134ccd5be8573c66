// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>

#include "tutti/mapfile/content.hpp"

namespace CLI {
class App;
}

namespace tutti::app {

struct GridOptions;

/// Adds the options of `tutti map export` that make a map to drive on.
std::shared_ptr<GridOptions> add_grid_options(CLI::App& command);
/// True if any of these options was given.
bool wants_grid(const GridOptions& options);
/// Writes the maps that were asked for; prints what went wrong, and returns the exit code.
int export_grids(const storage::TableStore& map, const mapfile::Content& content, const server::MapEstimate& estimate,
                 const GridOptions& options);

}  // namespace tutti::app
