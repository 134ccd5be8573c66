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
    if (topic.type == intake::kImageType || topic.type == intake::kCompressedType) names.push_back(topic.topic);
  return fmt::format("topics of sensor_msgs/Image and CompressedImage here are: {}",
                     names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", ")));
}

}  // namespace

RosImages::RosImages(Options options, std::shared_ptr<Participant> participant, const intake::RosIntake& odometry,
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
  const auto topics = find_images(published, options_.config);
  if (!topics) return complaints_.add("no images are used", tl::unexpected(topics.error()));
  const auto imu = choose_imu(published, options_.config);
  if (!imu) complaints_.add("no IMU is used", tl::unexpected(imu.error()));
  const bool is_same = seen_ == *topics && seen_imu_ == imu.value_or("");
  seen_ = *topics;
  seen_imu_ = imu.value_or("");
  if (!topics->empty() && *topics == refused_) return complaints_.add("no images are used", why_refused_);
  if (!topics->empty() && is_same) {
    if (const Status ok = subscribe(*topics, seen_imu_); !ok) complaints_.add("no images are used", ok);
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
  const auto make = [&](const std::string& topic, const char* type, int depth) {
    const Qos qos{.reliable = options_.lossless, .latched = false, .depth = options_.lossless ? 0 : depth};
    return participant_->reader(topic, type, qos, bags::ros_type_hash(type));
  };
  constexpr int kImagesDepth = 10, kImuDepth = 2000;  // how long this thread may be held up
  std::vector<std::unique_ptr<Reader>> images, infos;
  for (const intake::CameraTopics& topic : topics) {
    auto info = make(topic.info, intake::kCameraInfoType, kImagesDepth);
    if (!info) return tl::unexpected(info.error());
    auto image = make(topic.images, topic.is_compressed ? intake::kCompressedType : intake::kImageType, kImagesDepth);
    if (!image) return tl::unexpected(image.error());
    infos.push_back(std::move(*info));
    images.push_back(std::move(*image));
  }
  if (!imu.empty()) {
    auto samples = make(imu, intake::kImuType, kImuDepth);
    if (!samples) return tl::unexpected(samples.error());
    imu_ = std::move(*samples);
  }
  images_ = std::move(images);
  infos_ = std::move(infos);
  intake_.emplace(options_.config, topics, imu, odometry_);
  first_image_s_ = 0.0;
  return {};
}

/// Keeps the readers of what is used; where nothing can be chosen, none.
void RosImages::choose(double now_s) {
  if (first_image_s_ == 0.0 && intake_->has_any_image()) first_image_s_ = now_s;
  const bool is_late = first_image_s_ > 0.0 && now_s - first_image_s_ > options_.patience_s;
  const auto chosen = intake_->choose(is_late);
  if (!chosen) {
    refused_ = seen_;
    why_refused_ = tl::unexpected(chosen.error());
    complaints_.add("no images are used", why_refused_);
    images_.clear(), infos_.clear(), imu_.reset(), intake_.reset();
    return;
  }
  if (!*chosen) return;
  for (std::size_t i = 0; i < images_.size(); ++i)
    if (!intake_->uses(i)) images_[i].reset(), infos_[i].reset();
  options_.say(program::Level::info,
               fmt::format("takes images of {}, {}", intake_->in_words(), seen_imu_.empty() ? "no IMU" : seen_imu_));
  if (!intake_->note().empty()) options_.say(program::Level::warning, intake_->note());
}

void RosImages::take() {
  const double now_s = program::Clock::steady_s();
  if (!intake_) return look(now_s);
  const auto take = [&](Reader& reader, const auto& add) {
    reader.take([&](const Message& message) { complaints_.add(reader.topic(), add(message.cdr)); });
  };
  for (std::size_t i = 0; i < images_.size(); ++i) {
    if (!images_[i]) continue;
    if (infos_[i]) take(*infos_[i], [&](std::string_view cdr) { return intake_->add_info(i, cdr); });
    if (intake_->has_info(i)) infos_[i].reset();  // the first counts
    take(*images_[i], [&](std::string_view cdr) { return intake_->add_image(i, cdr); });
  }
  if (imu_) take(*imu_, [&](std::string_view cdr) { return intake_->add_imu(cdr); });
  if (!intake_->is_chosen()) choose(now_s);
  if (!intake_) return;
  if (now_s - looked_s_ < kLook_s || now_s - begin_s_ < options_.patience_s) return;
  looked_s_ = now_s;
  if (std::string missing = intake_->missing(); !missing.empty() && missing != said_)
    options_.say(program::Level::warning, said_ = std::move(missing));
}

void RosImages::describe(intake::FeedSensors& sensors) const {
  if (intake_) intake_->describe(sensors);
}

bool RosImages::holds_odometry() const {
  const auto waiting = odometry_.waiting();
  if (!waiting || waiting->second - waiting->first > kLongest_s) return false;
  intake::FeedSensors sensors;
  describe(sensors);
  return sensors.cameras.empty() || !intake_->reaches(waiting->first);
}

bool RosImages::feed(program::FeedClient& client, const intake::FeedSensors& sensors, Timestamp stamp,
                     Unstored& unstored) {
  if (!intake_ || sensors.cameras.empty()) return true;
  const auto is_said = [&](const Status& status) {
    if (!status) complaints_.add(intake_->in_words(), status);
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
      complaints_.add(intake_->in_words(), tl::unexpected(images.error()));
      continue;
    }
    if (!*images) return true;
    unstored.add((*images)->stamp, intake::bytes_of(**images));
    if (!is_said(client.say(**images))) return false;
  }
}

}  // namespace tutti::ros
