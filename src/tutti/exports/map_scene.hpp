// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/exports/scene.hpp"
#include "tutti/mapfile/content.hpp"

namespace tutti::exports {

/// A map's file: every session's way in the joint map (NAME/server) and its raw odometry (NAME/odometry), as frames
/// world -> NAME/odom -> NAME/base_link, the joint cloud, every closure with its state and reason, and where odometry
/// failed. Parts of the map that nothing joins have worlds of their own: world is the largest, world_2, world_3, ..
/// the others.
Result<Scene> scene_of_map(const storage::TableStore& store, const mapfile::Content& content,
                           const server::MapEstimate& map);

}  // namespace tutti::exports
