// SPDX-License-Identifier: BSD-3-Clause
// Cameras and the IMU of a bag.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <mutex>
#include <utility>

#include "tutti/bags/camera.hpp"
#include "tutti/formats/image_file.hpp"
#include "tutti/mission/bag_recording.hpp"

namespace tutti::mission {
namespace {

const bags::RosCameraInfo* info_of(const BagIndex& index, const std::string& topic, bool is_compressed) {
  const auto at = index.cameras.find(bags::camera_info_topic(topic, is_compressed));
  return at == index.cameras.end() ? nullptr : &at->second;
}

Result<BagCamera> camera_of(const BagIndex& index, const std::string& topic, const ImageTrack& track,
                            const std::string& body) {
  if (track.images.empty()) return fail(ErrorCode::invalid, "{}: no images", topic);
  if (!track.is_compressed && !bags::is_picture(track.encoding))
    return fail(ErrorCode::unsupported, "{}: encoding '{:.40}' is no picture", topic, track.encoding);
  const bags::RosCameraInfo* const info = info_of(index, topic, track.is_compressed);
  if (info == nullptr) return fail(ErrorCode::invalid, "{}: no sensor_msgs/CameraInfo beside it", topic);
  const auto model = bags::to_camera(*info);
  if (!model) return in_context(topic, model.error());
  const auto T_body_camera = index.tree.find(body, track.frame);
  if (!T_body_camera) return fail(ErrorCode::invalid, "{}: no transform from '{}' to '{}'", topic, track.frame, body);
  return BagCamera{topic, {*model, *T_body_camera}, track.images, track.is_compressed};
}

bool is_wanted(const std::string& topic, const std::string& list) {
  return ("," + list + ",").find("," + topic + ",") != std::string::npos;
}

void take_imu(const BagIndex& index, const std::string& body, const RobotConfig& robot, BagRecording& out) {
  const auto said = [&](const std::string& why) { out.notes.push_back("no IMU is used: " + why); };
  const std::string& wanted = robot.topics.imu;
  if (index.imu.empty() && wanted.empty()) return;
  if (index.imu.size() > 1 && wanted.empty())
    return said(fmt::format("{} topics have one; say which: --topic {}.imu={}", index.imu.size(), robot.name,
                            index.imu.begin()->first));
  const auto at = wanted.empty() ? index.imu.begin() : index.imu.find(wanted);
  if (at == index.imu.end()) return said(fmt::format("'{}' is not in the bag", wanted));
  const auto& [topic, track] = *at;
  const auto T_body_imu = index.tree.find(body, track.frame);
  if (!T_body_imu) return said(fmt::format("{}: no transform from '{}' to '{}'", topic, track.frame, body));
  if (const Status ok = bags::check_imu_place(*T_body_imu); !ok)
    return said(fmt::format("{}: {}", topic, ok.error().message));
  out.imu = track.samples;
  for (ImuSample& sample : out.imu) sample = bags::in_body(sample, *T_body_imu);
  out.notes.push_back(fmt::format("IMU of {} ({} samples, {} refused)", topic, out.imu.size(), track.refused.count));
}

/// Reads and decodes; one chunk of the bag in memory.
class ImageReader {
 public:
  ImageReader(std::unique_ptr<bags::BagReader> reader, std::string file)
      : reader_(std::move(reader)), file_(std::move(file)) {}

  Result<Image> read(const BagCamera& camera, const ScanPlace& place) {
    const std::scoped_lock lock(mutex_);
    const std::string name = fmt::format("{}: {}: message {}", file_, camera.topic, place.message);
    if (auto ok = reader_->seek(place.position); !ok) return in_context(name, ok.error());
    const auto message = reader_->next();
    if (!message) return in_context(name, message.error());
    if (!*message || (*message)->channel->topic != camera.topic)
      return fail(ErrorCode::io, "{}: is not there any more: has the bag changed?", name);
    const auto encoding = bags::to_encoding((*message)->channel->message_encoding);
    if (!encoding) return in_context(name, encoding.error());
    if (camera.is_compressed) {
      const auto packed = bags::decode_compressed_image((*message)->data, *encoding);
      if (!packed) return in_context(name, packed.error());
      return formats::decode_image(packed->data, name);
    }
    const auto raw = bags::decode_image((*message)->data, *encoding);
    if (!raw) return in_context(name, raw.error());
    auto image = bags::to_image(*raw);
    if (!image) return in_context(name, image.error());
    return image;
  }

 private:
  std::mutex mutex_;
  std::unique_ptr<bags::BagReader> reader_;
  std::string file_;
};

}  // namespace

void take_cameras(const BagIndex& index, const std::string& body, const RobotConfig& robot, BagRecording& out) {
  const std::string& wanted = robot.topics.images;
  std::string why, found;
  for (const auto& [topic, track] : index.images) {
    if (!wanted.empty() && !is_wanted(topic, wanted)) continue;
    auto camera = camera_of(index, topic, track, body);
    if (!camera) {
      why += (why.empty() ? "" : "; ") + camera.error().message;
      continue;
    }
    found += (found.empty() ? "" : ",") + topic;
    out.cameras.push_back(std::move(*camera));
  }
  const auto most = static_cast<std::size_t>(robot.images.most_cameras);
  if (out.cameras.size() > 2) {
    why = fmt::format("{} cameras, expected one or two; say which: --topic {}.images={}", out.cameras.size(),
                      robot.name, found);
    out.cameras.clear();
  } else if (out.cameras.size() > most) {
    out.cameras.erase(out.cameras.begin() + static_cast<std::ptrdiff_t>(most), out.cameras.end());
  }
  if (out.cameras.empty())
    out.no_images = why.empty() ? "no sensor_msgs/Image or CompressedImage in the bag" : why;
  else
    out.notes.push_back("images of " + found);
  take_imu(index, body, robot, out);
}

Result<RobotImages> open_images(const BagRecording& bag, const Trajectory& odometry, const RobotConfig& robot,
                                const visual::TrackingConfig& tracking) {
  auto reader = bags::open_bag(bag.file);
  if (!reader) return tl::unexpected(reader.error());
  ImageStream stream;
  for (const BagCamera& camera : bag.cameras) stream.cameras.push_back(camera.camera);
  const double offset_s = robot.images.time_offset_s;
  for (const ScanPlace& place : bag.cameras.front().images) stream.stamps.push_back(place.stamp + offset_s);
  stream.load = [images = std::make_shared<ImageReader>(std::move(*reader), bag.file), cameras = bag.cameras,
                 most_s = tracking.max_stamp_difference_s](std::size_t moment, std::size_t camera) -> Result<Image> {
    const Timestamp stamp = cameras.front().images.at(moment).stamp;
    const std::vector<ScanPlace>& places = cameras.at(camera).images;
    const auto place = std::ranges::lower_bound(places, stamp - most_s, {}, &ScanPlace::stamp);
    if (place == places.end() || place->stamp - stamp > most_s) return Image();
    return images->read(cameras[camera], *place);
  };
  return serve_images(std::move(stream), bag.imu, ImuNoise{}, robot.images, odometry, tracking);
}

}  // namespace tutti::mission
