// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string_view>

/// Keys of table `meta` in a map's store; map_meta.hpp has the rows. A new one gets a line in mapfile/meta_rows.cpp.
namespace tutti::node {

inline constexpr std::string_view kMapKey = "map";                    ///< MapMeta
inline constexpr std::string_view kSettingsKey = "settings";          ///< MapSettings
inline constexpr std::string_view kCountsKey = "counts";              ///< MapCounts
inline constexpr std::string_view kLastUpdateKey = "update";          ///< LastUpdate
inline constexpr std::string_view kRobotPrefix = "robot/";            ///< RobotRegistry::robot_of()
inline constexpr std::string_view kRefinementPrefix = "refinement/";  ///< refinement_key()
inline constexpr std::string_view kPlacePrefix = "place/";            ///< place_of_row()
/// Followed by a mark's number: the mark, and the bytes of its photo (marks.hpp).
inline constexpr std::string_view kMarkPrefix = "mark/", kPhotoPrefix = "photo/";
/// Followed by a submap's key; the poses of its keyframes in a map that does not move.
inline constexpr std::string_view kHeldPrefix = "held/";
/// Followed by a submap's key, without bytes: the submap is retired (server/known_ground.hpp).
inline constexpr std::string_view kRetiredPrefix = "retired/";
/// Followed by a number; the sessions that this version of a map added (mapfile/versions.hpp).
inline constexpr std::string_view kVersionPrefix = "version/";
/// Followed by a robot's number; its submaps that are refused for good.
inline constexpr std::string_view kRefusedPrefix = "refused/";
/// Followed by a robot's number; what it has returned of the map that it localises in (PlaceBook).
inline constexpr std::string_view kReturnedPrefix = "returned/";

}  // namespace tutti::node
