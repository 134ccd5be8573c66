// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/bag_info.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "tutti/bags/antenna_sample.hpp"
#include "tutti/bags/camera.hpp"
#include "tutti/bags/rgbd.hpp"
#include "tutti/bags/robot_namespace.hpp"
#include "tutti/bags/ros_messages.hpp"

namespace tutti::bags {
namespace {

constexpr std::size_t kMostSaid = 10;
constexpr std::size_t kMostFrames = 4;

std::string frames_of(const std::vector<RosTransform>& transforms) {
  std::string out;
  for (std::size_t i = 0; i < std::min(transforms.size(), kMostFrames); ++i)
    out += fmt::format("{}{} -> {}", i > 0 ? ", " : "", transforms[i].header.frame_id, transforms[i].child_frame_id);
  if (transforms.size() > kMostFrames) out += fmt::format(" and {} more", transforms.size() - kMostFrames);
  return out;
}
std::string frames_of(const RosOdometry& message) {
  return fmt::format("{} -> {}", message.header.frame_id, message.child_frame_id);
}
std::string frames_of(const auto& message) { return message.header.frame_id; }

/// Notes what the first message of a topic shows.
void note_first(TopicInfo& topic, const BagMessage& message) {
  const auto encoding = to_encoding(message.channel->message_encoding);
  const auto decoded = encoding ? decode_message(topic.type, message.data, *encoding)
                                : Result<RosMessage>(tl::unexpected(encoding.error()));
  if (!decoded) {
    topic.problem = decoded.error().message;
    return;
  }
  topic.frames = std::visit([](const auto& of) { return frames_of(of); }, *decoded);
  if (const auto* const image = std::get_if<RosImage>(&*decoded)) topic.image = layout_of(*image);
  if (const auto* const image = std::get_if<RosCompressedImage>(&*decoded)) topic.image = layout_of(*image);
  if (const auto* const info = std::get_if<RosCameraInfo>(&*decoded)) topic.calibration = *info;
}

/// Looks for a fix that is one.
void note_fix(TopicInfo& topic, const BagMessage& message) {
  const auto encoding = to_encoding(message.channel->message_encoding);
  const auto decoded = encoding ? decode_nav_sat_fix(message.data, *encoding).and_then(&to_fix)
                                : Result<std::optional<AntennaSample>>(tl::unexpected(encoding.error()));
  topic.has_fix = decoded && decoded->has_value();
  if (!decoded && topic.refused_fix.empty())
    topic.refused_fix = fmt::format("message {}: {}", topic.count, decoded.error().message);
}

void note_message(TopicInfo& topic, const BagMessage& message) {
  const bool is_uncalibrated = topic.use == Use::calibration && !(topic.calibration && to_camera(*topic.calibration));
  if ((topic.count++ == 0 && topic.use != Use::nothing) || is_uncalibrated) note_first(topic, message);
  if (topic.use == Use::fixes && !topic.has_fix) note_fix(topic, message);
  topic.first = std::min(topic.first, message.log_time);
  topic.last = std::max(topic.last, message.log_time);
}

/// Trees are by namespace. Also finds which namespaces of frames have odometry.
void add_transforms(std::map<std::string, TransformTree>& trees, std::set<std::string>& robots,
                    const BagMessage& message) {
  const auto encoding = to_encoding(message.channel->message_encoding);
  if (!encoding) return;
  const auto transforms = decode_tf(message.data, *encoding);
  if (!transforms) return;
  const std::string of = namespace_of(message.channel->topic);
  const bool is_static = is_static_tf(message.channel->topic);
  for (const RosTransform& transform : *transforms) {
    static_cast<void>(trees[of].add(transform, is_static));  // it keeps its problems
    if (!is_static && is_odometry_frame(frame_name(transform.header.frame_id)))
      robots.insert(of.empty() ? namespace_of(transform.header.frame_id) : of);
  }
}

/// A namespace with odometry is a robot's, but not where it has no sensor, no transforms and no frames of its own and
/// others have sensors: then it is one more odometry of a robot, as "/wheel/odom".
void add_robots(BagInfo& out) {
  std::set<std::string> with_more;
  bool has_sensors = false;
  for (const TopicInfo& topic : out.topics) {
    const bool is_sensor = topic.use == Use::scans || topic.use == Use::images;
    has_sensors = has_sensors || is_sensor;
    if (is_sensor || topic.use == Use::transforms) with_more.insert(namespace_of(topic.topic));
  }
  for (const TopicInfo& topic : out.topics) {
    const std::string of = namespace_of(topic.topic);
    if (topic.use == Use::odometry && (!has_sensors || with_more.contains(of) || namespace_of(topic.frames) == of))
      out.robots.insert(of);
  }
}

void take_trees(const std::map<std::string, TransformTree>& trees, BagInfo& out) {
  for (const auto& [of, tree] : trees) {
    for (const auto& [problem, count] : tree.problems())
      out.notes.push_back(fmt::format("transforms{}: {}{}", of.empty() ? "" : " of /" + of, problem,
                                      count > 1 ? fmt::format(" ({} times)", count) : ""));
    out.tree.merge(tree);
  }
}

bool is_understood(const TopicInfo& topic, Use use) {
  return topic.use == use && topic.count > 0 && topic.problem.empty();
}

/// As it is so far: without messages, it shows nothing.
ImageTopic image_topic(const BagInfo& info, const TopicInfo& topic) {
  ImageTopic out{topic.topic, topic.type == kCompressedType, topic.image, {}};
  const std::string beside = camera_info_topic(topic.topic, out.is_compressed);
  const auto at = std::ranges::find_if(
      info.topics, [&](const TopicInfo& other) { return other.topic == beside && other.calibration.has_value(); });
  if (at != info.topics.end()) out.info = at->calibration;
  return out;
}

/// Why a robot would not use the topic; empty where it would.
std::string refusal_of(const TopicInfo& topic, const ImageTopic& images) {
  if (topic.use == Use::images) {
    const auto camera = images.camera();
    return camera ? "" : ", of no use: " + camera.error().message;
  }
  if (topic.use != Use::fixes || topic.has_fix) return "";
  return ", of no use: " + (topic.refused_fix.empty()
                                ? "no message has a fix (status -1, or 0 degrees north and 0 east)"
                                : "no message is a fix, the first because: " + topic.refused_fix);
}

/// Without those that show depth.
std::string list_of(const BagInfo& info, Use use) {
  std::string out;
  for (const TopicInfo& topic : info.topics) {
    if (!is_understood(topic, use)) continue;
    const ImageTopic images = image_topic(info, topic);
    if (images.shows_depth()) continue;
    out += fmt::format("{}{}{}{}", out.empty() ? "" : "; ", topic.topic,
                       topic.frames.empty() ? "" : " (" + topic.frames + ")", refusal_of(topic, images));
  }
  return out;
}

/// The topics that show depth, and what a robot would do with them; empty when there are none.
std::string depth_in_words(const BagInfo& info) {
  std::string out;
  std::vector<ImageTopic> cameras, depths;
  for (const TopicInfo& topic : info.topics) {
    if (!is_understood(topic, Use::images)) continue;
    ImageTopic it = image_topic(info, topic);
    if (it.shows_depth()) {
      out += fmt::format("{}{} ({}, {}, {} x {}{})", out.empty() ? "" : "; ", it.topic, it.first->frame,
                         it.first->encoding, it.width_px(), it.height_px(), it.info ? "" : ", no CameraInfo");
      if (it.info) depths.push_back(std::move(it));
    } else if (it.info && it.shows_picture()) {
      cameras.push_back(std::move(it));
    }
  }
  if (out.empty()) return out;
  const CameraWishes wishes{.images_flag = "tutti run --topic NAME.images=",
                            .depth_flag = "tutti run --topic NAME.depth="};
  const auto choice = choose_cameras(cameras, depths, wishes,
                                     [&](const std::string& a, const std::string& b) { return info.tree.find(a, b); });
  if (!choice) return out + "; " + choice.error().message;
  if (choice->depth)
    return out + fmt::format("; {} goes with {}", depths[*choice->depth].topic, cameras[choice->cameras.front()].topic);
  if (choice->cameras.empty()) return out + "; no camera with a CameraInfo that it goes with";
  return choice->note.empty() ? out : out + "; " + choice->note;
}

}  // namespace

double TopicInfo::rate_hz() const {
  const double seconds = count < 2 ? 0.0 : last - first;
  return seconds > 0.0 ? static_cast<double>(count - 1) / seconds : 0.0;
}

BagInfo inspect(BagReader& bag) {
  BagInfo out;
  // One topic may have several channels, as in bags that were joined: of one type they are one.
  std::map<std::pair<std::string, std::string>, TopicInfo> topics;
  const auto topic_of = [&topics](const BagChannel& channel) -> TopicInfo& {
    TopicInfo& topic = topics[{channel.topic, channel.type}];
    topic.topic = channel.topic;
    topic.type = channel.type;
    topic.use = use_of(channel.type);
    return topic;
  };
  std::map<const BagChannel*, TopicInfo*> of_channel;
  std::map<std::string, TransformTree> trees;
  while (true) {
    const auto message = bag.next();
    if (!message) {
      if (++out.errors <= kMostSaid) out.said.push_back(message.error().message);
      continue;
    }
    if (!*message) break;
    TopicInfo*& topic = of_channel[(*message)->channel];
    if (!topic) topic = &topic_of(*(*message)->channel);
    note_message(*topic, **message);
    if (topic->use == Use::transforms) add_transforms(trees, out.robots, **message);
    ++out.messages;
  }
  for (const BagChannel* const channel : bag.channels()) topic_of(*channel);
  out.notes = bag.notes();
  if (const auto stated = bag.stated_messages(); stated && *stated != out.messages)
    out.notes.push_back(fmt::format("its statistics say {} messages, {} could be read", *stated, out.messages));
  for (auto& [name, topic] : topics) {
    out.topics.push_back(std::move(topic));
  }
  add_robots(out);
  out.robots.erase("");
  take_trees(trees, out);
  return out;
}

std::vector<std::string> uses(const BagInfo& info) {
  struct Row {
    const char* name;
    Use use;
    const char* without;
  };
  constexpr std::array kRows{
      Row{"scans", Use::scans, "none (no sensor_msgs/msg/PointCloud2, no CustomMsg of a Livox): no closures by LiDAR"},
      Row{"images", Use::images, "none (no sensor_msgs/msg/Image or CompressedImage): no closures by camera"},
      Row{"calibration", Use::calibration, nullptr},
      Row{"imu", Use::imu, nullptr},
      Row{"fixes", Use::fixes, nullptr},
      Row{"tf", Use::transforms, "none: where the sensors are on the robot has to be stated elsewhere"},
  };
  std::vector<std::string> out;
  const auto add = [&out](const char* name, const std::string& what) {
    out.push_back(fmt::format("{:<12} {}", name, what));
  };
  if (const std::string odometry = list_of(info, Use::odometry); !odometry.empty())
    add("odometry", odometry);
  else if (const std::string poses = list_of(info, Use::poses); !poses.empty())
    add("odometry", "no nav_msgs/msg/Odometry; poses of " + poses + ", if they are odometry's");
  else if (!list_of(info, Use::transforms).empty())
    add("odometry", "no nav_msgs/msg/Odometry; transforms, if odometry's is among them");
  else
    add("odometry", "missing: without odometry nothing can be made of this bag");
  for (const Row& row : kRows) {
    if (const std::string list = list_of(info, row.use); !list.empty())
      add(row.name, list);
    else if (row.without)
      add(row.name, row.without);
    if (row.use != Use::images) continue;
    if (const std::string depth = depth_in_words(info); !depth.empty()) add("depth", depth);
  }
  if (!info.robots.empty()) add("robots", fmt::format("{} (namespaces with odometry)", fmt::join(info.robots, ", ")));
  return out;
}

}  // namespace tutti::bags
