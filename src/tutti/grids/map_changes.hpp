// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <set>

#include "tutti/grids/changes.hpp"
#include "tutti/mapfile/content.hpp"

namespace tutti::grids {

/// Finds what robots in the sessions `now` saw otherwise than those in the sessions `before`, in the world of the
/// component that mapfile::component_to_show() names. Errors: a cloud cannot be read, or one of the two has none there.
Result<Changes> changes_of_map(const storage::TableStore& store, const mapfile::Content& content,
                               const server::MapEstimate& map, const std::set<ChainId>& before,
                               const std::set<ChainId>& now, const ChangeConfig& config);

}  // namespace tutti::grids
