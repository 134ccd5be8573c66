// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/bags/ros_messages.hpp"
#include "tutti/base/result.hpp"
#include "tutti/model/visual.hpp"
#include "tutti/program/feed/feed_sensors.hpp"
#include "tutti/program/ros/dds.hpp"
#include "tutti/program/ros/ros_intake.hpp"

namespace tutti::ros {

inline constexpr const char *kImageType = "sensor_msgs/msg/Image", *kCompressedType = "sensor_msgs/msg/CompressedImage",
                            *kCameraInfoType = "sensor_msgs/msg/CameraInfo", *kImuType = "sensor_msgs/msg/Imu";

/// Which cameras and which IMU a robot on ROS's topics has.
struct ImagesConfig {
  std::vector<std::string> images;   ///< Topics; empty: found by type, within the namespace.
  std::string imu;                   ///< A topic; empty: found by type, within the namespace.
  std::string within = "/";          ///< Of the namespace's topics the beginning, "/alpha/"; set by resolve().
  int most_cameras = 2;              ///< RobotConfig::images.most_cameras
  double time_offset_s = 0.0;        ///< Added to the images' stamps gives the odometry's time.
  double most_difference_s = 0.005;  ///< Of the stamps of two cameras' images of one moment.
};

/// Sets `within`, and makes all topics' names full ones. Fails when one is no valid name in ROS.
Status resolve(ImagesConfig& config, const std::string& name_space);

/// The topics of one camera.
struct CameraTopics {
  std::string images, info;
  bool is_compressed = false;
  friend bool operator==(const CameraTopics&, const CameraTopics&) = default;
};

/// Of published topics, one or two cameras, in the order of their names: those of `config`, or all that have a
/// CameraInfo beside them (of which a compressed topic counts only where there is no other). None while they are not
/// published; an error when there are too many, which says how to choose.
Result<std::vector<CameraTopics>> choose_cameras(std::span<const Publication> published, const ImagesConfig& config);
/// The topic of the IMU, by the same rules; empty while there is none.
Result<std::string> choose_imu(std::span<const Publication> published, const ImagesConfig& config);

/// Turns images and IMU samples of ROS 2 into inputs of a robot's live feed, as mission/bag_cameras.cpp does of a bag.
/// Raw images become grey here; compressed ones stay as they are, and the robot decodes them. Bytes are untrusted: an
/// error says what is wrong with a message, which then has no effect.
class ImagesIntake {
 public:
  static constexpr double kLatest_s = 0.5;               ///< Behind odometry; the robot takes none later.
  static constexpr double kPatience_s = 0.3;             ///< By odometry, for the second camera's image of a moment.
  static constexpr double kAhead_s = 0.5;                ///< IMU samples may be that far ahead of odometry.
  static constexpr std::size_t kMostBytes = 48U << 20U;  ///< Images that wait for odometry, before the oldest go.
  static constexpr std::size_t kMostSamples = 20'000;    ///< IMU samples that wait, before the oldest go.

  /// `imu` is empty without an IMU. `odometry` must live as long as this.
  ImagesIntake(ImagesConfig config, std::vector<CameraTopics> cameras, std::string imu, const RosIntake& odometry);

  /// The first valid calibration of a camera counts; images of another size that wait are dropped.
  Status add_info(std::size_t camera, std::string_view cdr);
  Status add_image(std::size_t camera, std::string_view cdr);
  Status add_imu(std::string_view cdr);

  /// Fills in the cameras, once calibration and place of all are known, and the IMU once its place is.
  void describe(program::FeedSensors& sensors) const;
  /// What describe() waits for: "/a/camera_info: no sensor_msgs/CameraInfo"; empty when it has everything.
  [[nodiscard]] std::string missing() const;
  /// The calibration of this camera is known.
  [[nodiscard]] bool has_info(std::size_t camera) const { return cameras_[camera].model.has_value(); }
  /// Everything up to `stamp` has been added.
  [[nodiscard]] bool reaches(Timestamp stamp) const;

  /// The next images that odometry up to `stamp` covers, of both cameras if the second's come in time; nothing when
  /// there are none; an error for images that come too late. After describe() has filled in cameras.
  Result<std::optional<program::FedImages>> next_images(Timestamp stamp);
  /// The IMU samples that the robot takes when odometry is at `stamp`, in the body frame, at most as many as fit a
  /// message. After describe() has filled in the IMU.
  std::vector<ImuSample> next_imu(Timestamp stamp);

 private:
  struct Waiting {
    Timestamp stamp;
    program::EncodedImage image;
    std::uint32_t width = 0, height = 0;  ///< 0: of a file.
  };
  struct OneCamera {
    CameraTopics topics;
    std::optional<CameraModel> model;
    std::optional<std::string> frame;
    std::optional<Timestamp> newest;
    std::deque<Waiting> waiting;
    std::size_t bytes = 0;
    Waiting pop();
  };
  Status push(OneCamera& camera, const bags::RosHeader& header, Waiting waiting);
  static Status check_size(const OneCamera& camera, const Waiting& waiting);
  [[nodiscard]] Result<Camera> place(const OneCamera& camera) const;
  [[nodiscard]] Result<Pose3> imu_place() const;

  ImagesConfig config_;
  std::vector<OneCamera> cameras_;
  std::string imu_;
  const RosIntake& odometry_;
  std::optional<std::string> imu_frame_;
  std::optional<Timestamp> newest_imu_;
  std::deque<ImuSample> samples_;
};

}  // namespace tutti::ros
