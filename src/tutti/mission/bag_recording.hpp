// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/mission/bag_index.hpp"
#include "tutti/mission/mission_config.hpp"
#include "tutti/mission/robot_images.hpp"
#include "tutti/model/recording.hpp"

namespace tutti::mission {

/// The images of one topic.
struct BagImages {
  std::string topic;
  std::vector<ScanPlace> images;
  bool is_compressed = false;
};
struct BagCamera : BagImages {
  Camera camera;
};

/// The part of a bag that a mission uses.
struct BagRecording {
  std::string file;
  Trajectory odometry;           ///< T_odom_body
  std::string scan_topic;        ///< Empty: the bag has no scans.
  std::vector<ScanPlace> scans;  ///< Stamps increase.
  Refusals refused_scans;
  Pose3 T_body_lidar;
  std::vector<BagCamera> cameras;     ///< None, one or two.
  std::optional<BagImages> depth;     ///< Registered to the only camera.
  std::string no_images;              ///< Why there are no cameras.
  std::vector<ImuSample> imu;         ///< In the body frame.
  std::string fix_topic, fix_note;    ///< Empty: the bag has no fixes; and where the antenna is, and more.
  std::vector<Input> measured;        ///< Recording::measured, but the other robots are named, not numbered.
  std::vector<std::string> notes;     ///< Say what was used, what was refused and why, for the report.
  std::vector<std::string> warnings;  ///< much_left_out()
};

/// Reads `robot.bag` once. Topics are found by type. Odometry is nav_msgs/Odometry, else a pair of frames of /tf called
/// odom and something, else geometry_msgs/PoseStamped; scans are bags::kScanTypes. When several topics would do,
/// or `robot.topics` names one that does not exist, the error lists them. In a bag of several robots, what is in the
/// robot's namespace counts (keep_robot()). The LiDAR's pose is `robot.T_body_lidar`,
/// else from /tf_static (and frames of /tf that never move); having neither is an error with advice. Invalid
/// messages are left out and counted in the notes. With `with_images`, cameras are the image topics that show pictures,
/// have a CameraInfo beside them, and have a pose on the body by the bag's transforms; depth is as bags::is_depth() and
/// bags::choose_cameras() have it. The IMU must be in the body's origin. Sensors that lack any of this are not used,
/// and the notes list them.
Result<BagRecording> read_bag(const std::filesystem::path& data, const RobotConfig& robot, bool with_images = false);

/// The bag's scans, each read when it is asked for, so that at most one chunk of the bag is in memory. They are in the
/// body frame, deskewed by `odometry` where points have times. Errors name topic and message.
Result<std::shared_ptr<const ScanSource>> open_scans(const BagRecording& bag, const Trajectory& odometry,
                                                     const RobotConfig& robot, std::string& note);

/// Points tracked through the bag's images, each read when it is needed; for bags with cameras.
Result<RobotImages> open_images(const BagRecording& bag, const Trajectory& odometry, const RobotConfig& robot,
                                const visual::TrackingConfig& tracking);

/// The part of read_bag() that deals with position fixes and ranges (bag_antennas.cpp): their antennas are where
/// bags::place_antenna() has them, and what is by another clock than odometry's is refused, as of a live topic. It
/// counts as refused in the index.
Status take_antennas(BagIndex& index, const OdometryTrack& odometry, const RobotConfig& robot, BagRecording& out);

/// The part of read_bag() that deals with cameras and IMU (bag_cameras.cpp).
void take_cameras(const BagIndex& index, const std::string& body, const RobotConfig& robot, BagRecording& out);

}  // namespace tutti::mission
