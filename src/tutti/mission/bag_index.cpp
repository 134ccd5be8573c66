// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/bag_index.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <tuple>
#include <utility>

#include "tutti/bags/camera.hpp"
#include "tutti/bags/near_types.hpp"
#include "tutti/bags/picture.hpp"
#include "tutti/bags/robot_namespace.hpp"
#include "tutti/bags/ros_messages.hpp"
#include "tutti/bags/ros_types.hpp"

namespace tutti::mission {
namespace {

using bags::BagMessage;

void take_pose(OdometryTrack& track, const BagMessage& message, Timestamp stamp, const Eigen::Vector3d& position,
               const Eigen::Quaterniond& q) {
  ++track.messages;
  const auto pose = bags::to_pose(position, q);
  if (!pose) return track.refused.add(track.messages, pose.error().message);
  track.scaled += bags::is_scaled(q) ? 1 : 0;
  track.poses.push_back({stamp, *pose});
  track.arrivals.push_back({stamp, message.log_time, track.messages});
}

/// Puts items and arrivals, which are one for one, into the order in which they were logged, if the file has another.
template <class Item>
void put_in_log_order(std::vector<Item>& items, std::vector<bags::Arrival>& arrivals) {
  const std::vector<std::size_t> order = bags::log_order(arrivals);
  if (std::ranges::is_sorted(order)) return;
  std::vector<Item> sorted;
  std::vector<bags::Arrival> sorted_arrivals;
  for (const std::size_t at : order) {
    sorted.push_back(std::move(items[at]));
    sorted_arrivals.push_back(arrivals[at]);
  }
  items = std::move(sorted);
  arrivals = std::move(sorted_arrivals);
}

/// Items and arrivals are one for one.
template <class Item>
bags::StampOrder put_in_order(std::vector<Item>& items, std::vector<bags::Arrival>& arrivals, Refusals& refused) {
  put_in_log_order(items, arrivals);
  bags::StampOrder order = bags::order_by_stamp(arrivals);
  for (const auto& [at, why] : order.refused) refused.add(arrivals[at].message, why);
  std::vector<Item> sorted;
  std::vector<bags::Arrival> sorted_arrivals;
  sorted.reserve(order.used.size());
  sorted_arrivals.reserve(order.used.size());
  for (const std::size_t at : order.used) {
    sorted.push_back(std::move(items[at]));
    sorted_arrivals.push_back(arrivals[at]);
  }
  items = std::move(sorted);
  arrivals = std::move(sorted_arrivals);
  return order;
}

void refuse(OdometryTrack& track, const Error& error) { track.refused.add(++track.messages, error.message); }

/// An encoding that is not ROS's counts as CDR: then decoding reports what it found instead.
bags::RosEncoding encoding_of(const BagMessage& message) {
  return bags::to_encoding(message.channel->message_encoding).value_or(bags::RosEncoding::cdr);
}

class Indexer {
 public:
  Indexer(const std::string& pair, bool with_images) : pair_(pair), with_images_(with_images) {}

  void take(const BagMessage& message) {
    const std::string& topic = message.channel->topic;
    switch (bags::use_of(message.channel->type)) {
      case bags::Use::odometry:
        return take_odometry(index.odometry[topic], message);
      case bags::Use::poses:
        return take_pose_stamped(index.poses[topic], message);
      case bags::Use::transforms:
        return take_transforms(message, bags::is_static_tf(topic));
      case bags::Use::scans:
        return take_scan(index.scans[topic], message);
      case bags::Use::fixes:
        return take_antenna(index.fixes[topic], message);
      case bags::Use::ranges:
        if (!bags::ranged_robot(topic).empty()) take_antenna(index.ranges[topic], message);  // others are to walls
        return;
      default:
        if (with_images_) take_sight(message);
        return;
    }
  }

  /// Gives topics of images what is beside them.
  void end() {
    for (auto& [topic, track] : index.scans) keep_frame(track, scan_frames_[topic]);
    for (auto& [topic, track] : index.odometry) keep_body(track, odometry_frames_[topic]);
    for (auto& [topic, track] : index.images)
      if (const auto at = infos_.find(bags::camera_info_topic(topic, track.seen.is_compressed)); at != infos_.end())
        track.seen.info = at->second;
  }

  BagIndex index;

 private:
  void take_odometry(OdometryTrack& track, const BagMessage& message) {
    const auto odometry = bags::decode_odometry(message.data, encoding_of(message));
    if (!odometry) return refuse(track, odometry.error());
    take_pose(track, message, odometry->header.stamp, odometry->pose.position, odometry->pose.orientation);
    auto& frames = odometry_frames_[message.channel->topic];
    if (track.poses.size() > frames.size())
      frames.emplace_back(bags::frame_name(odometry->header.frame_id), bags::frame_name(odometry->child_frame_id));
  }

  /// The frames that most poses name are the topic's; those that name others are of something else.
  static void keep_body(OdometryTrack& track, const std::vector<std::pair<std::string, std::string>>& frames) {
    std::map<std::pair<std::string, std::string>, std::size_t> counts;
    for (const auto& of_pose : frames)
      if (of_pose != std::pair<std::string, std::string>()) ++counts[of_pose];
    if (counts.empty()) return;
    std::tie(track.frame, track.body) =
        std::ranges::max_element(counts, {}, [](const auto& entry) { return entry.second; })->first;
    const auto is_of = [](const std::string& name, const std::string& topic) { return name.empty() || name == topic; };
    std::size_t kept = 0;
    for (std::size_t i = 0; i < frames.size(); ++i) {
      if (!is_of(frames[i].first, track.frame) || !is_of(frames[i].second, track.body)) {
        track.refused.add(track.arrivals[i].message,
                          fmt::format("frames '{:.80}' -> '{:.80}', expected '{:.80}' -> '{:.80}' as of most",
                                      frames[i].first, frames[i].second, track.frame, track.body));
        continue;
      }
      track.poses[kept] = track.poses[i];
      track.arrivals[kept++] = track.arrivals[i];
    }
    track.poses.resize(kept);
    track.arrivals.resize(kept);
  }

  static void take_pose_stamped(OdometryTrack& track, const BagMessage& message) {
    const auto pose = bags::decode_pose_stamped(message.data, encoding_of(message));
    if (!pose) return refuse(track, pose.error());
    if (track.frame.empty()) track.frame = bags::frame_name(pose->header.frame_id);
    take_pose(track, message, pose->header.stamp, pose->pose.position, pose->pose.orientation);
  }

  /// The frame that most scans have is the topic's, wherever the first ones were in.
  static void keep_frame(ScanTrack& track, const std::vector<std::string>& frames) {
    std::map<std::string, std::size_t> counts;
    for (const std::string& frame : frames) ++counts[frame];
    if (counts.empty()) return;
    track.frame = std::ranges::max_element(counts, {}, [](const auto& entry) { return entry.second; })->first;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < frames.size(); ++i) {
      if (frames[i] != track.frame) {
        track.refused.add(track.scans[i].message,
                          fmt::format("frame '{:.80}', expected '{:.80}' as of most", frames[i], track.frame));
        continue;
      }
      track.scans[kept] = track.scans[i];
      track.arrivals[kept++] = track.arrivals[i];
    }
    track.scans.resize(kept);
    track.arrivals.resize(kept);
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
      OdometryTrack& track = index.transforms[key];
      track.frame = parent;
      track.body = child;
      take_pose(track, message, transform.header.stamp, transform.translation, transform.rotation);
    }
  }

  void take_scan(ScanTrack& track, const BagMessage& message) {
    ++track.messages;
    const auto cloud = bags::decode_scan(message.channel->type, message.data, encoding_of(message));
    if (!cloud) return track.refused.add(track.messages, cloud.error().message);
    const std::string frame = bags::frame_name(cloud->header.frame_id);
    scan_frames_[message.channel->topic].push_back(frame);
    track.scans.push_back({cloud->header.stamp, message.position, track.messages});
    track.arrivals.push_back({cloud->header.stamp, message.log_time, track.messages});
  }

  /// A receiver without a fix, or one without a covariance, is none that fails.
  static void take_antenna(AntennaTrack& track, const BagMessage& message) {
    ++track.messages;
    auto sample =
        bags::read_antenna_sample(message.channel->topic, message.channel->type, message.data, encoding_of(message));
    if (!sample) return track.refused.add(track.messages, sample.error().message);
    if (!*sample) {
      ++track.without;
      return;
    }
    track.unsure += (*sample)->is_stated ? 0 : 1;
    track.flat += (*sample)->is_flat ? 1 : 0;
    track.arrivals.push_back({(*sample)->stamp(), message.log_time, track.messages});
    track.samples.push_back(std::move(**sample));
  }

  void take_sight(const BagMessage& message) {
    const std::string& topic = message.channel->topic;
    const bags::RosEncoding encoding = encoding_of(message);
    const bags::Use use = bags::use_of(message.channel->type);
    if (use == bags::Use::calibration) {
      const auto known = infos_.find(topic);
      if (known != infos_.end() && known->second.k[0] > 0.0) return;
      if (auto info = bags::decode_camera_info(message.data, encoding)) infos_[topic] = std::move(*info);
    } else if (use == bags::Use::imu) {
      take_imu(index.imu[topic], message);
    } else if (use == bags::Use::images) {
      ImageTrack& track = index.images[topic];
      track.seen.topic = topic;
      track.seen.is_compressed = message.channel->type == bags::kCompressedType;
      if (track.seen.is_compressed)
        take_image(track, message, bags::decode_compressed_image(message.data, encoding));
      else
        take_image(track, message, bags::decode_image(message.data, encoding));
    }
  }

  template <class Message>
  static void take_image(ImageTrack& track, const BagMessage& message, const Result<Message>& image) {
    ++track.messages;
    if (!image) return track.refused.add(track.messages, image.error().message);
    const Timestamp stamp = image->header.stamp;
    if (track.images.empty()) track.seen.first = bags::layout_of(*image);
    if (track.seen.shows_depth())
      if (auto ok = check_depth(track, *image); !ok) return track.refused.add(track.messages, ok.error().message);
    track.images.push_back({stamp, message.position, track.messages});
    track.arrivals.push_back({stamp, message.log_time, track.messages});
  }

  /// What can be known without decoding it.
  static Status check_depth(const ImageTrack& track, const bags::RosImage& image) {
    if (auto ok = bags::check_like_first(bags::layout_of(image), *track.seen.first); !ok) return ok;
    return bags::check_rows(image, bags::depth_bytes(image.encoding));
  }
  static Status check_depth(const ImageTrack& track, const bags::RosCompressedImage& image) {
    return bags::check_like_first(bags::layout_of(image), *track.seen.first);
  }

  static void take_imu(ImuTrack& track, const BagMessage& message) {
    ++track.messages;
    const auto imu = bags::decode_imu(message.data, encoding_of(message));
    if (!imu) return track.refused.add(track.messages, imu.error().message);
    if (track.samples.empty()) track.frame = bags::frame_name(imu->header.frame_id);
    const auto sample = bags::to_imu_sample(*imu);
    if (!sample) return track.refused.add(track.messages, sample.error().message);
    track.samples.push_back(*sample);
    track.arrivals.push_back({sample->stamp, message.log_time, track.messages});
  }

  const std::string& pair_;
  bool with_images_;
  std::map<std::string, bags::RosCameraInfo> infos_;             // of each topic the first that is calibrated
  std::map<std::string, std::vector<std::string>> scan_frames_;  // of each scan of a topic
  std::map<std::string, std::vector<std::pair<std::string, std::string>>> odometry_frames_;  // and of each pose
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
  const auto order = [&, first = from.logged - kApart_s, last = to.logged + kApart_s](const std::string& topic,
                                                                                      auto& items, auto& track) {
    std::size_t kept = 0, left_out = 0;
    for (std::size_t i = 0; i < items.size() && !odometry.restarts.empty(); ++i) {
      const bags::Arrival arrival = track.arrivals[i];
      if (arrival.logged < first || last < arrival.logged) {
        ++left_out;
        continue;
      }
      items[kept] = std::move(items[i]);
      track.arrivals[kept++] = arrival;
    }
    items.resize(items.size() - left_out);
    track.arrivals.resize(items.size());
    if (left_out > 0)
      index.notes.push_back(
          fmt::format("{}: {} messages were recorded with odometry that is left out, and are, too", topic, left_out));
    if (const auto put = put_in_order(items, track.arrivals, track.refused); put.runs.size() > 1)
      index.notes.push_back(fmt::format("{}: {}", topic, put.in_words()));
  };
  for (auto& [topic, track] : index.scans) order(topic, track.scans, track);
  for (auto& [topic, track] : index.images) order(topic, track.images, track);
  for (auto& [topic, track] : index.imu) order(topic, track.samples, track);
  for (auto& [topic, track] : index.fixes) order(topic, track.samples, track);
  for (auto& [topic, track] : index.ranges) order(topic, track.samples, track);
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
      const bags::StampOrder order = put_in_order(track.poses, track.arrivals, track.refused);
      track.late = order.late;
      track.restarts = order.in_words();
    }
  index.notes = bag.notes();
  return std::move(index);
}

}  // namespace tutti::mission
