// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/bag_left_out.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <utility>

#include "tutti/robot/submap_builder.hpp"

namespace tutti::mission {
namespace {

using Stamps = std::vector<Timestamp>;

constexpr double kMuchLeftOut = 0.1;  // share of a recording that is worth a warning

double share_of(double part, double whole) { return whole > 0.0 ? part / whole : 0.0; }
double share_of(std::size_t part, std::uint64_t whole) {
  return share_of(static_cast<double>(part), static_cast<double>(whole));
}
std::string percent(double share) { return fmt::format("{:.0f} %", 100.0 * share); }

/// Stamps for which no odometry says where the robot was.
struct Uncovered {
  std::size_t before = 0, after = 0, between = 0;
  [[nodiscard]] std::size_t all() const { return before + after + between; }
};
Uncovered uncovered(const Trajectory& odometry, const Stamps& stamps) {
  Uncovered out;
  for (const Timestamp stamp : stamps) {
    const auto next = std::ranges::lower_bound(odometry, stamp, {}, &StampedPose::stamp);
    if (next == odometry.end())
      ++out.after;
    else if (next == odometry.begin())
      out.before += next->stamp == stamp ? 0 : 1;
    else if (next->stamp != stamp && next->stamp - std::prev(next)->stamp > robot::SubmapBuilder::kLongestGap_s)
      ++out.between;
  }
  return out;
}

/// Other odometry of the bag that covers more of the stamps than what was taken: what to type; else nothing.
std::string better_odometry(const BagIndex& index, const Stamps& stamps, std::size_t missed, const RobotConfig& robot) {
  std::string best;
  for (const auto* tracks : {&index.odometry, &index.transforms, &index.poses})
    for (const auto& [topic, track] : *tracks) {
      if (track.items.size() < 2) continue;
      const std::size_t misses = uncovered(track.items, stamps).all();
      if (share_of(missed, stamps.size()) - share_of(misses, stamps.size()) < kMuchLeftOut) continue;
      missed = misses;
      best = fmt::format("--topic '{}.odometry={}' covers {}", robot.name, topic,
                         percent(1.0 - share_of(misses, stamps.size())));
    }
  return best;
}

/// One sensor's messages.
struct Sensor {
  const char* what;    ///< "scans"
  const char* offset;  ///< The setting that shifts its stamps.
  std::string topic;
  std::uint64_t messages = 0;  ///< All that the bag has of the topic.
  const Refusals& refused;
  Stamps stamps;  ///< Those that can be used where odometry is.
};

void warn_of_sensor(const BagIndex& index, const TakenOdometry& odometry, const Sensor& sensor,
                    const RobotConfig& robot, std::vector<std::string>& out) {
  const Uncovered missed = uncovered(odometry.track.items, sensor.stamps);
  const std::uint64_t usable = sensor.stamps.size() + sensor.refused.count;
  const std::uint64_t elsewhere = sensor.messages > usable ? sensor.messages - usable : 0;
  const std::size_t all = missed.all() + sensor.refused.count + elsewhere;
  if (share_of(all, sensor.messages) <= kMuchLeftOut) return;
  std::vector<std::string> why, type;
  const auto because = [&](std::uint64_t count, const std::string& reason) {
    if (count > 0) why.push_back(fmt::format("{} {}", count, reason));
  };
  because(missed.before, fmt::format("before the odometry of {} begins", odometry.topic));
  because(missed.after, "after it ends");
  because(missed.between, fmt::format("in its gaps of more than {:g} s", robot::SubmapBuilder::kLongestGap_s));
  because(elsewhere, "recorded with odometry that is left out");
  because(sensor.refused.count, fmt::format("refused, the first because: {}", sensor.refused.first));
  if (missed.all() > 0) {
    const std::string better = better_odometry(index, sensor.stamps, missed.all(), robot);
    type.push_back(!better.empty() ? better
                                   : fmt::format("record while odometry is there, or, if its clock is another one: "
                                                 "--set robots.{}.{}=SECONDS",
                                                 robot.name, sensor.offset));
  }
  out.push_back(fmt::format("{} of the {} of {} ({} of {}) are left out: {}{}{}",
                            percent(share_of(all, sensor.messages)), sensor.what, sensor.topic, all, sensor.messages,
                            fmt::join(why, ", "), type.empty() ? "" : "; ", fmt::join(type, "; ")));
}

/// The command to type if the files of a folder are of a robot each; empty for one file.
std::string robots_in(const std::string& folder) {
  std::vector<std::string> files;
  std::error_code failure;
  for (const auto& entry : std::filesystem::directory_iterator(folder, failure))
    if (entry.path().filename() != "metadata.yaml") files.push_back(entry.path().string());
  std::ranges::sort(files);
  return files.size() < 2 ? "" : fmt::format("if its files are of a robot each: tutti run {}", fmt::join(files, " "));
}

/// The command that makes bags of the parts before and after the one that is used.
std::string cut(const OdometryTrack& track, const std::string& file) {
  if (const std::string robots = robots_in(file); !robots.empty()) return robots;
  const auto [from, to] = std::ranges::minmax(track.arrivals, {}, &bags::Arrival::logged);
  constexpr double kSecond_ns = 1e9;
  const auto seconds = [](Timestamp stamp, double (*round)(double)) {
    return static_cast<std::int64_t>(round(static_cast<double>(stamp.ns) / kSecond_ns));
  };
  return fmt::format(
      "to use what is before or after, make bags of these, each a robot of its own: mcap filter {0} -o "
      "before.mcap --end-secs {1}, mcap filter {0} -o after.mcap --start-secs {2}",
      file, seconds(from.logged, &std::floor), seconds(to.logged, &std::ceil));
}

void warn_of_odometry(const TakenOdometry& odometry, const BagRecording& bag, std::vector<std::string>& out) {
  const OdometryTrack& track = odometry.track;
  const std::uint64_t left_out = track.messages - std::min<std::uint64_t>(track.messages, track.items.size());
  if (share_of(left_out, track.messages) <= kMuchLeftOut) return;
  std::vector<std::string> why;
  if (track.refused.count > 0)
    why.push_back(fmt::format("{} refused, the first because: {}", track.refused.count, track.refused.first));
  if (!track.restarts.empty()) why.push_back(fmt::format("{}; {}", track.restarts, cut(track, bag.file)));
  out.push_back(fmt::format("{} of the odometry of {} ({} of {} poses) is left out: {}",
                            percent(share_of(left_out, track.messages)), odometry.topic, left_out, track.messages,
                            fmt::join(why, "; ")));
}

/// Times of the odometry for which no sensor saw anything.
struct Blind {
  double all_s = 0.0, begin_s = 0.0, end_s = 0.0;  ///< In all, before the first stamp and after the last.
};
Blind blind_times(const Trajectory& odometry, const Stamps& stamps) {
  constexpr double kSilence_s = 5.0;  // a shorter pause keeps no submap from having scans or images
  Blind out;
  Timestamp last = odometry.front().stamp;
  const auto pause_to = [&](Timestamp next) {
    const double pause_s = next - last;
    last = std::max(last, next);
    if (pause_s <= kSilence_s) return 0.0;
    out.all_s += pause_s;
    return pause_s;
  };
  bool is_first = true;
  for (const Timestamp stamp : stamps) {
    if (stamp > odometry.back().stamp) break;
    const double pause_s = pause_to(stamp);
    if (std::exchange(is_first, false)) out.begin_s = pause_s;
  }
  out.end_s = pause_to(odometry.back().stamp);
  return out;
}

Stamps stamps_of(const std::vector<ScanPlace>& places) {
  Stamps out;
  for (const ScanPlace& place : places) out.push_back(place.stamp);
  return out;
}

void warn_of_blind(const BagIndex& index, const Trajectory& odometry, const std::vector<Sensor>& sensors,
                   const RobotConfig& robot, std::vector<std::string>& out) {
  if (sensors.empty()) return;
  Stamps seen;
  std::vector<std::string> topics;
  for (const Sensor& sensor : sensors) {
    seen.insert(seen.end(), sensor.stamps.begin(), sensor.stamps.end());
    topics.push_back(fmt::format("the {} of {}", sensor.what, sensor.topic));
  }
  std::ranges::sort(seen);
  const double duration_s = odometry.back().stamp - odometry.front().stamp;
  const Blind blind = blind_times(odometry, seen);
  if (share_of(blind.all_s, duration_s) <= kMuchLeftOut) return;
  std::string type = "let the sensor's driver run as long as odometry does";
  double best_s = blind.all_s - kMuchLeftOut * duration_s;
  for (const auto& [topic, track] : index.scans) {
    const double other_s = blind_times(odometry, stamps_of(track.items)).all_s;
    if (other_s >= best_s || track.items.empty()) continue;
    best_s = other_s;
    type = fmt::format("--topic {}.scans={} leaves {}", robot.name, topic, percent(share_of(other_s, duration_s)));
  }
  out.push_back(
      fmt::format("no closure is found in {} of the odometry's time ({:.1f} of {:.1f} s), as {} are not there: {:.1f} "
                  "s before they "
                  "begin, {:.1f} s after they end, {:.1f} s in their pauses; {}",
                  percent(share_of(blind.all_s, duration_s)), blind.all_s, duration_s, fmt::join(topics, " and "),
                  blind.begin_s, blind.end_s, blind.all_s - blind.begin_s - blind.end_s, type));
}

void warn_of_antennas(const char* what, const std::map<std::string, AntennaTrack>& tracks,
                      std::vector<std::string>& out) {
  for (const auto& [topic, track] : tracks)
    if (share_of(track.refused.count, track.messages) > kMuchLeftOut)
      out.push_back(fmt::format("{} of the {} of {} ({} of {}) are refused, the first because: {}",
                                percent(share_of(track.refused.count, track.messages)), what, topic,
                                track.refused.count, track.messages, track.refused.first));
}

}  // namespace

std::vector<std::string> much_left_out(const BagIndex& index, const TakenOdometry& odometry, const BagRecording& bag,
                                       const RobotConfig& robot) {
  std::vector<std::string> out;
  warn_of_odometry(odometry, bag, out);
  std::vector<Sensor> sensors;
  if (!bag.scans.empty()) {
    const ScanTrack& track = index.scans.at(bag.scan_topic);
    sensors.push_back(
        {"scans", "scan_time_offset_s", bag.scan_topic, track.messages, bag.refused_scans, stamps_of(bag.scans)});
  }
  if (!bag.cameras.empty()) {
    const BagCamera& camera = bag.cameras.front();
    const ImageTrack& track = index.images.at(camera.topic);
    sensors.push_back(
        {"images", "images.time_offset_s", camera.topic, track.messages, track.refused, stamps_of(camera.images)});
    for (Timestamp& stamp : sensors.back().stamps) stamp = stamp + robot.images.time_offset_s;
  }
  for (const Sensor& sensor : sensors) warn_of_sensor(index, odometry, sensor, robot, out);
  warn_of_blind(index, bag.odometry, sensors, robot, out);
  warn_of_antennas("fixes", index.fixes, out);
  warn_of_antennas("ranges", index.ranges, out);
  return out;
}

}  // namespace tutti::mission
