// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/ros/images_intake.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <utility>

#include "tutti/bags/camera.hpp"
#include "tutti/bags/transform_tree.hpp"
#include "tutti/program/feed/feed_frames.hpp"

namespace tutti::ros {

Status resolve(ImagesConfig& config, const std::string& name_space) {
  const auto any = resolve("any", name_space);
  if (!any) return tl::unexpected(any.error());
  config.within = any->substr(0, any->rfind('/') + 1);
  std::vector<std::string*> names;
  for (std::string& topic : config.images) names.push_back(&topic);
  if (!config.imu.empty()) names.push_back(&config.imu);
  for (std::string* name : names) {
    auto whole = resolve(*name, name_space);
    if (!whole) return tl::unexpected(whole.error());
    *name = std::move(*whole);
  }
  return {};
}

Result<std::vector<CameraTopics>> choose_cameras(std::span<const Publication> published, const ImagesConfig& config) {
  std::set<std::string> infos, raw;  // raw: CameraInfo topics of cameras whose images are there uncompressed
  std::map<std::string, CameraTopics> found;
  for (const Publication& topic : published) {
    if (topic.type == kCameraInfoType) infos.insert(topic.topic);
    const bool is_compressed = topic.type == kCompressedType;
    if (!is_compressed && topic.type != kImageType) continue;
    const bool is_named = std::ranges::find(config.images, topic.topic) != config.images.end();
    if (config.images.empty() ? !topic.topic.starts_with(config.within) : !is_named) continue;
    const std::string info = bags::camera_info_topic(topic.topic, is_compressed);
    if (!is_compressed) raw.insert(info);
    found[topic.topic] = {topic.topic, info, is_compressed};
  }
  if (config.images.empty())
    std::erase_if(found, [&](const auto& entry) {
      const CameraTopics& camera = entry.second;
      return !infos.contains(camera.info) || (camera.is_compressed && raw.contains(camera.info));
    });
  if (found.size() < config.images.size()) return std::vector<CameraTopics>();
  std::vector<CameraTopics> out;
  std::vector<std::string> names;
  std::set<std::string> used;
  for (const auto& [name, camera] : found) {
    out.push_back(camera);
    names.push_back(name);
    used.insert(camera.info);
  }
  if (out.size() > 2 || used.size() < out.size())
    return fail(ErrorCode::invalid, "{} cameras with {} CameraInfo, expected one or two; say which: --images {}",
                out.size(), used.size(), fmt::join(names, ","));
  out.resize(std::min(out.size(), static_cast<std::size_t>(config.most_cameras)));
  return out;
}

Result<std::string> choose_imu(std::span<const Publication> published, const ImagesConfig& config) {
  std::set<std::string> found;
  for (const Publication& topic : published)
    if (topic.type == kImuType &&
        (config.imu.empty() ? topic.topic.starts_with(config.within) : topic.topic == config.imu))
      found.insert(topic.topic);
  if (found.size() > 1)
    return fail(ErrorCode::invalid, "{} topics have one; say which: --imu {} (here are: {})", found.size(),
                *found.begin(), fmt::join(found, ", "));
  return found.empty() ? std::string() : *found.begin();
}

ImagesIntake::ImagesIntake(ImagesConfig config, std::vector<CameraTopics> cameras, std::string imu,
                           const RosIntake& odometry)
    : config_(std::move(config)), imu_(std::move(imu)), odometry_(odometry) {
  for (CameraTopics& topics : cameras) cameras_.push_back({.topics = std::move(topics)});
}

ImagesIntake::Waiting ImagesIntake::OneCamera::pop() {
  Waiting out = std::move(waiting.front());
  waiting.pop_front();
  bytes -= out.image.bytes.size();
  return out;
}

Status ImagesIntake::check_size(const OneCamera& camera, const Waiting& waiting) {
  if (!camera.model || waiting.width == 0) return {};
  const auto width = static_cast<std::uint32_t>(camera.model->width_px),
             height = static_cast<std::uint32_t>(camera.model->height_px);
  if (waiting.width == width && waiting.height == height) return {};
  return fail(ErrorCode::invalid, "an image of {} x {} pixels, expected {} x {} as {} says", waiting.width,
              waiting.height, width, height, camera.topics.info);
}

Status ImagesIntake::add_info(std::size_t camera, std::string_view cdr) {
  OneCamera& of = cameras_[camera];
  const auto message = bags::decode_camera_info(cdr);
  if (!message) return tl::unexpected(message.error());
  const auto model = bags::to_camera(*message);
  if (!model) return tl::unexpected(model.error());
  if (of.model) return {};
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

Status ImagesIntake::add_image(std::size_t camera, std::string_view cdr) {
  OneCamera& of = cameras_[camera];
  if (of.topics.is_compressed) {
    const auto message = bags::decode_compressed_image(cdr);
    if (!message) return tl::unexpected(message.error());
    if (message->data.empty()) return fail(ErrorCode::invalid, "an image of no bytes, expected a PNG or JPEG file");
    return push(of, message->header, {{}, {0, false, std::string(message->data)}});
  }
  const auto message = bags::decode_image(cdr);
  if (!message) return tl::unexpected(message.error());
  const auto image = bags::to_image(*message);
  if (!image) return tl::unexpected(image.error());
  return push(of, message->header,
              {{}, {0, true, std::string(image->grey.begin(), image->grey.end())}, message->width, message->height});
}

Status ImagesIntake::push(OneCamera& camera, const bags::RosHeader& header, Waiting waiting) {
  waiting.stamp = header.stamp + config_.time_offset_s;
  if (Status ok = check_size(camera, waiting); !ok) return ok;
  if (Status ok = odometry_.check_stamp(waiting.stamp, camera.newest); !ok) return ok;
  if (!camera.frame) camera.frame = bags::frame_name(header.frame_id);
  camera.newest = waiting.stamp;
  camera.bytes += waiting.image.bytes.size();
  camera.waiting.push_back(std::move(waiting));
  while (camera.bytes > kMostBytes / cameras_.size()) camera.pop();
  return {};
}

Status ImagesIntake::add_imu(std::string_view cdr) {
  const auto message = bags::decode_imu(cdr);
  if (!message) return tl::unexpected(message.error());
  const auto sample = bags::to_imu_sample(*message);
  if (!sample) return tl::unexpected(sample.error());
  if (Status ok = odometry_.check_stamp(sample->stamp, newest_imu_); !ok) return ok;
  if (!imu_frame_) imu_frame_ = bags::frame_name(message->header.frame_id);
  newest_imu_ = sample->stamp;
  samples_.push_back(*sample);
  if (samples_.size() > kMostSamples) samples_.pop_front();
  return {};
}

Result<Camera> ImagesIntake::place(const OneCamera& camera) const {
  if (!camera.model) return fail(ErrorCode::invalid, "{}: no sensor_msgs/CameraInfo", camera.topics.info);
  if (!camera.frame) return fail(ErrorCode::invalid, "{}: no image", camera.topics.images);
  const auto T_body_camera = odometry_.pose_on_body(*camera.frame);
  if (!T_body_camera) return in_context(camera.topics.images, T_body_camera.error());
  return Camera{*camera.model, *T_body_camera};
}

Result<Pose3> ImagesIntake::imu_place() const {
  if (!imu_frame_) return fail(ErrorCode::invalid, "{}: no sample", imu_);
  auto T_body_imu = odometry_.pose_on_body(*imu_frame_);
  if (!T_body_imu) return in_context(imu_, T_body_imu.error());
  if (const Status ok = bags::check_imu_place(*T_body_imu); !ok) return in_context(imu_, ok.error());
  return T_body_imu;
}

void ImagesIntake::describe(program::FeedSensors& sensors) const {
  std::vector<Camera> cameras;
  for (const OneCamera& camera : cameras_) {
    auto placed = place(camera);
    if (!placed) return;
    cameras.push_back(std::move(*placed));
  }
  sensors.cameras = std::move(cameras);
  if (!imu_.empty() && imu_place()) sensors.imu = ImuNoise{};  // as of a bag
}

std::string ImagesIntake::missing() const {
  std::string out;
  const auto add = [&](const std::string& what) { out += (out.empty() ? "" : "; ") + what; };
  for (const OneCamera& camera : cameras_)
    if (const auto placed = place(camera); !placed) add("no images are used: " + placed.error().message);
  if (imu_.empty()) return out;
  if (const auto placed = imu_place(); !placed) add("no IMU is used: " + placed.error().message);
  return out;
}

bool ImagesIntake::reaches(Timestamp stamp) const {
  return std::ranges::all_of(cameras_,
                             [&](const OneCamera& camera) { return camera.newest && *camera.newest >= stamp; }) &&
         (imu_.empty() || (newest_imu_ && *newest_imu_ >= stamp));
}

Result<std::optional<program::FedImages>> ImagesIntake::next_images(Timestamp stamp) {
  std::deque<Waiting>& first = cameras_.front().waiting;
  while (!first.empty() && odometry_.is_before_all(first.front().stamp)) cameras_.front().pop();
  if (first.empty() || first.front().stamp > stamp) return std::optional<program::FedImages>();
  const Timestamp moment = first.front().stamp;
  if (stamp - moment > kLatest_s) {
    cameras_.front().pop();
    return fail(ErrorCode::invalid, "image at {} ns comes {:.1f} s after odometry of its time, expected at most {} s",
                moment.ns, stamp - moment, kLatest_s);
  }
  std::optional<program::EncodedImage> other;
  if (cameras_.size() > 1) {
    OneCamera& second = cameras_.back();
    while (!second.waiting.empty() && second.waiting.front().stamp < moment - config_.most_difference_s) second.pop();
    if (second.waiting.empty() && stamp - moment < kPatience_s) return std::optional<program::FedImages>();
    if (!second.waiting.empty() && second.waiting.front().stamp - moment <= config_.most_difference_s)
      other = second.pop().image;
  }
  program::FedImages out{.stamp = moment, .images = {}, .depth = {}};
  out.images.push_back(cameras_.front().pop().image);
  if (!other) return std::optional(std::move(out));
  other->camera = 1;
  out.images.push_back(std::move(*other));
  return std::optional(std::move(out));
}

std::vector<ImuSample> ImagesIntake::next_imu(Timestamp stamp) {
  std::vector<ImuSample> out;
  const auto T_body_imu = imu_place();
  if (!T_body_imu) return out;
  while (!samples_.empty() && samples_.front().stamp - stamp <= kAhead_s && out.size() < program::kMaxImuSamples) {
    out.push_back(bags::in_body(samples_.front(), *T_body_imu));
    samples_.pop_front();
  }
  return out;
}

}  // namespace tutti::ros
