// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/base/ids.hpp"
#include "tutti/model/submap.hpp"
#include "tutti/server/closure_names.hpp"
#include "tutti/server/payload_store.hpp"

namespace tutti::localise {

/// KnownMap::id of a map, by the bytes of its first submap as they are stored.
std::string map_id_of(std::string_view first_submap);

/// A point of a map, in the frame of its floor, m.
struct OnFloor {
  std::uint32_t floor = 1;
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
};

/// A map that does not move. Immutable; robots share it.
struct KnownMap {
  struct Entry {
    std::shared_ptr<const Submap> submap;  ///< Without payloads; never null.
    Pose3 T_world_submap;
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();  ///< Middle of its trajectory, in the map's frame, m.
    std::string place;                                 ///< ClosureVerifier::place_of(); empty when it is unknown.
    PayloadSize size;
    std::uint32_t floor = 1;  ///< Poses of two floors cannot be compared: each has a frame of its own.
    /// The frame of the keyframes' T_odom_body, as the map has it here.
    [[nodiscard]] Pose3 T_world_odom() const {
      return T_world_submap * submap->keyframes.front().T_odom_body.inverse();
    }
  };
  std::string id;                      ///< The same for all versions of the map.
  std::uint64_t revision = 0;          ///< The map's.
  server::ClosureNames names{{}, {}};  ///< Names of its submaps for people.
  std::map<SubmapId, Entry> submaps;
  std::uint32_t floors = 1;                              ///< They are numbered from 1.
  std::shared_ptr<const server::PayloadStore> payloads;  ///< Never null.

  /// A robot number that no submap of the map has.
  [[nodiscard]] RobotId free_robot() const;
  /// The submaps whose middles are within `radius_m` of a point on their floor, nearest first, `most` at most.
  [[nodiscard]] std::vector<SubmapId> near(const OnFloor& p_world, double radius_m, std::size_t most) const;
};

}  // namespace tutti::localise
