// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/exports/scene.hpp"
#include "tutti/mapfile/content.hpp"

namespace tutti::exports {

/// A map's file as a scene: every session's trajectory in the joint map (NAME/server) and its raw odometry
/// (NAME/odometry), the frames world -> NAME/odom -> NAME/base_link, the joint cloud, the closures whose two ends the
/// map joins with state and reason, where odometry failed, and the map's place on the earth. Components of the map have
/// worlds of their own: world is the largest, the others are world_2, world_3, ... A session in several components has
/// a trajectory NAME_piece_2 and so on for each further one. Errors are those of reading clouds from `store`.
Result<Scene> scene_of_map(const storage::TableStore& store, const mapfile::Content& content,
                           const server::MapEstimate& map);

}  // namespace tutti::exports
