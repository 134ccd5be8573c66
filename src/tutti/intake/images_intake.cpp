// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/intake/images_intake.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "tutti/bags/camera.hpp"
#include "tutti/bags/rgbd.hpp"
#include "tutti/bags/transform_tree.hpp"
#include "tutti/model/nearest_stamp.hpp"

namespace tutti::intake {
namespace {

/// As the feed has raw depth: two bytes a pixel, little endian.
std::string to_bytes(const DepthImage& depth) {
  std::string out;
  out.reserve(2 * depth.value.size());
  for (const std::uint16_t value : depth.value) {
    out.push_back(static_cast<char>(value & 0xFFU));
    out.push_back(static_cast<char>(value >> 8U));
  }
  return out;
}

/// As the feed has them: raw images are grey, raw depth has millimetres; files stay as they are.
Result<EncodedImage> encoded(const bags::ImageMessage& message, bool of_depth) {
  if (const auto* const file = std::get_if<bags::RosCompressedImage>(&message))
    return EncodedImage{0, false, std::string(file->data)};
  if (of_depth)
    return bags::to_depth(message, {}).map([](const DepthImage& depth) {
      return EncodedImage{0, true, to_bytes(depth)};
    });
  return bags::to_image(message).map([](const Image& image) {
    return EncodedImage{0, true, std::string(image.grey.begin(), image.grey.end())};
  });
}

}  // namespace

ImagesIntake::ImagesIntake(ImagesConfig config, std::vector<CameraTopics> topics, std::string imu,
                           const RosIntake& odometry)
    : config_(std::move(config)), imu_(std::move(imu)), odometry_(odometry) {
  for (CameraTopics& one : topics)
    topics_.push_back({.topics = one, .seen = {.topic = one.images, .is_compressed = one.is_compressed}});
}

ImagesIntake::Waiting ImagesIntake::OneTopic::pop() {
  Waiting out = std::move(waiting.front());
  waiting.pop_front();
  bytes -= out.image.bytes.size();
  return out;
}

void ImagesIntake::OneTopic::drop_before(Timestamp stamp) {
  while (!waiting.empty() && waiting.front().stamp < stamp) pop();
}

Status ImagesIntake::check_size(const OneTopic& topic, const Waiting& waiting) {
  if (!topic.model || waiting.width == 0 || topic.seen.shows_depth()) return {};
  const auto width = static_cast<std::uint32_t>(topic.model->width_px),
             height = static_cast<std::uint32_t>(topic.model->height_px);
  if (waiting.width == width && waiting.height == height) return {};
  return fail(ErrorCode::invalid, "an image of {} x {} pixels, expected {} x {} as {} says", waiting.width,
              waiting.height, width, height, topic.topics.info);
}

Status ImagesIntake::add_info(std::size_t topic, std::string_view bytes, Encoding encoding) {
  OneTopic& of = topics_[topic];
  auto message = bags::decode_camera_info(bytes, encoding);
  if (!message) return tl::unexpected(message.error());
  if (of.model) return {};
  const auto model = bags::to_camera(*message);
  of.seen.info = std::move(*message);
  if (!model) return tl::unexpected(model.error());
  of.model = *model;
  Status first;
  std::erase_if(of.waiting, [&](const Waiting& waiting) {
    Status ok = check_size(of, waiting);
    if (ok) return false;
    of.bytes -= waiting.image.bytes.size();
    if (first) first = std::move(ok);
    return true;
  });
  return first;
}

Status ImagesIntake::add_image(std::size_t topic, std::string_view bytes, Encoding encoding) {
  OneTopic& of = topics_[topic];
  const auto message = bags::decode_image_message(of.topics.is_compressed, bytes, encoding);
  if (!message) return tl::unexpected(message.error());
  if (Status ok = of.seen.add(*message); !ok)
    return of.seen.shows_depth()
               ? in_context(fmt::format("depth at {} ns", bags::header_of(*message).stamp.ns), ok.error())
               : ok;
  auto image = encoded(*message, of.seen.shows_depth());
  if (!image) return tl::unexpected(image.error());
  Waiting waiting{bags::header_of(*message).stamp + config_.time_offset_s, std::move(*image)};
  if (const auto* const raw = std::get_if<bags::RosImage>(&*message)) {
    waiting.width = raw->width;
    waiting.height = raw->height;
  }
  if (Status ok = check_size(of, waiting); !ok) return ok;
  if (Status ok = odometry_.check_stamp(waiting.stamp, of.newest); !ok) return ok;
  while (!of.waiting.empty() && of.waiting.back().stamp >= waiting.stamp) {
    of.bytes -= of.waiting.back().image.bytes.size();
    of.waiting.pop_back();
  }
  of.newest = waiting.stamp;
  of.bytes += waiting.image.bytes.size();
  of.waiting.push_back(std::move(waiting));
  while (of.bytes > most_bytes()) of.pop();
  return {};
}

std::size_t ImagesIntake::most_bytes() const {
  return kMostBytes / (is_chosen() ? cameras_.size() + (depth_ ? 1 : 0) : topics_.size());
}

bool ImagesIntake::is_filling() const {
  return samples_.size() > kMostSamples / 2 ||
         std::ranges::any_of(topics_, [this](const OneTopic& topic) { return topic.bytes > most_bytes() / 2; });
}

Status ImagesIntake::add_imu(std::string_view bytes, Encoding encoding) {
  const auto message = bags::decode_imu(bytes, encoding);
  if (!message) return tl::unexpected(message.error());
  const auto sample = bags::to_imu_sample(*message);
  if (!sample) return tl::unexpected(sample.error());
  if (Status ok = odometry_.check_stamp(sample->stamp, newest_imu_); !ok) return ok;
  if (!imu_frame_) imu_frame_ = bags::frame_name(message->header.frame_id);
  drop_from(sample->stamp, samples_, [](const ImuSample& waiting) { return waiting.stamp; });
  newest_imu_ = sample->stamp;
  samples_.push_back(*sample);
  if (samples_.size() > kMostSamples) samples_.pop_front();
  return {};
}

Result<Camera> ImagesIntake::place(const OneTopic& camera) const {
  if (!camera.model) return fail(ErrorCode::invalid, "{}: no sensor_msgs/CameraInfo", camera.topics.info);
  if (!camera.seen.first) return fail(ErrorCode::invalid, "{}: no image", camera.topics.images);
  const auto T_body_camera = odometry_.pose_on_body(camera.seen.first->frame);
  if (!T_body_camera) return in_context(camera.topics.images, T_body_camera.error());
  return Camera{*camera.model, *T_body_camera};
}

Result<Pose3> ImagesIntake::imu_place() const {
  if (!imu_frame_) return fail(ErrorCode::invalid, "{}: no sample", imu_);
  const auto T_body_imu = odometry_.pose_on_body(*imu_frame_).and_then(&bags::check_imu_place);
  return T_body_imu ? T_body_imu : in_context(imu_, T_body_imu.error());
}

bool ImagesIntake::has_any_image() const {
  return std::ranges::any_of(topics_, [](const OneTopic& topic) { return topic.seen.first.has_value(); });
}

bool ImagesIntake::uses(std::size_t topic) const {
  return !is_chosen() || depth_ == topic || std::ranges::find(cameras_, topic) != cameras_.end();
}

std::string ImagesIntake::in_words() const {
  std::string out;
  for (const std::size_t i : cameras_) out += (out.empty() ? "" : " and ") + topics_[i].topics.images;
  return depth_ ? fmt::format("{} with depth of {}", out, topics_[*depth_].topics.images) : out;
}

Result<std::optional<std::pair<ImagesIntake::Numbers, ImagesIntake::Numbers>>> ImagesIntake::cameras_and_depths(
    bool is_late) const {
  constexpr std::nullopt_t kWait = std::nullopt;
  Numbers cameras, depths;
  for (std::size_t i = 0; i < topics_.size(); ++i) {
    const OneTopic& topic = topics_[i];
    const Wish wish = topic.topics.wish;
    if (!topic.seen.first) {
      if (!is_late || wish == Wish::camera) return kWait;
      continue;
    }
    if (const Status ok = topic.seen.check_picture(); wish == Wish::camera && !ok)
      return fail(ErrorCode::invalid, "{}{}", ok.error().message, topic.seen.shows_depth() ? ": --depth" : "");
    if (topic.seen.shows_depth()) {
      if (!config_.with_depth || (wish != Wish::depth && !config_.depth.empty())) continue;
      const bool is_known =
          (topic.seen.info || !topic.topics.has_info) && odometry_.pose_on_body(topic.seen.first->frame);
      if (!is_known && !is_late) return kWait;
      depths.push_back(i);
    } else if (topic.seen.shows_picture() && (wish == Wish::camera || config_.images.empty())) {
      if (!place(topic)) return kWait;
      cameras.push_back(i);
    }
  }
  if (cameras.empty()) return kWait;
  return std::optional(std::pair(std::move(cameras), std::move(depths)));
}

Result<bool> ImagesIntake::choose(bool is_late) {
  if (is_chosen()) return true;
  const auto found = cameras_and_depths(is_late);
  if (!found) return tl::unexpected(found.error());
  if (!*found) return false;
  const auto& [cameras, depths] = **found;
  std::vector<bags::ImageTopic> of_cameras, of_depths;
  for (const std::size_t i : cameras) of_cameras.push_back(topics_[i].seen);
  for (const std::size_t i : depths) of_depths.push_back(topics_[i].seen);
  const bags::CameraWishes wishes{.are_named = !config_.images.empty(),
                                  .most_cameras = config_.most_cameras,
                                  .images_flag = "--images ",
                                  .depth_flag = "--depth "};
  const auto choice = bags::choose_cameras(
      of_cameras, of_depths, wishes, [this](const std::string& a, const std::string& b) -> std::optional<Pose3> {
        const auto T_body_a = odometry_.pose_on_body(a), T_body_b = odometry_.pose_on_body(b);
        if (!T_body_a || !T_body_b) return std::nullopt;
        return T_body_a->inverse() * *T_body_b;
      });
  if (!choice) return tl::unexpected(choice.error());
  for (const std::size_t i : choice->cameras) cameras_.push_back(cameras[i]);
  if (choice->depth) depth_ = depths[*choice->depth];
  note_ = choice->note;
  if (!config_.depth.empty() && depths.empty())
    note_ = fmt::format("no depth is used: {} shows none, expected an encoding of 16UC1 or 32FC1", config_.depth);
  for (std::size_t i = 0; i < topics_.size(); ++i)
    if (!uses(i)) topics_[i].drop_before(kLastTimestamp);
  return true;
}

void ImagesIntake::describe(Sensors& sensors) const {
  std::vector<Camera> cameras;
  for (const std::size_t i : cameras_) {
    auto placed = place(topics_[i]);
    if (!placed) return;
    cameras.push_back(std::move(*placed));
  }
  sensors.cameras = std::move(cameras);
  if (depth_) {
    sensors.depth = config_.depth_sensor;
    sensors.depth->unit_m = bags::kDepthUnit_m;
  }
  if (!imu_.empty() && imu_place()) sensors.imu = ImuNoise{};  // as of a bag
}

std::string ImagesIntake::missing() const {
  std::string out;
  const auto add = [&](const std::string& what) { out += (out.empty() ? "" : "; ") + what; };
  std::vector<std::string> names;
  for (const OneTopic& topic : topics_) {
    names.push_back(topic.topics.images);
    if (is_chosen() || topic.seen.shows_depth()) continue;
    if (const auto placed = place(topic); !placed) add("no images are used: " + placed.error().message);
  }
  if (!is_chosen() && out.empty() &&
      std::ranges::none_of(topics_, [](const OneTopic& topic) { return topic.seen.shows_picture(); }))
    add(fmt::format("no images are used: none of the topics with a CameraInfo shows pictures: {}",
                    fmt::join(names, ", ")));
  if (depth_)
    if (const auto& images = topics_[cameras_.front()].newest, &depth = topics_[*depth_].newest;
        images && depth && *images - *depth > waiting::kUnknown_s)
      add(fmt::format("{} has ended, or is by another clock: its newest is of {} ns", topics_[*depth_].topics.images,
                      depth->ns));
  if (imu_.empty()) return out;
  if (const auto placed = imu_place(); !placed) add("no IMU is used: " + placed.error().message);
  return out;
}

void ImagesIntake::drop_late(Timestamp stamp) {
  for (OneTopic& topic : topics_) topic.drop_before(stamp - waiting::kLate_s);
}

bool ImagesIntake::reaches(Timestamp stamp) const {
  const auto has = [&](std::size_t i) { return topics_[i].newest && *topics_[i].newest >= stamp; };
  return std::ranges::all_of(cameras_, has) && (!depth_ || has(*depth_)) &&
         (imu_.empty() || (newest_imu_ && *newest_imu_ >= stamp));
}

/// The nearest of the second camera's images that have arrived.
std::optional<EncodedImage> ImagesIntake::second_of(Timestamp instant) {
  if (cameras_.size() < 2) return std::nullopt;
  OneTopic& of = topics_[cameras_.back()];
  of.drop_before(instant - config_.most_difference_s);
  const auto at = nearest_in_time(of.waiting, instant, config_.most_difference_s, &Waiting::stamp);
  if (at == of.waiting.end()) return std::nullopt;
  of.drop_before(at->stamp);
  return of.pop().image;
}

/// The nearest of the depth images that have arrived; it may be the next image's, too.
Result<std::optional<EncodedImage>> ImagesIntake::depth_of(Timestamp instant) {
  std::optional<EncodedImage> none;
  if (!depth_) return none;
  OneTopic& of = topics_[*depth_];
  of.drop_before(instant - config_.most_depth_difference_s);
  const auto at = nearest_in_time(of.waiting, instant, config_.most_depth_difference_s, &Waiting::stamp);
  if (at == of.waiting.end()) return none;
  if (at->image.is_raw) return std::optional(at->image);
  if (of.seen.first->encoding != "32FC1")
    return std::optional(EncodedImage{0, false, std::string(bags::png_of(at->image.bytes))});
  const CameraModel& camera = *topics_[cameras_.front()].model;
  bags::RosCompressedImage image;  // a temporary is uninitialised for GCC 12
  image.format = of.seen.first->encoding + ";";
  image.data = at->image.bytes;
  const auto depth = bags::to_depth(image, {camera.width_px, camera.height_px});
  if (depth) return std::optional(EncodedImage{0, true, to_bytes(*depth)});
  const Timestamp wrong = at->stamp;
  of.bytes -= at->image.bytes.size();
  of.waiting.erase(at);
  return in_context(fmt::format("{}: depth at {} ns", of.topics.images, wrong.ns), depth.error());
}

Result<std::optional<EncodedImages>> ImagesIntake::next_images(Timestamp stamp, bool is_last) {
  const std::optional<EncodedImages> none;
  if (!is_chosen()) return none;
  OneTopic& camera = topics_[cameras_.front()];
  while (!camera.waiting.empty() && odometry_.is_before_all(camera.waiting.front().stamp)) camera.pop();
  if (camera.waiting.empty() || camera.waiting.front().stamp > stamp) return none;
  const Timestamp instant = camera.waiting.front().stamp;
  const bool is_patient = !is_last && stamp - instant < waiting::kPartner_s;
  const auto may_come = [&](const OneTopic& topic) {
    return is_patient && !(topic.newest && *topic.newest >= instant);
  };
  if ((cameras_.size() > 1 && may_come(topics_[cameras_.back()])) || (depth_ && may_come(topics_[*depth_])))
    return none;
  std::optional<EncodedImage> other = second_of(instant);
  auto depth = depth_of(instant);
  if (!depth) return tl::unexpected(depth.error());
  EncodedImages out{.stamp = instant, .images = {}, .depth = std::move(*depth)};
  out.images.push_back(camera.pop().image);
  if (!other) return std::optional(std::move(out));
  other->camera = 1;
  out.images.push_back(std::move(*other));
  return std::optional(std::move(out));
}

std::vector<ImuSample> ImagesIntake::next_imu(Timestamp stamp) {
  std::vector<ImuSample> out;
  const auto T_body_imu = imu_place();
  if (!T_body_imu) return out;
  while (!samples_.empty() && samples_.front().stamp - stamp <= waiting::kLate_s && out.size() < kMaxImuSamples) {
    out.push_back(bags::in_body(samples_.front(), *T_body_imu));
    samples_.pop_front();
  }
  return out;
}

}  // namespace tutti::intake
