// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tutti/bags/image_topic.hpp"
#include "tutti/bags/ros_messages.hpp"
#include "tutti/base/result.hpp"
#include "tutti/intake/camera_topics.hpp"
#include "tutti/intake/ros_intake.hpp"
#include "tutti/model/sensors.hpp"
#include "tutti/model/visual.hpp"

namespace tutti::intake {

/// Turns images and IMU samples of ROS 2 into inputs of a robot's live feed, as mission/bag_cameras.cpp does of a bag.
/// Which topics are cameras and which is their depth is chosen once the first image of each has come. Raw images become
/// grey here, raw depth millimetres; compressed ones stay as they are where the robot can decode them. Bytes are
/// untrusted: an error states what is wrong with a message, which then has no effect.
class ImagesIntake {
 public:
  using Encoding = bags::RosEncoding;
  static constexpr std::size_t kMostBytes = 48U << 20U;  ///< Images that wait for odometry, before the oldest go.
  static constexpr std::size_t kMostSamples = 20'000;    ///< IMU samples that wait, before the oldest go.

  /// `imu` is empty without an IMU. `odometry` must live as long as this.
  ImagesIntake(ImagesConfig config, std::vector<CameraTopics> topics, std::string imu, const RosIntake& odometry);

  /// The first valid calibration of a camera counts; images of another size that wait are dropped.
  Status add_info(std::size_t topic, std::string_view bytes, Encoding encoding = Encoding::cdr);
  Status add_image(std::size_t topic, std::string_view bytes, Encoding encoding = Encoding::cdr);
  Status add_imu(std::string_view bytes, Encoding encoding = Encoding::cdr);

  /// Chooses cameras and depth by bags::choose_cameras(), once the first image of every topic has come, and calibration
  /// and place of the cameras are known; `is_late`: topics that nobody named and that have sent nothing are left out.
  /// False while something is missing; an error when it cannot be chosen, which explains how to choose.
  Result<bool> choose(bool is_late);
  /// The first image of any topic has come.
  [[nodiscard]] bool has_any_image() const;
  [[nodiscard]] bool is_chosen() const { return !cameras_.empty(); }
  /// Messages of this topic are of use: before the choice of all.
  [[nodiscard]] bool uses(std::size_t topic) const;
  /// "/left/image_raw and /right/image_raw", "/image_raw with depth of /depth/image_raw"; of a choice.
  [[nodiscard]] std::string in_words() const;
  /// Why no depth is used although there is some; else empty.
  [[nodiscard]] const std::string& note() const { return note_; }

  /// Fills in the cameras and their depth, once they are chosen, and the IMU once its place is known.
  void describe(Sensors& sensors) const;
  /// The messages still waited for: "/a/camera_info: no sensor_msgs/CameraInfo"; empty when there is everything.
  [[nodiscard]] std::string missing() const;
  /// The calibration of this topic's camera is known.
  [[nodiscard]] bool has_info(std::size_t topic) const { return topics_[topic].model.has_value(); }
  /// Everything up to `stamp` has been added.
  [[nodiscard]] bool reaches(Timestamp stamp) const;
  /// Waiting messages take half of the room: a topic has ended, or another is far behind.
  [[nodiscard]] bool is_filling() const;

  /// The next images that odometry up to `stamp` covers, of both cameras if the second's come in time; nothing when
  /// there are none; an error when depth cannot be read. Images that come too late the robot refuses, as any client's.
  /// With `is_last` nothing more comes. After describe() has filled in cameras.
  Result<std::optional<EncodedImages>> next_images(Timestamp stamp, bool is_last = false);
  /// Drops images that are too late when odometry is at `stamp`.
  void drop_late(Timestamp stamp);
  /// The IMU samples that the robot takes when odometry is at `stamp`, in the body frame, at most as many as fit a
  /// message. After describe() has filled in the IMU.
  std::vector<ImuSample> next_imu(Timestamp stamp);

 private:
  struct Waiting {
    Timestamp stamp;
    EncodedImage image;
    std::uint32_t width = 0, height = 0;  ///< 0: of a file.
  };
  struct OneTopic {
    CameraTopics topics;
    bags::ImageTopic seen;
    std::optional<CameraModel> model;  ///< By a valid CameraInfo.
    std::optional<Timestamp> newest;
    std::deque<Waiting> waiting;
    std::size_t bytes = 0;
    Waiting pop();
    void drop_before(Timestamp stamp);
  };
  using Numbers = std::vector<std::size_t>;
  [[nodiscard]] std::size_t most_bytes() const;  ///< That a topic's images may take.
  static Status check_size(const OneTopic& topic, const Waiting& waiting);
  /// Nothing while a topic must be waited for.
  Result<std::optional<std::pair<Numbers, Numbers>>> cameras_and_depths(bool is_late) const;
  [[nodiscard]] Result<Camera> place(const OneTopic& camera) const;
  [[nodiscard]] Result<Pose3> imu_place() const;
  std::optional<EncodedImage> second_of(Timestamp instant);
  Result<std::optional<EncodedImage>> depth_of(Timestamp instant);

  ImagesConfig config_;
  std::vector<OneTopic> topics_;
  Numbers cameras_;  ///< Positions in topics_; none before the choice.
  std::optional<std::size_t> depth_;
  std::string note_;
  std::string imu_;
  const RosIntake& odometry_;
  std::optional<std::string> imu_frame_;
  std::optional<Timestamp> newest_imu_;
  std::deque<ImuSample> samples_;
};

}  // namespace tutti::intake
