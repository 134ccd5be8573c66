// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/bag_recording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include "tutti/bags/robot_namespace.hpp"
#include "tutti/bags/sensor_clock.hpp"
#include "tutti/mission/bag_left_out.hpp"

namespace tutti::mission {
namespace {

namespace fs = std::filesystem;

const std::string kOfTransforms = "->";

std::string in_words(const OdometryTrack& track) {
  return fmt::format("{} -> {}, {} poses", track.frame.empty() ? "?" : track.frame,
                     track.body.empty() ? "?" : track.body, track.items.size());
}
std::string in_words(const ScanTrack& track) { return fmt::format("{}, {} scans", track.frame, track.items.size()); }
bool has_any(const OdometryTrack& track) { return track.items.size() > 1; }
bool has_any(const ScanTrack& track) { return !track.items.empty(); }

/// "/a (odom -> base, 12 poses); /b (no messages)"
template <class Tracks>
std::string list_of(const Tracks& tracks) {
  std::string out;
  for (const auto& [name, track] : tracks) {
    const std::string refused = track.refused.count == 0
                                    ? ""
                                    : fmt::format(", {} of {} messages refused, the first because: {}",
                                                  track.refused.count, track.messages, track.refused.first);
    out += fmt::format("{}{} ({}{})", out.empty() ? "" : "; ", name,
                       track.messages == 0 ? "no messages" : in_words(track), refused);
  }
  return out.empty() ? "none" : out;
}

std::string flag(const RobotConfig& robot, const char* kind, const std::string& topic) {
  return fmt::format("--topic {}.{}={} (in a mission file: robots[].topics.{})", robot.name, kind, topic, kind);
}

/// The one that is wanted, or the only one that has something; null when there is none.
template <class Track>
Result<const std::pair<const std::string, Track>*> choose(const std::map<std::string, Track>& tracks,
                                                          const std::string& wanted, const char* kind,
                                                          const RobotConfig& robot) {
  if (!wanted.empty()) {
    const auto at = tracks.find(wanted);
    if (at == tracks.end())
      return fail(ErrorCode::invalid, "topics.{}: '{}' is not in the bag, expected one of: {}", kind, wanted,
                  list_of(tracks));
    if (!has_any(at->second))
      return fail(ErrorCode::invalid, "topics.{}: nothing can be made of {}", kind,
                  list_of(std::map<std::string, Track>{*at}));
    return &*at;
  }
  const std::pair<const std::string, Track>* found = nullptr;
  for (const auto& entry : tracks) {
    if (!has_any(entry.second)) continue;
    if (found != nullptr)
      return fail(ErrorCode::invalid, "several topics have {}: {}; say which: {}", kind, list_of(tracks),
                  flag(robot, kind, found->first));
    found = &entry;
  }
  return found;
}

/// "; of /tf, camera_init->body moves, too: .." where one of the pairs may be odometry by another name; those first
/// whose parent is nobody's child.
std::string other_frames(const BagIndex& index, const RobotConfig& robot) {
  constexpr std::size_t kMost = 4;
  constexpr std::string_view kArrow = "->";
  std::set<std::string> children;
  std::vector<std::pair<std::string, std::string>> moving;  // the parent, the pair
  for (const std::string& key : index.other_transforms) {
    const std::string pair = key.substr(key.find(':') + 1);  // npos + 1 is the beginning
    const std::size_t arrow = pair.find(kArrow);
    const std::string parent = pair.substr(0, arrow), child = pair.substr(arrow + kArrow.size());
    children.insert(child);
    if (!index.tree.find(parent, child)) moving.emplace_back(parent, key);
  }
  if (moving.empty()) return "";
  std::ranges::stable_partition(moving, [&](const auto& entry) { return !children.contains(entry.first); });
  std::string out;
  for (std::size_t i = 0; i < std::min(moving.size(), kMost); ++i)
    out += fmt::format("{}{}", i > 0 ? ", " : "", moving[i].second);
  return fmt::format("; of /tf, {} move{}: is it odometry? --topic '{}.odometry={}'", out,
                     moving.size() == 1 ? "s" : "", robot.name, moving.front().second);
}

/// "; or are they robots of their own? .." of odometry in several namespaces.
std::string as_robots(const BagIndex& index, const RobotConfig& robot) {
  std::set<std::string> names;
  for (const auto& [topic, track] : index.odometry)
    if (has_any(track)) names.insert(bags::namespace_of(topic));
  names.erase("");
  std::string out;
  for (const std::string& name : names) out += fmt::format(" --bag {}={}", name, robot.bag);
  return names.size() < 2 ? "" : "; or are they robots of their own? tutti run" + out;
}

/// The track with its name, of the three kinds the first that has one.
Result<const std::pair<const std::string, OdometryTrack>*> choose_odometry(const BagIndex& index,
                                                                           const RobotConfig& robot) {
  const std::string& wanted = robot.topics.odometry;
  if (wanted.find(kOfTransforms) != std::string::npos) {
    const std::string own = fmt::format("/{}/tf:{}", robot.name, wanted);
    return choose(index.transforms, index.transforms.contains(own) ? own : wanted, "odometry", robot);
  }
  if (index.poses.contains(wanted)) return choose(index.poses, wanted, "odometry", robot);
  auto found = choose(index.odometry, wanted, "odometry", robot);
  if (!found) return fail(found.error().code, "{}{}", found.error().message, as_robots(index, robot));
  if (*found != nullptr) return found;
  found = choose(index.transforms, "", "odometry", robot);
  if (!found || *found != nullptr) return found;
  found = choose(index.poses, "", "odometry", robot);
  if (!found || *found != nullptr) return found;
  return fail(ErrorCode::invalid,
              "no odometry: expected a topic of nav_msgs/Odometry (here: {}) or geometry_msgs/PoseStamped ({}), or a "
              "frame in odom in /tf ({}){}{}",
              list_of(index.odometry), list_of(index.poses), list_of(index.transforms), other_frames(index, robot),
              index.near_odometry);
}

/// "; refused were: transform base_link -> lidar: orientation of norm 0, .."
std::string refused_transforms(const bags::TransformTree& tree) {
  constexpr std::size_t kMost = 3;
  std::string out;
  std::size_t count = 0;
  for (const auto& [problem, times] : tree.problems())
    if (++count <= kMost) out += (out.empty() ? "; refused were: " : "; ") + problem;
  return out;
}

/// Scans that were moved into the odometry's frame already lost where the LiDAR was.
Error in_world(const BagIndex& index, const std::string& frame, const char* what, const RobotConfig& robot) {
  std::string others;
  for (const auto& [topic, track] : index.scans)
    if (has_any(track) && track.frame != frame) others = topic;
  return {ErrorCode::invalid, fmt::format("scans are in '{}', {}: they are moved into it already. Take the cloud of "
                                          "the body or of the sensor (of FAST-LIO /cloud_registered_body): {}",
                                          frame, what, flag(robot, "scans", others.empty() ? "TOPIC" : others))};
}

/// Names of frames in which front ends put clouds that they have moved.
bool is_of_the_world(const std::string& frame) {
  constexpr std::array<std::string_view, 8> kNames{"map",   "world", "odom",        "global",
                                                   "earth", "utm",   "camera_init", "local_origin"};
  return std::ranges::find(kNames, frame.substr(frame.find_last_of('/') + 1)) != kNames.end();
}

Result<Pose3> find_lidar(const BagIndex& index, const OdometryTrack& odometry, const std::string& lidar,
                         const RobotConfig& robot, std::string& note) {
  if (is_given(robot.T_body_lidar)) {
    note = "the LiDAR is where T_body_lidar says";
    return to_pose(robot.T_body_lidar);
  }
  const std::string& body = odometry.body;
  if (body == lidar) {
    note = "scans are in the odometry's body frame";
    return Pose3{};
  }
  if (lidar == odometry.frame && !lidar.empty())
    return tl::unexpected(in_world(index, lidar, "the odometry's own frame", robot));
  if (body.empty()) {
    note = fmt::format("nothing says which body the odometry is of: taken as that of the scans, {}", lidar);
    return Pose3{};
  }
  const auto found = index.tree.pose(body, lidar);
  if (found) {
    note = fmt::format("{} is in {} by the bag's transforms", lidar, body);
    return *found;
  }
  if (is_of_the_world(lidar))
    return tl::unexpected(in_world(index, lidar, "by its name a frame that no robot carries", robot));
  return fail(ErrorCode::invalid,
              "where the LiDAR is on the robot is not known: {}{}; say it: --set "
              "robots.{}.T_body_lidar.translation_m=[x,y,z] (zeros where both frames are one)",
              found.error().message, refused_transforms(index.tree), robot.name);
}

/// Odometry that names no body, or its own frame as one, is of the root of the sensor's transforms.
void find_body(const BagIndex& index, const std::string& sensor, OdometryTrack& odometry,
               std::vector<std::string>& notes) {
  if (!odometry.body.empty() && odometry.body != odometry.frame) return;
  odometry.body.clear();
  const std::string root = index.tree.root_of(sensor);
  if (root == bags::frame_name(sensor) || root == odometry.frame || bags::is_odometry_frame(root)) return;
  odometry.body = root;
  notes.push_back(fmt::format(
      "nothing says which body the odometry is of: taken as {}, the root of the transforms to {}", root, sensor));
}

std::optional<std::string> frame_of_images(const BagIndex& index) {
  for (const auto& [topic, track] : index.images)
    if (track.seen.first) return track.seen.first->frame;
  return std::nullopt;
}

/// Topics of scans without those that are in the odometry's frame, if others are left.
std::map<std::string, ScanTrack> of_the_sensor(const BagIndex& index, const OdometryTrack& odometry,
                                               std::vector<std::string>& notes) {
  std::map<std::string, ScanTrack> out = index.scans;
  std::erase_if(out, [&](const auto& entry) {
    return has_any(entry.second) && !odometry.frame.empty() && entry.second.frame == odometry.frame;
  });
  if (out.size() == index.scans.size()) return out;
  if (std::ranges::none_of(out, [](const auto& entry) { return has_any(entry.second); })) return index.scans;
  for (const auto& [topic, track] : index.scans)
    if (!out.contains(topic))
      notes.push_back(fmt::format("{}: is in {}, the odometry's own frame, and not used", topic, track.frame));
  return out;
}

void doubt_place(const std::string& topic, const Pose3& T_body_sensor, std::vector<std::string>& notes) {
  if (const std::string doubt = bags::doubt_of_place(T_body_sensor); !doubt.empty())
    notes.push_back(fmt::format("{}: the sensor is {}", topic, doubt));
}

/// By the odometry's clock (`robot.scan_time_offset_s`), without those that are by another one all the same.
Status take_scans(const OdometryTrack& odometry, const std::string& topic, ScanTrack seen, const RobotConfig& robot,
                  BagRecording& out) {
  const bags::OdometryArrivals arrivals(odometry.arrivals);
  bags::SensorClock clock("robots[].scan_time_offset_s");
  for (std::size_t i = 0; i < seen.items.size(); ++i) {
    ScanPlace place = seen.items[i];
    place.stamp = place.stamp + robot.scan_time_offset_s;
    if (const Status ok = clock.check(place.stamp, arrivals.newest_at(seen.arrivals[i].logged)); ok)
      out.scans.push_back(place);
    else
      seen.refused.add(place.message, ok.error().message);
  }
  out.scan_topic = topic;
  out.refused_scans = seen.refused;
  if (seen.refused.count > 0) out.notes.push_back(note_of(topic, seen.refused, seen.messages));
  if (const std::string doubt = clock.take_doubt(); !doubt.empty())
    out.notes.push_back(fmt::format("{}: {}", topic, doubt));
  if (out.scans.empty()) return fail(ErrorCode::invalid, "{}", note_of(topic, seen.refused, seen.messages));
  const auto inside = [&](const ScanPlace& scan) {
    return odometry.items.front().stamp <= scan.stamp && scan.stamp <= odometry.items.back().stamp;
  };
  if (std::ranges::any_of(out.scans, inside)) return {};
  // A bag whose log times are the stamps does not record when a scan came: then the two's beginnings are compared.
  const double ahead_s = out.scans.front().stamp - odometry.items.front().stamp;
  return fail(ErrorCode::invalid,
              "{}: of its {} stamps, {} to {} ns, none is within the odometry's, {} to {} ns, which begin {:.1f} s "
              "{}: are they by another clock? robots[].scan_time_offset_s aligns them",
              topic, out.scans.size(), out.scans.front().stamp.ns, out.scans.back().stamp.ns,
              odometry.items.front().stamp.ns, odometry.items.back().stamp.ns, std::abs(ahead_s),
              ahead_s > 0.0 ? "earlier" : "later");
}

/// Notes what was left out of the odometry or changed in it, and why.
void note_odometry(const std::string& topic, const OdometryTrack& track, std::vector<std::string>& notes) {
  if (track.refused.count > 0) notes.push_back(note_of(topic, track.refused, track.messages));
  if (track.scaled > 0)
    notes.push_back(fmt::format("{}: {} of {} orientations are not of norm 1 within 0.001, and were normalised", topic,
                                track.scaled, track.messages));
  if (track.late > 0)
    notes.push_back(fmt::format("{}: {} of {} messages came behind newer ones, and are sorted in", topic, track.late,
                                track.messages));
  if (!track.restarts.empty()) notes.push_back(fmt::format("{}: {}", topic, track.restarts));
}

}  // namespace

Result<BagRecording> read_bag(const fs::path& data, const RobotConfig& robot, bool with_images) {
  BagRecording out;
  out.file = (data / robot.bag).string();
  const auto reader = bags::open_bag(out.file);
  if (!reader) return tl::unexpected(reader.error());
  BagIndex index = index_bag(**reader, robot.topics.odometry, with_images);
  keep_robot(index, robot);
  if (const Refusals& bad = index.bad_records; bad.count > 0)
    out.notes.push_back(
        fmt::format("{} records, chunks or files could not be read, the first: {}", bad.count, bad.first));
  const auto odometry = choose_odometry(index, robot);
  if (!odometry) return in_context(out.file, odometry.error());
  order_sensors(index, (*odometry)->second);
  out.notes.insert(out.notes.begin(), index.notes.begin(), index.notes.end());
  OdometryTrack track = (*odometry)->second;
  const std::string source = (*odometry)->first;
  const auto usable = of_the_sensor(index, track, out.notes);
  const auto scans = choose(robot.topics.scans.empty() ? usable : index.scans, robot.topics.scans, "scans", robot);
  if (!scans) return in_context(out.file, scans.error());
  if (*scans != nullptr)
    find_body(index, (*scans)->second.frame, track, out.notes);
  else if (const auto frame = frame_of_images(index))
    find_body(index, *frame, track, out.notes);
  out.odometry = track.items;
  std::string what = fmt::format("{}: odometry of {} ({})", out.file, source, in_words(track));
  note_odometry(source, track, out.notes);
  if (auto ok = take_antennas(index, track, robot, out); !ok) return in_context(out.file, ok.error());
  if (with_images) take_cameras(index, track.body, robot, out);
  if (*scans == nullptr) {
    if (robot.topics.scans.empty() && index.scans.empty())
      what += ", no scans (sensor_msgs/PointCloud2, or CustomMsg of a Livox)" + index.near_scans;
    if (!index.scans.empty()) what += fmt::format(", no scans: {}", list_of(index.scans));
    out.notes.insert(out.notes.begin(), what);
    out.warnings = much_left_out(index, {source, track}, out, robot);
    return out;
  }
  const auto& [topic, seen] = **scans;
  std::string where;
  const auto T_body_lidar = find_lidar(index, track, seen.frame, robot, where);
  if (!T_body_lidar) return in_context(out.file, T_body_lidar.error());
  out.T_body_lidar = *T_body_lidar;
  if (auto ok = take_scans(track, topic, seen, robot, out); !ok) return in_context(out.file, ok.error());
  doubt_place(topic, out.T_body_lidar, out.notes);
  if (robot.scan_time_offset_s != 0.0) where += fmt::format("; {:g} s added to their stamps", robot.scan_time_offset_s);
  out.notes.insert(out.notes.begin(), fmt::format("{}, scans of {} ({}); {}", what, topic, in_words(seen), where));
  out.warnings = much_left_out(index, {source, track}, out, robot);
  return out;
}

}  // namespace tutti::mission
