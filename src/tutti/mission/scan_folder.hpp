// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tutti/mission/mission_config.hpp"
#include "tutti/mission/scan_times.hpp"
#include "tutti/model/recording.hpp"

namespace tutti::mission {

/// A folder with one scan per odometry pose, NNNNNN.pcd or KITTI's NNNNNN.bin, in the LiDAR's frame. Scans come out in
/// the body frame of their pose, deskewed by the odometry where points carry times (docs/data.md).
class ScanFolder final : public ScanSource {
 public:
  /// `first`: number of the file of the first odometry pose. Reads the first scans that are there. Error: the folder
  /// holds none of the files, or none of the first few can be used; then the first one's error.
  static Result<std::shared_ptr<const ScanFolder>> open(std::filesystem::path folder, std::size_t first,
                                                        const Trajectory& odometry, const RobotConfig& robot);

  /// Asked for at keyframes: those that have none are counted among the mission's notes.
  [[nodiscard]] Result<std::optional<Scan>> scan(std::size_t sample) const override;
  /// How the scans are taken, in words.
  [[nodiscard]] std::string note() const;

 private:
  ScanFolder(std::filesystem::path folder, std::size_t first, const Trajectory& odometry);
  Status look_into(const RobotConfig& robot);
  [[nodiscard]] Result<std::optional<PointTimes>> times_of(std::size_t sample, const RobotConfig& robot) const;
  [[nodiscard]] tl::unexpected<Error> no_scans() const;
  [[nodiscard]] std::optional<std::filesystem::path> file_of(std::size_t sample) const;

  std::filesystem::path folder_;
  std::size_t first_;
  Trajectory odometry_;  // T_odom_body, and a sweep's length beyond either end
  std::size_t before_;   // poses that odometry_ has before the recorded ones
  std::size_t samples_;  // of the recorded ones
  Pose3 T_body_lidar_;
  std::optional<PointTimes> times_;
};

}  // namespace tutti::mission
