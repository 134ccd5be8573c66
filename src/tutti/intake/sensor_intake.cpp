// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/intake/sensor_intake.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <set>

#include "tutti/bags/camera.hpp"
#include "tutti/bags/robot_namespace.hpp"
#include "tutti/bags/transform_tree.hpp"
#include "tutti/base/plain_text.hpp"

namespace tutti::intake {
namespace {

constexpr double kCheck_s = 0.5;  // between two checks for what is missing, by odometry's time

bool is_compressed(const std::string& topic) {
  return topic.ends_with("/compressed") || topic.ends_with("/compressedDepth");  // as image_transport names them
}

CameraTopics topics_of(const std::string& images, Wish wish) {
  const bool needs_info = wish == Wish::camera;  // depth may go without
  return {images, bags::camera_info_topic(images, is_compressed(images)), is_compressed(images), needs_info, wish};
}

}  // namespace

Result<std::vector<CameraTopics>> named_topics(const ImagesConfig& config) {
  std::vector<CameraTopics> out;
  std::set<std::string> infos;
  for (const std::string& images : config.images) {
    out.push_back(topics_of(images, Wish::camera));
    infos.insert(out.back().info);
  }
  if (out.size() > 2 || infos.size() < out.size())
    return fail(ErrorCode::invalid,
                "images are of '{}', expected the topics of one camera or two, each with a camera_info of its own "
                "beside it",
                fmt::join(config.images, ","));
  if (!config.depth.empty() && out.size() != 1)
    return fail(ErrorCode::invalid, "depth is of '{}' beside {} topics of images, expected those of one camera",
                config.depth, out.size());
  if (!config.imu.empty() && out.empty())
    return fail(ErrorCode::invalid, "the IMU is of '{}' without images, with which it would go", config.imu);
  if (!config.depth.empty()) out.push_back(topics_of(config.depth, Wish::depth));
  return out;
}

/// How messages of one use are taken.
struct SensorIntake::Row {
  bags::Use use;
  Status (*take)(SensorIntake&, const RawMessage&, bags::RosEncoding);
  bool is_of_sensors = false;  ///< After it more may be known of cameras and IMU.
};

std::span<const SensorIntake::Row> SensorIntake::rows() {
  using Self = SensorIntake;
  using bags::RosEncoding, bags::Use;
  static constexpr auto kTakeAntenna = [](Self& to, const RawMessage& in, RosEncoding encoding) {
    return to.ros_.add_antenna(in.topic, in.type, in.bytes, encoding);
  };
  static constexpr std::array kRows{
      Row{Use::odometry, [](Self& to, const RawMessage& in,
                            RosEncoding encoding) { return to.ros_.add_odometry(in.bytes, encoding); }},
      Row{Use::transforms,
          [](Self& to, const RawMessage& in, RosEncoding encoding) {
            const bool is_of_all = in.topic == "/tf" || in.topic == "/tf_static";
            return to.ros_.add_tf(in.bytes, bags::is_static_tf(in.topic),
                                  is_of_all ? RosIntake::TfOf::all : RosIntake::TfOf::robot, encoding);
          },
          true},
      Row{Use::fixes, kTakeAntenna},
      Row{Use::ranges, kTakeAntenna},
      Row{Use::battery,
          [](Self& to, const RawMessage& in, RosEncoding encoding) { return to.take_battery(in.bytes, encoding); }},
      Row{Use::imu,
          [](Self& to, const RawMessage& in, RosEncoding encoding) {
            return to.images_ && in.topic == to.imu_ ? to.images_->add_imu(in.bytes, encoding) : Status();
          },
          true},
      Row{Use::calibration,
          [](Self& to, const RawMessage& in, RosEncoding encoding) {
            return to.take_camera(in.topic, in.bytes, encoding, true);
          },
          true},
      Row{Use::images,
          [](Self& to, const RawMessage& in, RosEncoding encoding) {
            return to.take_camera(in.topic, in.bytes, encoding, false);
          },
          true},
      Row{Use::scans, [](Self& to, const RawMessage& in, RosEncoding encoding) {
            to.points_ = in.topic;
            return to.ros_.add_points(in.bytes, in.type, encoding);
          }}};
  return kRows;
}

void SensorIntake::take_images(ImagesConfig config, std::vector<CameraTopics> topics, std::string imu) {
  topics_ = topics;
  imu_ = imu;
  images_.reset();
  sensors_ = {};
  if (!topics.empty()) images_.emplace(std::move(config), std::move(topics), std::move(imu), ros_);
}

Status SensorIntake::add(const RawMessage& message) {
  const std::string topic = plain_text(message.topic, 80);
  const auto encoding = bags::to_encoding(message.encoding);
  if (!encoding) return in_context(topic, encoding.error());
  const auto row = std::ranges::find(rows(), bags::use_of(message.type), &Row::use);
  if (row == rows().end()) {
    std::vector<std::string_view> types;
    for (const bags::RosType& type : bags::ros_types())
      if (std::ranges::find(rows(), type.use, &Row::use) != rows().end()) types.push_back(type.name);
    return fail(ErrorCode::unsupported, "{}: messages of type '{}', expected one of {}", topic,
                plain_text(message.type, 80), fmt::join(types, ", "));
  }
  const Status taken = row->take(*this, message, *encoding);
  check_missing(row->is_of_sensors);
  return taken ? taken : in_context(topic, taken.error());
}

Status SensorIntake::take_camera(std::string_view topic, std::string_view bytes, bags::RosEncoding encoding,
                                 bool is_info) {
  Status first;
  for (std::size_t i = 0; images_ && i < topics_.size(); ++i) {
    if (topic != (is_info ? topics_[i].info : topics_[i].images) || !images_->uses(i)) continue;
    Status ok = is_info ? images_->add_info(i, bytes, encoding) : images_->add_image(i, bytes, encoding);
    if (first) first = std::move(ok);
  }
  return first;
}

/// A value that is no number, or no share of 1, is one that the robot's driver does not know.
Status SensorIntake::take_battery(std::string_view bytes, bags::RosEncoding encoding) {
  const auto message = bags::decode_battery_state(bytes, encoding);
  if (!message) return tl::unexpected(message.error());
  Health health;
  if (message->voltage_v >= 0.0F) health.battery_v = static_cast<double>(message->voltage_v);
  if (message->percentage >= 0.0F && message->percentage <= 1.0F)
    health.battery_percent = 100.0 * static_cast<double>(message->percentage);
  health_ = health;
  return {};
}

/// Finds what can be known of cameras and IMU now; while nothing new is to be expected, not at every message.
void SensorIntake::check_missing(bool is_new) {
  if (!images_) return;
  if (!images_->is_chosen()) choose();
  if (!images_) return;
  const bool is_early = looked_ && fed_ && *fed_ >= *looked_ && *fed_ - *looked_ < kCheck_s;
  const bool is_complete = missing_.empty() && !sensors_.cameras.empty();
  if (is_early && (is_complete || !is_new)) return;
  looked_ = fed_;
  images_->describe(sensors_);
  missing_ = images_->missing();
}

void SensorIntake::choose() {
  if (!first_image_ && images_->has_any_image()) first_image_ = fed_;
  const bool is_late = first_image_ && fed_ && *fed_ - *first_image_ > waiting::kUnknown_s;
  const auto chosen = images_->choose(is_late);
  if (!chosen) {
    missing_ = "no images are used: " + chosen.error().message;
    images_.reset();
    return;
  }
  if (!*chosen) return;
  note(fmt::format("takes images of {}, {}", images_->in_words(), imu_.empty() ? "no IMU" : imu_));
  note(images_->note());
  if (fed_) images_->drop_late(*fed_);
}

Result<std::optional<Input>> SensorIntake::next(bool wants_scan) {
  auto out = next_beside(wants_scan);
  for (std::string text = ros_.take_note(); !text.empty(); text.clear()) note(text);
  if (!out || *out) return out;
  if (waits_for_images()) return out;
  const auto sample = ros_.next_odometry(holds_for_scans_);
  if (!sample) return out;
  fed_ = sample->stamp;
  return std::optional<Input>(*sample);
}

bool SensorIntake::waits_for_images() const {
  const auto waiting = ros_.waiting();
  if (!holds_for_images_ || !waiting || waiting->second - waiting->first > waiting::kHeld_s) return false;
  if (sensors_.cameras.empty()) return true;
  return images_ && !images_->is_filling() && !images_->reaches(waiting->first);
}

bool SensorIntake::wants(std::string_view topic) const {
  if (!images_) return false;
  for (std::size_t i = 0; i < topics_.size(); ++i)
    if (images_->uses(i) && (topic == topics_[i].images || (topic == topics_[i].info && !images_->has_info(i))))
      return true;
  return topic == imu_;
}

/// The next input that odometry has reached.
Result<std::optional<Input>> SensorIntake::next_beside(bool wants_scan) {
  if (health_) return std::optional<Input>(*std::exchange(health_, std::nullopt));
  if (auto sample = ros_.next_antenna()) return sample;
  if (images_ && fed_ && !sensors_.cameras.empty()) {
    if (sensors_.imu)
      if (auto samples = images_->next_imu(*fed_); !samples.empty()) return std::optional<Input>(std::move(samples));
    auto images = images_->next_images(*fed_, is_last_);
    if (!images) return in_context(images_->in_words(), images.error());
    if (*images) return std::optional<Input>(std::move(**images));
  }
  auto scan = ros_.next_scan(wants_scan);
  if (!scan) return in_context(points_, scan.error());
  if (*scan) return std::optional<Input>(std::move(**scan));
  return std::optional<Input>();
}

}  // namespace tutti::intake
