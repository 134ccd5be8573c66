// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/model/trajectory.hpp"
#include "tutti/model/visual.hpp"

namespace tutti::formats::internal {

inline constexpr std::uint32_t kMaplabDescriptorWords = 6;  // 48 bytes

struct MaplabKeypoint {
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();
  float sigma_px = 1.0F;
  std::int64_t track = -1;            ///< The tracker's number, -1 for none; not every track is one thing.
  std::uint32_t landmark = kNoIndex;  ///< Index into MaplabFolder::landmarks, if it is a good one.
  std::array<std::uint64_t, kMaplabDescriptorWords> descriptor{};
  friend bool operator==(const MaplabKeypoint&, const MaplabKeypoint&) = default;
};

/// One submap folder as it stands.
struct MaplabFolder {
  std::string path;
  Trajectory keyframes;                                ///< T_M_I, by stamp.
  std::vector<std::vector<MaplabKeypoint>> keypoints;  ///< One list per keyframe.
  std::vector<Eigen::Vector3d> landmarks;              ///< Frame M, those of quality 2.
  Camera camera;
  ImuNoise imu_noise;
};

/// Its files.
struct MaplabTexts {
  std::string sensors, keyframes, landmarks, keypoints;
};

/// `path` is for the errors.
Result<MaplabFolder> parse_maplab_folder(const MaplabTexts& texts, const std::string& path);
Result<MaplabFolder> read_maplab_folder(const std::string& path);

}  // namespace tutti::formats::internal
