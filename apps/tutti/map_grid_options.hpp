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

/// Options of `map export` that make a map to drive on.
std::shared_ptr<GridOptions> add_grid_options(CLI::App& command);
bool wants_grid(const GridOptions& options);
/// Writes what was asked for. The exit code; what went wrong is said.
int export_grids(const storage::TableStore& map, const mapfile::Content& content, const server::MapEstimate& estimate,
                 const GridOptions& options);

}  // namespace tutti::app
