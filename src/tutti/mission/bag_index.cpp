// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/bag_index.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <tuple>
#include <type_traits>
#include <utility>

#include "tutti/bags/camera.hpp"
#include "tutti/bags/near_types.hpp"
#include "tutti/bags/robot_namespace.hpp"
#include "tutti/bags/ros_messages.hpp"
#include "tutti/bags/ros_types.hpp"

namespace tutti::mission {
namespace {

using bags::BagMessage;

void take_pose(OdometryTrack& track, const BagMessage& message, Timestamp stamp, const Eigen::Vector3d& position,
               const Eigen::Quaterniond& q) {
  const auto pose = bags::to_pose(position, q);
  if (!pose) return track.refuse(pose.error().message);
  track.scaled += bags::is_scaled(q) ? 1 : 0;
  track.add({stamp, *pose}, stamp, message.log_time);
}

/// First into the order in which they were logged, if the file has another, then by their stamps.
template <class Item>
bags::StampOrder put_in_order(Track<Item>& track) {
  if (const auto logged = bags::log_order(track.arrivals); !std::ranges::is_sorted(logged)) track.select(logged);
  bags::StampOrder order = bags::order_by_stamp(track.arrivals);
  for (const auto& [at, why] : order.refused) track.refused.add(track.arrivals[at].message, why);
  track.select(order.used);
  return order;
}

/// Messages name these frames: the odometry's, and its body's.
using FramePair = std::pair<std::string, std::string>;
bool is_like(const std::string& frame, const std::string& most) { return frame == most; }
bool is_like(const FramePair& frames, const FramePair& most) {
  const auto is_of = [](const std::string& name, const std::string& topic) { return name.empty() || name == topic; };
  return is_of(frames.first, most.first) && is_of(frames.second, most.second);
}
std::string in_quotes(const std::string& frame) { return fmt::format("'{:.80}'", frame); }
std::string in_quotes(const FramePair& frames) { return in_quotes(frames.first) + " -> " + in_quotes(frames.second); }

/// The frames that most messages name are the topic's, wherever the first ones were in; messages that name others are
/// of something else. `frames` are those of each item.
template <class Item, class Frames>
Frames keep_most(Track<Item>& track, const std::vector<Frames>& frames, const char* what) {
  std::map<Frames, std::size_t> counts;
  for (const Frames& of_item : frames)
    if (!std::is_same_v<Frames, FramePair> || of_item != Frames()) ++counts[of_item];  // a pose may name none
  if (counts.empty()) return {};
  const Frames most = std::ranges::max_element(counts, {}, [](const auto& entry) { return entry.second; })->first;
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < frames.size(); ++i)
    if (is_like(frames[i], most))
      kept.push_back(i);
    else
      track.refused.add(track.arrivals[i].message,
                        fmt::format("{} {}, expected {} as of most", what, in_quotes(frames[i]), in_quotes(most)));
  track.select(kept);
  return most;
}

/// An encoding that is not ROS's counts as CDR: then decoding reports what it found instead.
bags::RosEncoding encoding_of(const BagMessage& message) {
  return bags::to_encoding(message.channel->message_encoding).value_or(bags::RosEncoding::cdr);
}

template <class Of>
Of& counted(Of& track) {
  ++track.messages;
  return track;
}

class Indexer {
 public:
  Indexer(const std::string& pair, bool with_images) : pair_(pair), with_images_(with_images) {}

  void take(const BagMessage& message) {
    const std::string& topic = message.channel->topic;
    switch (bags::use_of(message.channel->type)) {
      case bags::Use::odometry:
        return take_odometry(counted(index.odometry[topic]), message);
      case bags::Use::poses:
        return take_pose_stamped(counted(index.poses[topic]), message);
      case bags::Use::transforms:
        return take_transforms(message, bags::is_static_tf(topic));
      case bags::Use::scans:
        return take_scan(counted(index.scans[topic]), message);
      case bags::Use::fixes:
        return take_antenna(counted(index.fixes[topic]), message);
      case bags::Use::ranges:
        if (!bags::ranged_robot(topic).empty()) take_antenna(counted(index.ranges[topic]), message);
        return;  // others are to walls
      default:
        if (with_images_) take_sight(message);
        return;
    }
  }

  /// Gives topics of images what is beside them.
  void end() {
    for (auto& [topic, track] : index.scans) track.frame = keep_most(track, scan_frames_[topic], "frame");
    for (auto& [topic, track] : index.odometry)
      std::tie(track.frame, track.body) = keep_most(track, odometry_frames_[topic], "frames");
    for (auto& [topic, track] : index.images)
      if (const auto at = infos_.find(bags::camera_info_topic(topic, track.seen.is_compressed)); at != infos_.end())
        track.seen.info = at->second;
  }

  BagIndex index;

 private:
  void take_odometry(OdometryTrack& track, const BagMessage& message) {
    const auto odometry = bags::decode_odometry(message.data, encoding_of(message));
    if (!odometry) return track.refuse(odometry.error().message);
    take_pose(track, message, odometry->header.stamp, odometry->pose.position, odometry->pose.orientation);
    auto& frames = odometry_frames_[message.channel->topic];
    if (track.items.size() > frames.size())
      frames.emplace_back(bags::frame_name(odometry->header.frame_id), bags::frame_name(odometry->child_frame_id));
  }

  static void take_pose_stamped(OdometryTrack& track, const BagMessage& message) {
    const auto pose = bags::decode_pose_stamped(message.data, encoding_of(message));
    if (!pose) return track.refuse(pose.error().message);
    if (track.frame.empty()) track.frame = bags::frame_name(pose->header.frame_id);
    take_pose(track, message, pose->header.stamp, pose->pose.position, pose->pose.orientation);
  }

  void take_transforms(const BagMessage& message, bool is_static) {
    const std::string& topic = message.channel->topic;
    const std::string name_space = bags::namespace_of(topic);
    bags::TransformTree& tree = index.trees[name_space];
    const auto transforms = bags::decode_tf(message.data, encoding_of(message));
    if (!transforms) return tree.add_problem(transforms.error().message);
    for (const bags::RosTransform& transform : *transforms) {
      static_cast<void>(tree.add(transform, is_static));  // it keeps its problems
      const std::string parent = bags::frame_name(transform.header.frame_id),
                        child = bags::frame_name(transform.child_frame_id), pair = parent + "->" + child;
      const std::string key = name_space.empty() ? pair : topic + ":" + pair;
      const bool is_odometry = bags::is_odometry_frame(parent) || pair == pair_ || key == pair_;
      if (!is_static && !is_odometry) index.other_transforms.insert(key);
      if (is_static || !is_odometry) continue;
      OdometryTrack& track = counted(index.transforms[key]);
      track.frame = parent;
      track.body = child;
      take_pose(track, message, transform.header.stamp, transform.translation, transform.rotation);
    }
  }

  void take_scan(ScanTrack& track, const BagMessage& message) {
    const auto cloud = bags::decode_scan(message.channel->type, message.data, encoding_of(message));
    if (!cloud) return track.refuse(cloud.error().message);
    scan_frames_[message.channel->topic].push_back(bags::frame_name(cloud->header.frame_id));
    add_place(track, message, cloud->header.stamp);
  }

  static void add_place(Track<ScanPlace>& track, const BagMessage& message, Timestamp stamp) {
    track.add({stamp, message.position, track.messages}, stamp, message.log_time);
  }

  /// A receiver without a fix, or one without a covariance, is none that fails.
  static void take_antenna(AntennaTrack& track, const BagMessage& message) {
    auto sample =
        bags::read_antenna_sample(message.channel->topic, message.channel->type, message.data, encoding_of(message));
    if (!sample) return track.refuse(sample.error().message);
    if (!*sample) {
      ++track.without;
      return;
    }
    track.unsure += (*sample)->is_stated ? 0 : 1;
    track.flat += (*sample)->is_flat ? 1 : 0;
    const Timestamp stamp = (*sample)->stamp();
    track.add(std::move(**sample), stamp, message.log_time);
  }

  void take_sight(const BagMessage& message) {
    const std::string& topic = message.channel->topic;
    const bags::RosEncoding encoding = encoding_of(message);
    const bags::Use use = bags::use_of(message.channel->type);
    if (use == bags::Use::calibration) {
      const auto known = infos_.find(topic);
      if (known != infos_.end() && bags::to_camera(known->second)) return;  // as of a live topic
      if (auto info = bags::decode_camera_info(message.data, encoding)) infos_[topic] = std::move(*info);
    } else if (use == bags::Use::imu) {
      take_imu(counted(index.imu[topic]), message);
    } else if (use == bags::Use::images) {
      ImageTrack& track = counted(index.images[topic]);
      track.seen.topic = topic;
      track.seen.is_compressed = message.channel->type == bags::kCompressedType;
      const auto image = bags::decode_image_message(track.seen.is_compressed, message.data, encoding);
      if (!image) return track.refuse(image.error().message);
      if (const Status ok = track.seen.add(*image); !ok) return track.refuse(ok.error().message);
      add_place(track, message, bags::header_of(*image).stamp);
    }
  }

  static void take_imu(Track<ImuSample>& track, const BagMessage& message) {
    const auto imu = bags::decode_imu(message.data, encoding_of(message));
    if (!imu) return track.refuse(imu.error().message);
    if (track.items.empty()) track.frame = bags::frame_name(imu->header.frame_id);
    const auto sample = bags::to_imu_sample(*imu);
    if (!sample) return track.refuse(sample.error().message);
    track.add(*sample, sample->stamp, message.log_time);
  }

  const std::string& pair_;
  bool with_images_;
  std::map<std::string, bags::RosCameraInfo> infos_;               // of each topic the first that is valid
  std::map<std::string, std::vector<std::string>> scan_frames_;    // of each scan of a topic
  std::map<std::string, std::vector<FramePair>> odometry_frames_;  // and of each pose
};

}  // namespace

void Refusals::add(std::uint64_t message, const std::string& why) {
  if (count++ > 0 && message >= first_message) return;
  first_message = message;
  first = fmt::format("message {}: {}", message, why);
}

std::string note_of(const std::string& topic, const Refusals& refused, std::uint64_t of) {
  return fmt::format("{}: {} of {} messages refused, the first because: {}", topic, refused.count, of, refused.first);
}

void order_sensors(BagIndex& index, const OdometryTrack& odometry) {
  constexpr double kApart_s = 1.0;  // by which a sensor's message may be recorded before or after odometry
  const auto [from, to] = std::ranges::minmax(odometry.arrivals, {}, &bags::Arrival::logged);
  const auto order = [&, first = from.logged - kApart_s, last = to.logged + kApart_s](auto& tracks) {
    for (auto& [topic, track] : tracks) {
      std::vector<std::size_t> kept;
      for (std::size_t i = 0; i < track.items.size(); ++i)
        if (odometry.restarts.empty() || (first <= track.arrivals[i].logged && track.arrivals[i].logged <= last))
          kept.push_back(i);
      if (const std::size_t left_out = track.items.size() - kept.size(); left_out > 0) {
        track.select(kept);
        index.notes.push_back(
            fmt::format("{}: {} messages were recorded with odometry that is left out, and are, too", topic, left_out));
      }
      if (const auto put = put_in_order(track); put.runs.size() > 1)
        index.notes.push_back(fmt::format("{}: {}", topic, put.in_words()));
    }
  };
  order(index.scans);
  order(index.images);
  order(index.imu);
  order(index.fixes);
  order(index.ranges);
}

void keep_robot(BagIndex& index, const RobotConfig& robot) {
  std::vector<std::string> odometry;
  for (const auto* tracks : {&index.odometry, &index.transforms})
    for (const auto& [topic, track] : *tracks) odometry.push_back(topic);
  if (odometry.empty())
    for (const auto& [topic, track] : index.poses) odometry.push_back(topic);
  const auto& topics = robot.topics;
  const bags::RobotNamespace names = bags::robot_namespace(odometry, robot.name, topics.odometry);
  if (!names.own.empty() && names.all.size() > 1)
    index.notes.push_back(
        fmt::format("topics of /{} are used: the bag has robots {}", names.own, fmt::join(names.all, ", ")));
  const auto keep = [&](const std::string& wanted, auto&... tracks) {
    if (wanted.empty()) (names.keep(tracks), ...);
  };
  keep(topics.odometry, index.odometry, index.poses, index.transforms);
  keep(topics.scans, index.scans);
  if (topics.depth.empty()) keep(topics.images, index.images);
  keep(topics.imu, index.imu);
  keep(topics.fixes, index.fixes);
  names.keep(index.ranges);

  const auto own = index.trees.find(names.own);
  if (own != index.trees.end()) index.tree = own->second;
  for (const auto& [of, tree] : index.trees)
    if (of != names.own && names.may_use(of + "/tf")) index.tree.merge(tree);
  for (const auto& [problem, count] : index.tree.problems())
    index.notes.push_back(fmt::format("transforms: {}{}", problem, count > 1 ? fmt::format(" ({} times)", count) : ""));
}

BagIndex index_bag(bags::BagReader& bag, const std::string& pair, bool with_images) {
  Indexer indexer(pair, with_images);
  BagIndex& index = indexer.index;
  while (true) {
    const auto message = bag.next();
    if (!message) {
      if (index.bad_records.count++ == 0) index.bad_records.first = message.error().message;
      continue;
    }
    if (!*message) break;
    indexer.take(**message);
  }
  indexer.end();
  for (const bags::BagChannel* const channel : bag.channels()) {  // those without messages, too
    const bags::Use use = bags::use_of(channel->type);
    if (use == bags::Use::odometry) index.odometry[channel->topic];
    if (use == bags::Use::poses) index.poses[channel->topic];
    if (use == bags::Use::scans) index.scans[channel->topic];
    const std::string_view type = channel->type, way = bags::way_on(type);
    constexpr std::array kOfPoses{"geometry_msgs/", "nav_msgs/", "px4_msgs/", "foxglove.Pose", "foxglove.Frame"};
    const bool is_pose = std::ranges::any_of(kOfPoses, [&](const char* begin) { return type.starts_with(begin); });
    if (!way.empty())
      (is_pose ? index.near_odometry : index.near_scans) +=
          fmt::format("; near: {} ({}): {}", channel->topic, type, way);
  }
  for (auto* tracks : {&index.odometry, &index.poses, &index.transforms})
    for (auto& [topic, track] : *tracks) {
      const bags::StampOrder order = put_in_order(track);
      track.late = order.late;
      track.restarts = order.in_words();
    }
  index.notes = bag.notes();
  return std::move(index);
}

}  // namespace tutti::mission
