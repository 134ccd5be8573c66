// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/ros/ros_images.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <utility>

#include "tutti/bags/ros_definitions.hpp"
#include "tutti/program/clock.hpp"

namespace tutti::ros {
namespace {

constexpr double kLook_s = 0.5;  // what is published together is discovered together
constexpr double kLongest_s = 5.0;

/// "sensor_msgs/msg/Image and CompressedImage that are published: /a, /b"
std::string images_of(const std::vector<Publication>& published) {
  std::vector<std::string> names;
  for (const Publication& topic : published)
    if (topic.type == kImageType || topic.type == kCompressedType) names.push_back(topic.topic);
  return fmt::format("topics of sensor_msgs/Image and CompressedImage here are: {}",
                     names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", ")));
}

}  // namespace

RosImages::RosImages(Options options, std::shared_ptr<Participant> participant, const RosIntake& odometry,
                     Complaints& complaints)
    : options_(std::move(options)),
      participant_(std::move(participant)),
      odometry_(odometry),
      complaints_(complaints),
      begin_s_(program::Clock::steady_s()) {}

/// What is chosen by type must be the same twice: of two cameras one may be discovered first.
void RosImages::look(double now_s) {
  if (now_s - looked_s_ < kLook_s) return;
  looked_s_ = now_s;
  const std::vector<Publication> published = participant_->publications();
  const auto cameras = choose_cameras(published, options_.config);
  if (!cameras) return complaints_.add("no images are used", tl::unexpected(cameras.error()));
  const auto imu = choose_imu(published, options_.config);
  if (!imu) complaints_.add("no IMU is used", tl::unexpected(imu.error()));
  const bool is_same = seen_ == *cameras && seen_imu_ == imu.value_or("");
  seen_ = *cameras;
  seen_imu_ = imu.value_or("");
  if (!cameras->empty() && is_same) {
    if (const Status ok = subscribe(*cameras, seen_imu_); !ok) complaints_.add("no images are used", ok);
    begin_s_ = now_s;
  } else if (cameras->empty() && said_.empty() && now_s - begin_s_ > options_.patience_s) {
    said_ = options_.config.images.empty()
                ? fmt::format("of no topic below {} with a sensor_msgs/CameraInfo beside it", options_.config.within)
                : fmt::format("{} is not published", fmt::join(options_.config.images, " or "));
    options_.say(program::Level::warning, fmt::format("no images yet: {}; {}", said_, images_of(published)));
  }
}

Status RosImages::subscribe(const std::vector<CameraTopics>& cameras, const std::string& imu) {
  const auto make = [&](const std::string& topic, const char* type, int depth) {
    const Qos qos{.reliable = options_.lossless, .latched = false, .depth = options_.lossless ? 0 : depth};
    return participant_->reader(topic, type, qos, bags::ros_type_hash(type));
  };
  constexpr int kImagesDepth = 10, kImuDepth = 2000;  // how long this thread may be held up
  std::vector<std::unique_ptr<Reader>> images, infos;
  std::string names;
  for (const CameraTopics& camera : cameras) {
    auto info = make(camera.info, kCameraInfoType, kImagesDepth);
    if (!info) return tl::unexpected(info.error());
    auto image = make(camera.images, camera.is_compressed ? kCompressedType : kImageType, kImagesDepth);
    if (!image) return tl::unexpected(image.error());
    infos.push_back(std::move(*info));
    images.push_back(std::move(*image));
    names += (names.empty() ? "" : " and ") + camera.images;
  }
  if (!imu.empty()) {
    auto samples = make(imu, kImuType, kImuDepth);
    if (!samples) return tl::unexpected(samples.error());
    imu_ = std::move(*samples);
  }
  images_ = std::move(images);
  infos_ = std::move(infos);
  intake_.emplace(options_.config, cameras, imu, odometry_);
  options_.say(program::Level::info, fmt::format("takes images of {}, {}", names, imu.empty() ? "no IMU" : imu));
  return {};
}

void RosImages::take() {
  const double now_s = program::Clock::steady_s();
  if (!intake_) return look(now_s);
  const auto take = [&](Reader& reader, const auto& add) {
    reader.take([&](const Message& message) { complaints_.add(reader.topic(), add(message.cdr)); });
  };
  for (std::size_t i = 0; i < images_.size(); ++i) {
    if (infos_[i]) take(*infos_[i], [&](std::string_view cdr) { return intake_->add_info(i, cdr); });
    if (intake_->has_info(i)) infos_[i].reset();  // the first counts
    take(*images_[i], [&](std::string_view cdr) { return intake_->add_image(i, cdr); });
  }
  if (imu_) take(*imu_, [&](std::string_view cdr) { return intake_->add_imu(cdr); });
  if (now_s - looked_s_ < kLook_s || now_s - begin_s_ < options_.patience_s) return;
  looked_s_ = now_s;
  if (std::string missing = intake_->missing(); !missing.empty() && missing != said_)
    options_.say(program::Level::warning, said_ = std::move(missing));
}

void RosImages::describe(program::FeedSensors& sensors) const {
  if (intake_) intake_->describe(sensors);
}

bool RosImages::holds_odometry() const {
  const auto waiting = odometry_.waiting();
  if (!waiting || waiting->second - waiting->first > kLongest_s) return false;
  program::FeedSensors sensors;
  describe(sensors);
  return sensors.cameras.empty() || !intake_->reaches(waiting->first);
}

bool RosImages::feed(program::FeedClient& client, const program::FeedSensors& sensors, Timestamp stamp,
                     Unstored& unstored) {
  if (!intake_ || sensors.cameras.empty()) return true;
  const auto is_said = [&](const Status& status) {
    if (!status) complaints_.add(images_.front()->topic(), status);
    return status || status.error().code != ErrorCode::io;
  };
  while (sensors.imu) {
    const std::vector<ImuSample> samples = intake_->next_imu(stamp);
    if (samples.empty()) break;
    if (!is_said(client.say(samples))) return false;
  }
  while (true) {
    const auto images = intake_->next_images(stamp);
    if (!images) {
      complaints_.add(images_.front()->topic(), tl::unexpected(images.error()));
      continue;
    }
    if (!*images) return true;
    unstored.add((*images)->stamp, program::bytes_of(**images));
    if (!is_said(client.say(**images))) return false;
  }
}

}  // namespace tutti::ros
