// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/drive/image_tally.hpp"
#include "tutti/drive/stopwatch.hpp"
#include "tutti/model/input.hpp"
#include "tutti/node/robot_node.hpp"

namespace tutti::drive {

/// A robot's node with the rules of how it is fed, whoever feeds it (a recording, or a client of the live feed) and at
/// what pace: which scans it is given, when points are tracked in images, what is reported of inputs that do not reach
/// the node.
class Driver {
 public:
  explicit Driver(std::unique_ptr<node::RobotNode> node) : node_(std::move(node)) {}

  [[nodiscard]] const node::RobotNode& node() const { return *node_; }
  // As RobotNode's functions with these names; the steps that they make wait for take_step().
  void resume(Timestamp now) { take(node_->resume(now)); }
  void on_timer(Timestamp now) { take(node_->on_timer(now)); }
  void finish(Timestamp now) { take(node_->finish(now)); }
  void store_all() { take(node_->store_all()); }
  void begin_session(const std::string& why, Timestamp now) { take(node_->begin_session(why, now)); }
  void expect_sensors(bool scans, bool images) { node_->expect_sensors(scans, images); }
  void receive(const bus::Envelope& envelope, Timestamp now);
  /// Takes any input but encoded images, for which there is see(). A scan of the newest sample that the node does not
  /// want is left out; one of another time was sent before anybody knew, and the node decides.
  void add(const Input& input, Timestamp now);

  /// Points that were tracked through the images of one time, and an error for each image that could not be used.
  struct Seen {
    TrackedImages images;
    std::vector<Error> errors;
  };
  /// Follows points through the next images. Descriptors, which cost most, are computed only for a keyframe.
  using Track = std::function<Seen(bool keyframe)>;
  /// The IMU's samples since the keyframe of that stamp, until the images.
  using ImuSince = std::function<std::vector<ImuSample>(Timestamp keyframe)>;
  /// Takes the images of one time: points are tracked through all, and the node is given those of keyframes. The first
  /// of a row of errors is an event, the others are counted.
  void see(Timestamp stamp, const Track& track, const ImuSince& imu, Timestamp now);
  /// Reports that a scan which the node wanted could not be read.
  void refuse_scan(const std::string& why, Timestamp now);

  /// Returns what the node has to write, send and report since the last call.
  node::Step take_step() { return std::exchange(step_, {}); }
  /// How long updates of the map took, since the last call.
  std::vector<UpdateTime> take_update_times() { return std::exchange(update_times_, {}); }
  [[nodiscard]] double cpu_s() const { return cpu_s_; }       ///< The node's.
  [[nodiscard]] std::size_t scans() const { return scans_; }  ///< Those that the node took.
  [[nodiscard]] const ImageTally& sight() const { return sight_; }
  /// Errors of images that are no events, because the images before had errors, too.
  [[nodiscard]] std::size_t more_image_errors() const { return more_image_errors_; }

 private:
  void take(node::Step step) { step_.add(std::move(step)); }
  void refuse_images(const std::string& why, Timestamp now);
  void note(const std::vector<Error>& image_errors, Timestamp now);

  std::unique_ptr<node::RobotNode> node_;
  node::Step step_;
  std::vector<UpdateTime> update_times_;
  double cpu_s_ = 0.0;
  std::size_t scans_ = 0;
  ImageTally sight_;
  bool images_fail_ = false;  // the last ones
  std::size_t more_image_errors_ = 0;
};

}  // namespace tutti::drive
