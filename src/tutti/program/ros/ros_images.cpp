// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/ros/ros_images.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <utility>

#include "tutti/bags/ros_definitions.hpp"
#include "tutti/bags/ros_types.hpp"
#include "tutti/program/clock.hpp"
#include "tutti/program/ros/image_topics.hpp"

namespace tutti::ros {
namespace {

constexpr double kCheck_s = 0.5;  // what is published together is discovered together

/// "sensor_msgs/msg/Image and CompressedImage that are published: /a, /b"
std::string images_of(const std::vector<Publication>& published) {
  std::vector<std::string> names;
  for (const Publication& topic : published)
    if (topic.type == bags::kImageType || topic.type == bags::kCompressedType) names.push_back(topic.topic);
  return fmt::format("topics of sensor_msgs/Image and CompressedImage here are: {}",
                     names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", ")));
}

}  // namespace

RosImages::RosImages(Options options, std::shared_ptr<Participant> participant, Complaints& complaints)
    : options_(std::move(options)),
      participant_(std::move(participant)),
      complaints_(complaints),
      begin_s_(program::Clock::steady_s()) {}

void RosImages::check_topics(program::LocalClient& client) {
  const double now_s = program::Clock::steady_s();
  if (now_s - checked_s_ < kCheck_s) return;
  checked_s_ = now_s;
  if (readers_.empty())
    find(client, now_s);
  else
    give_up(client, now_s);
}

/// Topics chosen by type must be the same twice in a row: of two cameras one may be discovered first.
void RosImages::find(program::LocalClient& client, double now_s) {
  const std::vector<Publication> published = participant_->publications();
  const auto topics = find_images(published, options_.config);
  if (!topics) return complaints_.add("no images are used", tl::unexpected(topics.error()));
  const auto imu = choose_imu(published, options_.config);
  if (!imu) complaints_.add("no IMU is used", tl::unexpected(imu.error()));
  const bool is_same = seen_ == *topics && seen_imu_ == imu.value_or("");
  seen_ = *topics;
  seen_imu_ = imu.value_or("");
  if (!topics->empty() && *topics == refused_) return;
  if (!topics->empty() && is_same) {
    if (const Status ok = subscribe(*topics, seen_imu_); !ok) return complaints_.add("no images are used", ok);
    client.use_intake([&](intake::SensorIntake& robot) { robot.take_images(options_.config, *topics, seen_imu_); });
    begin_s_ = now_s;
  } else if (topics->empty() && said_.empty() && now_s - begin_s_ > options_.patience_s) {
    std::vector<std::string> named = options_.config.images;
    if (!options_.config.depth.empty()) named.push_back(options_.config.depth);
    said_ = named.empty()
                ? fmt::format("of no topic below {} with a sensor_msgs/CameraInfo beside it", options_.config.within)
                : fmt::format("{} is not published", fmt::join(named, " or "));
    options_.say(program::Level::warning, fmt::format("no images yet: {}; {}", said_, images_of(published)));
  }
}

Status RosImages::subscribe(const std::vector<intake::CameraTopics>& topics, const std::string& imu) {
  std::vector<std::unique_ptr<Reader>> readers;
  const auto add = [&](const std::string& topic, const char* type, int depth) -> Status {
    const Qos qos{.reliable = options_.lossless, .latched = false, .depth = options_.lossless ? 0 : depth};
    auto made = participant_->reader(topic, type, qos, bags::ros_type_hash(type));
    if (!made) return tl::unexpected(made.error());
    readers.push_back(std::move(*made));
    return {};
  };
  constexpr int kImagesDepth = 10, kImuDepth = 2000;  // how long this thread may be blocked
  for (const intake::CameraTopics& topic : topics) {
    if (Status ok = add(topic.info, bags::kCameraInfoType, kImagesDepth); !ok) return ok;
    const char* const type = topic.is_compressed ? bags::kCompressedType : bags::kImageType;
    if (Status ok = add(topic.images, type, kImagesDepth); !ok) return ok;
  }
  if (!imu.empty())
    if (Status ok = add(imu, bags::kImuType, kImuDepth); !ok) return ok;
  readers_ = std::move(readers);
  return {};
}

/// Where no cameras can be chosen of these topics, all.
void RosImages::give_up(program::LocalClient& client, double now_s) {
  std::string missing;
  client.use_intake([&](const intake::SensorIntake& robot) {
    if (!robot.may_see()) refused_ = seen_;
    std::erase_if(readers_, [&](const auto& reader) { return !robot.wants(reader->topic()); });
    missing = robot.missing();
  });
  const bool is_final = readers_.empty();
  if (missing.empty() || missing == said_ || (!is_final && now_s - begin_s_ < options_.patience_s)) return;
  options_.say(program::Level::warning, said_ = std::move(missing));
}

void RosImages::take(const std::function<void(Reader&)>& take) const {
  for (const std::unique_ptr<Reader>& reader : readers_) take(*reader);
}

}  // namespace tutti::ros
