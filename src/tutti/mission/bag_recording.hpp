// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/mission/bag_index.hpp"
#include "tutti/mission/mission_config.hpp"
#include "tutti/mission/robot_images.hpp"
#include "tutti/model/recording.hpp"

namespace tutti::mission {

/// A camera of a bag with its images.
struct BagCamera {
  std::string topic;
  Camera camera;
  std::vector<ScanPlace> images;
  bool is_compressed = false;
};

/// What a mission takes of a bag.
struct BagRecording {
  std::string file;
  Trajectory odometry;           ///< T_odom_body
  std::string scan_topic;        ///< Empty: it has no scans.
  std::vector<ScanPlace> scans;  ///< Stamps increase.
  Pose3 T_body_lidar;
  std::vector<BagCamera> cameras;  ///< None, one or two;
  std::string no_images;           ///< of none: why.
  std::vector<ImuSample> imu;      ///< In the body frame.
  std::vector<std::string> notes;  ///< What was taken, what was refused and why; for the report.
};

/// Reads `robot.bag` once. Topics are found by their types: nav_msgs/Odometry, else a pair of frames of /tf called odom
/// and something, else geometry_msgs/PoseStamped; and sensor_msgs/PointCloud2. Where several would do, or one that
/// `robot.topics` names is not there, the error lists them. The LiDAR is where `robot.T_body_lidar` says, else where
/// /tf_static (and what never moves of /tf) has it; where nothing says it that is an error, which says how to. Messages
/// that are no good are left out and counted among the notes.
/// `with_images`: cameras are the topics of images that are pictures and have a CameraInfo beside them and a place on
/// the body by the bag's transforms; the IMU must be in the body's origin. What lacks something of these is not used,
/// and said.
Result<BagRecording> read_bag(const std::filesystem::path& data, const RobotConfig& robot, bool with_images = false);

/// Its scans, each read from the bag when it is asked for, so that no more than one chunk of it is in memory; in the
/// body frame, deskewed by `odometry` where points carry times. The error names topic and message.
Result<std::shared_ptr<const ScanSource>> open_scans(const BagRecording& bag, const Trajectory& odometry,
                                                     const RobotConfig& robot, std::string& note);

/// Points followed through its images, each read when it is asked for; of a bag with cameras.
Result<RobotImages> open_images(const BagRecording& bag, const Trajectory& odometry, const RobotConfig& robot,
                                const visual::TrackingConfig& tracking);

/// What read_bag() takes of cameras and IMU: of bag_cameras.cpp.
void take_cameras(const BagIndex& index, const std::string& body, const RobotConfig& robot, BagRecording& out);

}  // namespace tutti::mission
