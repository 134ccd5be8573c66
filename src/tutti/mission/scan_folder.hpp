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

/// Which scan is of which moment.
struct ScanMoments {
  std::size_t first = 0;          ///< Number of the file of the first odometry pose.
  std::size_t recorded = 0;       ///< Odometry poses, those that are not replayed too; 0: no others.
  std::vector<Timestamp> stamps;  ///< Of the files from 000000 on; none: those of the odometry poses.
};

/// A folder with one scan per odometry pose or stamp, NNNNNN.pcd or KITTI's NNNNNN.bin, in the LiDAR's frame. Scans
/// come out in the body frame of their pose, deskewed by the odometry where points carry times (docs/data.md).
class ScanFolder final : public ScanSource {
 public:
  /// Reads the first scans that are there. Error: the folder holds none of the files, or files of no moment, so that
  /// nobody knows which is whose; or none of the first few can be used; then the first one's error.
  static Result<std::shared_ptr<const ScanFolder>> open(std::filesystem::path folder, ScanMoments moments,
                                                        const Trajectory& odometry, const RobotConfig& robot);

  /// Asked for at keyframes: those that have none are counted among the mission's notes.
  [[nodiscard]] Result<std::optional<Scan>> scan(std::size_t sample) const override;
  /// How the scans are taken, in words.
  [[nodiscard]] std::string note() const;

 private:
  ScanFolder(std::filesystem::path folder, ScanMoments moments, const Trajectory& odometry);
  [[nodiscard]] Status check_numbers() const;
  Status look_into(const RobotConfig& robot);
  [[nodiscard]] Result<std::optional<PointTimes>> times_of(std::size_t sample, const RobotConfig& robot) const;
  [[nodiscard]] tl::unexpected<Error> no_scans() const;
  [[nodiscard]] std::optional<std::filesystem::path> file_of(std::size_t sample) const;

  std::filesystem::path folder_;
  ScanMoments moments_;  // with the stamps of all
  Trajectory odometry_;  // T_odom_body, and a sweep's length beyond either end
  Pose3 T_body_lidar_;
  std::optional<PointTimes> times_;
};

}  // namespace tutti::mission
