// SPDX-License-Identifier: BSD-3-Clause
// Cameras and the IMU of a bag.
#include <fmt/format.h>

#include <memory>
#include <utility>

#include "tutti/bags/camera.hpp"
#include "tutti/bags/rgbd.hpp"
#include "tutti/mission/bag_messages.hpp"
#include "tutti/mission/bag_recording.hpp"
#include "tutti/model/nearest_stamp.hpp"

namespace tutti::mission {
namespace {

constexpr const char* kNoDepth = "none";

Result<BagCamera> camera_of(const BagIndex& index, const ImageTrack& track, const std::string& body) {
  const bags::ImageTopic& seen = track.seen;
  const auto model = seen.camera();
  if (!model) return tl::unexpected(model.error());
  const auto T_body_camera = index.tree.pose(body, seen.first->frame);
  if (!T_body_camera) return in_context(seen.topic, T_body_camera.error());
  return BagCamera{{seen.topic, track.items, seen.is_compressed}, {*model, *T_body_camera}};
}

bool is_wanted(const std::string& topic, const std::string& list) {
  return ("," + list + ",").find("," + topic + ",") != std::string::npos;
}

void take_imu(const BagIndex& index, const std::string& body, const RobotConfig& robot, BagRecording& out) {
  const auto without_imu = [&](const std::string& why) { out.notes.push_back("no IMU is used: " + why); };
  const std::string& wanted = robot.topics.imu;
  if (index.imu.empty() && wanted.empty()) return;
  if (index.imu.size() > 1 && wanted.empty())
    return without_imu(fmt::format("{} topics have one; say which: --topic {}.imu={}", index.imu.size(), robot.name,
                                   index.imu.begin()->first));
  const auto at = wanted.empty() ? index.imu.begin() : index.imu.find(wanted);
  if (at == index.imu.end()) return without_imu(fmt::format("'{}' is not in the bag", wanted));
  const auto& [topic, track] = *at;
  const auto T_body_imu = index.tree.pose(body, track.frame).and_then(&bags::check_imu_place);
  if (!T_body_imu) return without_imu(fmt::format("{}: {}", topic, T_body_imu.error().message));
  out.imu = track.items;
  for (ImuSample& sample : out.imu) sample = bags::in_body(sample, *T_body_imu);
  out.notes.push_back(fmt::format("IMU of {} ({} samples, {} refused)", topic, out.imu.size(), track.refused.count));
}

std::string flag_of(const RobotConfig& robot, const char* kind) {
  return fmt::format("--topic {}.{}=", robot.name, kind);
}

/// The topics of depth to choose from; `why_not` is why there are none although there are some.
std::vector<bags::ImageTopic> depths_of(const BagIndex& index, const RobotConfig& robot, std::string& why_not) {
  const std::string& wanted = robot.topics.depth;
  std::vector<bags::ImageTopic> out;
  std::string names;
  if (wanted == kNoDepth) return out;
  const auto because = [&](const std::string& why) { why_not = "no depth is used: " + why; };
  for (const auto& [topic, track] : index.images) {
    if (!track.seen.shows_depth()) continue;
    names += (names.empty() ? "" : ", ") + topic;
    if (!wanted.empty() && topic != wanted) continue;
    if (track.items.empty())
      because(note_of(topic, track.refused, track.messages));
    else if (!track.seen.info && wanted.empty())
      because(fmt::format("{}: no sensor_msgs/CameraInfo beside it; if its frame and size are the camera's: {}{}",
                          topic, flag_of(robot, "depth"), topic));
    else
      out.push_back(track.seen);
  }
  if (out.empty() && why_not.empty() && !wanted.empty())
    because(fmt::format("'{}' is no topic of 16UC1 or 32FC1 in the bag, expected one of: {}", wanted,
                        names.empty() ? "none" : names));
  return out;
}

void take_choice(const BagIndex& index, const bags::CameraChoice& choice, std::vector<BagCamera> cameras,
                 const std::vector<bags::ImageTopic>& depths, BagRecording& out) {
  std::string used;
  std::vector<std::string> refused;
  const auto take = [&](const std::string& topic) -> const ImageTrack& {
    const ImageTrack& track = index.images.at(topic);
    if (track.refused.count > 0) refused.push_back(note_of(topic, track.refused, track.messages));
    return track;
  };
  for (const std::size_t i : choice.cameras) {
    take(cameras[i].topic);
    used += (used.empty() ? "" : ",") + cameras[i].topic;
    if (const std::string doubt = bags::doubt_of_place(cameras[i].camera.T_body_camera); !doubt.empty())
      refused.push_back(fmt::format("{}: the sensor is {}", cameras[i].topic, doubt));
    out.cameras.push_back(std::move(cameras[i]));
  }
  if (choice.depth) {
    const std::string& topic = depths[*choice.depth].topic;
    const ImageTrack& track = take(topic);
    used += fmt::format(", depth of {} ({})", topic, track.seen.first->encoding);
    out.depth = BagImages{topic, track.items, track.seen.is_compressed};
  }
  out.notes.push_back("images of " + used);
  out.notes.insert(out.notes.end(), refused.begin(), refused.end());
}

/// Reads a message of a topic of images, and returns what `convert` makes of it.
template <class Convert>
auto read(BagMessages& messages, const BagImages& of, const ScanPlace& place, const Convert& convert) {
  return messages.read(of.topic, place, [&](const bags::BagMessage& message, bags::RosEncoding encoding) {
    return bags::decode_image_message(of.is_compressed, message.data, encoding).and_then(convert);
  });
}

/// The note on it. Depth by another clock is not used.
Result<std::string> add_depth(const BagImages& depth, const std::shared_ptr<BagMessages>& messages,
                              const ImagesConfig& config, ImageStream& stream) {
  const auto sensor = depth_sensor(config.depth, bags::kDepthUnit_m);
  if (!sensor) return tl::unexpected(sensor.error());
  std::vector<Timestamp> stamps;
  for (const ScanPlace& place : depth.images) stamps.push_back(place.stamp + config.time_offset_s);
  const CameraModel& camera = stream.cameras.front().model;
  const formats::ExpectedSize size{camera.width_px, camera.height_px};
  const auto load = [messages, depth, size](std::size_t number) {
    return read(*messages, depth, depth.images.at(number),
                [&](const bags::ImageMessage& image) { return bags::to_depth(image, size); });
  };
  const std::size_t found = formats::add_depth(stream, stamps, load, *sensor, config.depth.max_difference_s);
  if (const auto ok = check_depth_stamps(stream.stamps, stamps, found, config.depth.max_difference_s); !ok) {
    stream.load_depth = {};
    return fmt::format("; no depth is used: {}: {}", depth.topic, ok.error().message);
  }
  constexpr double kEarly_s = 5.0;
  std::string out = fmt::format("; {} of them have depth", found);
  if (const double early_s = stream.stamps.back() - stamps.back(); early_s > kEarly_s)
    out += fmt::format(", which ends {:.1f} s before them", early_s);
  return out;
}

}  // namespace

void take_cameras(const BagIndex& index, const std::string& body, const RobotConfig& robot, BagRecording& out) {
  const std::string& wanted = robot.topics.images;
  std::string why;
  std::vector<BagCamera> cameras;
  std::vector<bags::ImageTopic> topics;
  for (const auto& [topic, track] : index.images) {
    if (!wanted.empty() && !is_wanted(topic, wanted)) continue;
    auto camera = camera_of(index, track, body);
    if (!camera) {
      why += (why.empty() ? "" : "; ") + camera.error().message;
      continue;
    }
    topics.push_back(track.seen);
    cameras.push_back(std::move(*camera));
  }
  std::string no_depth;
  const std::vector<bags::ImageTopic> depths = depths_of(index, robot, no_depth);
  const bags::CameraWishes wishes{.are_named = !wanted.empty(),
                                  .most_cameras = robot.images.most_cameras,
                                  .images_flag = flag_of(robot, "images"),
                                  .depth_flag = flag_of(robot, "depth")};
  const auto find = [&](const std::string& a, const std::string& b) { return index.tree.find(a, b); };
  const auto choice = bags::choose_cameras(topics, depths, wishes, find);
  if (!choice)
    out.no_images = choice.error().message;
  else if (choice->cameras.empty())
    out.no_images = why.empty() ? "no sensor_msgs/Image or CompressedImage in the bag" : why;
  else
    take_choice(index, *choice, std::move(cameras), depths, out);
  if (!out.cameras.empty() && !out.depth && !(choice->note + no_depth).empty())
    out.notes.push_back(choice->note.empty() ? no_depth : choice->note);
  take_imu(index, body, robot, out);
}

Result<RobotImages> open_images(const BagRecording& bag, const Trajectory& odometry, const RobotConfig& robot,
                                const visual::TrackingConfig& tracking) {
  auto opened = BagMessages::open(bag.file);
  if (!opened) return tl::unexpected(opened.error());
  const std::shared_ptr<BagMessages> messages = std::move(*opened);
  ImageStream stream;
  for (const BagCamera& camera : bag.cameras) stream.cameras.push_back(camera.camera);
  const double offset_s = robot.images.time_offset_s;
  for (const ScanPlace& place : bag.cameras.front().images) stream.stamps.push_back(place.stamp + offset_s);
  stream.load = [messages, cameras = bag.cameras, most_s = tracking.max_stamp_difference_s](
                    std::size_t instant, std::size_t camera) -> Result<Image> {
    const Timestamp stamp = cameras.front().images.at(instant).stamp;
    const std::vector<ScanPlace>& places = cameras.at(camera).images;
    const auto place = nearest_in_time(places, stamp, most_s, &ScanPlace::stamp);
    if (place == places.end()) return Image();
    return read(*messages, cameras[camera], *place,
                [](const bags::ImageMessage& image) { return bags::to_image(image); });
  };
  std::string note;
  if (bag.depth) {
    auto added = add_depth(*bag.depth, messages, robot.images, stream);
    if (!added) return tl::unexpected(added.error());
    note = std::move(*added);
  }
  auto out = serve_images(std::move(stream), bag.imu, ImuNoise{}, robot.images, odometry, tracking);
  if (out) out->note += note;
  return out;
}

}  // namespace tutti::mission
