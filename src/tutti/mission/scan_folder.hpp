// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tutti/mission/mission_config.hpp"
#include "tutti/model/recording.hpp"
#include "tutti/perception/lidar/scan_times.hpp"

namespace tutti::mission {

/// The stamp of each scan file.
struct ScanStamps {
  std::size_t first = 0;          ///< Number of the file that belongs to the first replayed odometry pose.
  std::size_t recorded = 0;       ///< Number of odometry poses, including those not replayed; 0: there are no others.
  std::vector<Timestamp> stamps;  ///< Stamps of the files from 000000 on; empty: those of the odometry poses.
};

/// Learns what the times of a recording's `count` scans mean, by what `times_of` finds of one: tries the first ones,
/// and at doubling distances from there on up to the last, as a LiDAR that spins up, or a driver that waits for a fix,
/// sends empty ones for long. Fails with the first one's error where none can be used.
Result<std::optional<lidar::PointTimes>> learn_times(
    std::size_t count, const std::function<Result<std::optional<lidar::PointTimes>>(std::size_t scan)>& times_of);

/// A folder with one scan per odometry pose or stamp, NNNNNN.pcd or KITTI's NNNNNN.bin, in the LiDAR's frame. Scans are
/// returned in the body frame of their pose, deskewed by the odometry where points have times (docs/data.md).
class ScanFolder final : public ScanSource {
 public:
  /// Opens the folder and reads its first scans. Fails when it has none of the files, or files beyond the stamps, so
  /// that they cannot be assigned; or as learn_times() does.
  static Result<std::shared_ptr<const ScanFolder>> open(std::filesystem::path folder, ScanStamps times,
                                                        const Trajectory& odometry, const RobotConfig& robot);

  /// The scan of stamp number `sample`; keyframes without a scan are counted in the mission's notes.
  [[nodiscard]] Result<std::optional<Scan>> scan(std::size_t sample) const override;
  /// How the scans are used, in words.
  [[nodiscard]] std::string note() const;

 private:
  ScanFolder(std::filesystem::path folder, ScanStamps times, const Trajectory& odometry);
  [[nodiscard]] Status check_numbers() const;
  Status learn_times(const RobotConfig& robot);
  [[nodiscard]] Result<std::optional<lidar::PointTimes>> times_of(std::size_t sample, const RobotConfig& robot) const;
  [[nodiscard]] tl::unexpected<Error> no_scans() const;
  [[nodiscard]] std::optional<std::filesystem::path> file_of(std::size_t sample) const;

  std::filesystem::path folder_;
  ScanStamps times_of_files_;  // with the stamps of all files
  Trajectory odometry_;        // T_odom_body, extended by a sweep's length at both ends
  Pose3 T_body_lidar_;
  std::optional<lidar::PointTimes> times_;
};

}  // namespace tutti::mission
