// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tutti/bags/ros_types.hpp"
#include "tutti/base/result.hpp"
#include "tutti/intake/camera_topics.hpp"
#include "tutti/intake/images_intake.hpp"
#include "tutti/intake/ros_intake.hpp"
#include "tutti/model/input.hpp"

namespace tutti::intake {

/// A message of ROS as it came.
struct RawMessage {
  std::string_view topic;     ///< As whoever subscribes it calls it; transforms are on "/tf" and "/tf_static".
  std::string_view type;      ///< "nav_msgs/msg/Odometry"
  std::string_view encoding;  ///< As bags have it: "cdr", "ros1".
  std::string_view bytes;
};

/// How a robot's messages are read.
struct SensorConfig {
  IntakeConfig odometry;
  ImagesConfig images;
};

/// The topics of images and depth that `config` names. Fails unless these are none, one camera, perhaps with depth, or
/// two cameras, and an IMU only beside these.
Result<std::vector<CameraTopics>> named_topics(const ImagesConfig& config);

/// Turns a robot's messages of ROS into its inputs: (topic, type, encoding, bytes) -> Input, by one table of types and
/// one set of rules for clocks, transforms, cameras and depth (RosIntake, ImagesIntake). It waits for what belongs
/// together, needs no clock, and reports what it makes of the messages. Bytes are untrusted: an error states what is
/// wrong with a message, which then has no effect.
class SensorIntake {
 public:
  /// Topics of images that show nothing for waiting::kUnknown_s after the first of them are left out.
  explicit SensorIntake(IntakeConfig config) : ros_(std::move(config)) {}
  /// From now on images of `topics`, and with them samples of `imu` (may be empty), are taken.
  void take_images(ImagesConfig config, std::vector<CameraTopics> topics, std::string imu);

  Status add(const RawMessage& message);
  /// The next input that is due, in the order in which a robot wants them; nothing when more must come first. An error
  /// when one is left out. Scans that are not wanted are skipped.
  Result<std::optional<Input>> next(bool wants_scan);
  /// Where nothing may be lost: odometry waits for the scans, and for the images and IMU samples, that come with it.
  /// For images it waits no longer than waiting::kHeld_s, and while there is room for those that came.
  void hold_odometry(bool for_scans, bool for_images) {
    holds_for_scans_ = for_scans;
    holds_for_images_ = for_images;
  }
  /// Messages on this topic of a camera are of use: before it is known which of them are, of all.
  [[nodiscard]] bool wants(std::string_view topic) const;
  /// Images are taken, or may be: what their topics send allows it.
  [[nodiscard]] bool may_see() const { return images_.has_value(); }
  /// Nothing more comes that would be worth waiting for.
  void end() {
    is_last_ = true;
    ros_.end();
  }

  /// Cameras, depth and IMU, as far as they are known.
  [[nodiscard]] const Sensors& sensors() const { return sensors_; }
  /// Why no images, depth or IMU are used; empty while nothing is missing.
  [[nodiscard]] const std::string& missing() const { return missing_; }
  /// How messages are read, reported once after each change: points' times, places of antennas, cameras.
  std::vector<std::string> take_notes() { return std::exchange(notes_, {}); }
  /// Adds a note, unless it is empty.
  void note(std::string text) {
    if (!text.empty()) notes_.push_back(std::move(text));
  }
  [[nodiscard]] RosIntake& odometry() { return ros_; }
  [[nodiscard]] const RosIntake& odometry() const { return ros_; }

 private:
  struct Row;
  static std::span<const Row> rows();
  Status take_camera(std::string_view topic, std::string_view bytes, bags::RosEncoding encoding, bool is_info);
  Status take_battery(std::string_view bytes, bags::RosEncoding encoding);
  void check_missing(bool is_new);
  void choose();
  Result<std::optional<Input>> next_beside(bool wants_scan);
  [[nodiscard]] bool waits_for_images() const;

  RosIntake ros_;
  std::optional<ImagesIntake> images_;
  std::vector<CameraTopics> topics_;
  std::string imu_, points_;  ///< Topics.
  std::optional<Health> health_;
  std::optional<Timestamp> fed_;                   ///< Odometry's newest that next() returned.
  std::optional<Timestamp> first_image_, looked_;  ///< By odometry's time.
  bool is_last_ = false, holds_for_scans_ = false, holds_for_images_ = false;
  Sensors sensors_;
  std::string missing_;
  std::vector<std::string> notes_;
};

}  // namespace tutti::intake
