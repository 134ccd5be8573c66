// SPDX-License-Identifier: BSD-3-Clause
// Position fixes and ranges of a bag.
#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <set>
#include <utility>

#include "tutti/bags/sensor_clock.hpp"
#include "tutti/mission/bag_recording.hpp"

namespace tutti::mission {
namespace {

/// Receivers of which not one message can be used.
void note_no_fixes(const BagIndex& index, std::vector<std::string>& notes) {
  for (const auto& [topic, track] : index.fixes) {
    if (track.refused.count > 0) notes.push_back(note_of(topic, track.refused, track.messages));
    if (track.without > 0)
      notes.push_back(fmt::format("{}: {} of {} messages are without a fix (status -1, or 0 degrees north and 0 east)",
                                  topic, track.without, track.messages));
  }
}

/// Takes one topic's measurements, with where the antenna is on the body, and by odometry's clock, as of a live topic.
/// Returns words for a note: ", of an antenna at ..".
std::string take_antenna(const BagIndex& index, const OdometryTrack& odometry, const RobotConfig& robot,
                         const std::string& topic, AntennaTrack& track, BagRecording& out) {
  constexpr std::size_t kMostPlaces = 4;
  const bags::OdometryArrivals arrivals(odometry.arrivals);
  std::set<std::string> places;  // mostly one
  for (std::size_t i = 0; i < track.items.size(); ++i) {
    bags::AntennaSample& sample = track.items[i];
    const bags::Arrival& arrival = track.arrivals[i];
    if (const Status ok = bags::check_clock(arrival.stamp, arrivals.newest_at(arrival.logged)); !ok) {
      track.refused.add(arrival.message, ok.error().message);
      continue;
    }
    std::string place =
        bags::place_antenna(sample, robot.p_body_antenna(), index.tree.pose(odometry.body, sample.frame));
    if (places.size() < kMostPlaces) places.insert(std::move(place));
    std::visit([&](const auto& of) { out.measured.emplace_back(of); }, sample.measured);
  }
  if (track.refused.count > 0) out.notes.push_back(note_of(topic, track.refused, track.messages));
  std::string how = fmt::format(", of {}", fmt::join(places, " and of "));
  if (track.without > 0) how += fmt::format("; {} messages are without one", track.without);
  if (track.flat > 0) how += fmt::format("; {} have no altitude and count in the plane", track.flat);
  if (track.unsure > 0)
    how += fmt::format("; {} do not say how sure they are, taken as {:g} m and {:g} m up", track.unsure, kUnknownFix_m,
                       kUnknownFixUp_m);
  return how;
}

/// When several topics have fixes, the user has to choose one: mostly all but one are made of that one.
Status choose_fixes(BagIndex& index, const OdometryTrack& odometry, const RobotConfig& robot, BagRecording& out) {
  const std::string& wanted = robot.topics.fixes;
  std::vector<std::string> topics;
  for (const auto& [topic, track] : index.fixes)
    if (wanted.empty() ? !track.items.empty() : topic == wanted) topics.push_back(topic);
  if (topics.empty() && wanted.empty()) {
    note_no_fixes(index, out.notes);
    return {};
  }
  if (topics.empty())
    return fail(ErrorCode::invalid, "topics.fixes: '{}' is not in the bag, or no sensor_msgs/NavSatFix", wanted);
  if (topics.size() > 1) {
    out.notes.push_back(
        fmt::format("no fixes are used: several topics have some, {}; say which: --topic {}.fixes={} (in a mission "
                    "file: robots[].topics.fixes)",
                    fmt::join(topics, ", "), robot.name, topics.front()));
    return {};
  }
  out.fix_topic = topics.front();
  out.fix_note = take_antenna(index, odometry, robot, out.fix_topic, index.fixes.at(out.fix_topic), out);
  return {};
}

}  // namespace

Status take_antennas(BagIndex& index, const OdometryTrack& odometry, const RobotConfig& robot, BagRecording& out) {
  if (Status ok = choose_fixes(index, odometry, robot, out); !ok) return ok;
  for (auto& [topic, track] : index.ranges) {
    const std::size_t before = out.measured.size();
    const std::string how = take_antenna(index, odometry, robot, topic, track, out);
    if (const std::size_t count = out.measured.size() - before; count > 0)
      out.notes.push_back(fmt::format("{} ranges of {}{}", count, topic, how));
  }
  std::ranges::stable_sort(out.measured, {}, stamp_of);
  return {};
}

}  // namespace tutti::mission
