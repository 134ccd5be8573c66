// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/record_notes.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "tutti/geometry/so3.hpp"
#include "tutti/mission/misfit_record.hpp"
#include "tutti/server/map_components.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::mission {
namespace {

/// Why no closure ties anything; the map has none.
std::string why_odometry_alone(const std::vector<RejectionRecord>& rejections) {
  const auto pairs = [](const RejectionRecord& rejection) { return rejection.intra + rejection.inter; };
  if (rejections.empty()) return "no two submaps were compared";
  std::size_t refused = 0;
  for (const RejectionRecord& rejection : rejections) {
    if (rejection.reason == RefusalReason::inconsistent) return "the closures found contradict each other";
    refused += pairs(rejection);
  }
  const RejectionRecord& most = *std::ranges::max_element(rejections, {}, pairs);
  return fmt::format("all {} pairs of submaps that were compared were refused, {} because: {}", refused,
                     pairs(most) == refused ? "all" : std::to_string(pairs(most)), to_string(most.nearest));
}

/// By its id, which need not be its place in the record.
std::string name_of(RobotId id, const MissionRecord& record) {
  const auto robot = std::ranges::find(record.robots, id, &RobotRecord::id);
  return robot == record.robots.end() ? fmt::format("robot {}", id.value) : robot->name;
}

std::string names_of(const std::pair<RobotId, RobotId>& robots, const MissionRecord& record) {
  const std::string one = name_of(robots.first, record);
  return robots.first == robots.second ? one + " with itself"
                                       : fmt::format("{} with {}", one, name_of(robots.second, record));
}

/// Between two robots, or one and itself, this share of closures and this many are more than wrong ones would be.
constexpr double kManyInconsistent = 0.4;
constexpr std::size_t kEnoughInconsistent = 8;

void note_understated_closures(const server::MapEstimate& map, MissionRecord& record) {
  for (const auto& [chains, factor] : map.closure_factors)
    record.notes.push_back(fmt::format(
        "{}: closures err {:.1f} times as much as they say in rotation and {:.1f} times in position, by their "
        "neighbours; the map counts them so (stamps of a sensor that are late do this, or a verifier that is too sure)",
        names_of({chains.first.robot, chains.second.robot}, record), std::sqrt(factor.rotation),
        std::sqrt(factor.translation)));
}

void note_inconsistent_closures(const server::MapEstimate& map, MissionRecord& record) {
  struct Count {
    std::size_t refused = 0, all = 0;
  };
  std::map<std::pair<RobotId, RobotId>, Count> between;
  for (const server::JudgedClosure& judged : map.closures) {
    if (judged.by_operator) continue;
    Count& count = between[std::minmax({judged.closure.from.chain.robot, judged.closure.to.chain.robot})];
    ++count.all;
    if (!judged.accepted) ++count.refused;
  }
  for (const auto& [robots, count] : between) {
    if (count.refused < kEnoughInconsistent ||
        static_cast<double>(count.refused) < kManyInconsistent * static_cast<double>(count.all))
      continue;
    record.notes.push_back(fmt::format(
        "{}: {} of {} closures contradict the map and are not in it; so many are seldom all wrong: odometry may be "
        "worse than its covariance says, or have failed where nothing tells",
        names_of(robots, record), count.refused, count.all));
  }
}

void note_ranges(const server::MapEstimate& map, MissionRecord& record) {
  std::map<RobotId, std::size_t> to_strangers;  // a robot may name any number
  for (const server::JudgedRanges& judged : map.ranges.judged) {
    if (std::ranges::find(record.robots, judged.to, &RobotRecord::id) == record.robots.end()) {
      to_strangers[judged.from.robot] += judged.ranges;
      continue;
    }
    const std::size_t placed = judged.ranges - judged.unplaced;
    std::string note = fmt::format("{} to {}: {} of {} ranges count", name_of(judged.from.robot, record),
                                   name_of(judged.to, record), judged.used, judged.ranges);
    if (judged.unplaced > 0)
      note += fmt::format("; for {} the map does not have both robots at that time and in one part", judged.unplaced);
    if (judged.objection != server::RangeObjection::none)
      note += fmt::format("; none of the other {} is used: {}", placed, server::why_none(judged));
    else if (placed > judged.used)
      note += fmt::format("; {} contradict the map", placed - judged.used);
    record.notes.push_back(std::move(note));
  }
  for (const auto& [robot, count] : to_strangers)
    record.notes.push_back(
        fmt::format("{}: {} ranges are to robots that the mission does not have", name_of(robot, record), count));
}

/// Why robots that closures would join are in maps of their own.
void note_separate_maps(const server::MapEstimate& map, MissionRecord& record) {
  const auto component = server::choose_components(map).of_robot;
  std::map<std::pair<RobotId, RobotId>, std::map<std::string, std::size_t>> refused;  // by reason
  for (const server::JudgedClosure& judged : map.closures) {
    const auto robots = std::minmax({judged.closure.from.chain.robot, judged.closure.to.chain.robot});
    if (!judged.accepted && component.contains(robots.first) && component.contains(robots.second) &&
        component.at(robots.first) != component.at(robots.second))
      ++refused[robots][judge::to_string(judged.objection)];
  }
  for (const auto& [robots, reasons] : refused) {
    std::vector<std::string> counts;
    for (const auto& [reason, count] : reasons) counts.push_back(fmt::format("{} ({})", reason, count));
    record.notes.push_back(fmt::format("{} and {}: two maps, because every closure between them is refused: {}",
                                       name_of(robots.first, record), name_of(robots.second, record),
                                       fmt::join(counts, "; ")));
  }
}

/// Up by the robot's odometry, in the world of its component, as the map lies on its keyframes; nothing without a map.
std::optional<Eigen::Vector3d> up_of(const RobotRecord& robot) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const StampedPose& mapped : robot.server_estimate) {
    const auto raw = std::ranges::lower_bound(robot.odometry, mapped.stamp, {}, &StampedPose::stamp);
    if (raw == robot.odometry.end() || raw->stamp != mapped.stamp) continue;
    sum += mapped.pose.rotation * raw->pose.rotation.conjugate() * Eigen::Vector3d::UnitZ();
  }
  return sum.norm() > 0.0 ? std::optional<Eigen::Vector3d>(sum.normalized()) : std::nullopt;
}

/// Robots of one map whose odometry frames are not level with each other: heights and grids of that map are wrong.
void warn_of_up(const MissionRecord& record, std::vector<std::string>& out) {
  constexpr double kMost_deg = 30.0;
  std::vector<std::optional<Eigen::Vector3d>> ups;
  for (const RobotRecord& robot : record.robots) {
    const auto up = ups.emplace_back(up_of(robot));
    for (std::size_t k = 0; up && k + 1 < ups.size(); ++k) {
      const RobotRecord& before = record.robots[k];
      if (before.component != robot.component || !ups[k]) continue;
      const double angle_deg = std::acos(std::clamp(up->dot(*ups[k]), -1.0, 1.0)) / kRadPerDeg;
      if (angle_deg < kMost_deg) continue;
      out.push_back(
          fmt::format("{}'s up is {} by the closures between them ({:.0f} degrees apart): z of odometry's "
                      "frame points up (docs/frames.md), which one of the two does not do, and the grid "
                      "takes the ceiling for the ground",
                      before.name, angle_deg > 90.0 ? robot.name + "'s down" : "not " + robot.name + "'s", angle_deg));
      break;
    }
  }
}

}  // namespace

std::vector<std::string> warnings_of(const MissionRecord& record) {
  std::vector<std::string> out;
  std::size_t submaps = 0;
  for (const RobotRecord& robot : record.robots)
    for (const MisfitRecord& misfit : robot.misfits) out.push_back(warning_of(robot.name, misfit));
  for (const RobotRecord& robot : record.robots)
    if (!robot.unused_images.empty())
      out.push_back(fmt::format("{}: none of its images are used: {}", robot.name, robot.unused_images));
  for (const RobotRecord& robot : record.robots) {
    submaps += robot.submaps;
    if (robot.submaps == 0 && robot.keyframes > 0)
      out.push_back(fmt::format("{}: none of its submaps reached the server", robot.name));
  }
  warn_of_up(record, out);
  const bool tied = !record.server.closures.empty();
  const bool follows_fixes = record.server.fixes && record.server.fixes->georeference;
  if (!tied && submaps > 1 && !follows_fixes)
    out.push_back(fmt::format("the server's map is odometry alone: {}", why_odometry_alone(record.server.rejections)));
  for (const RobotRecord& robot : record.robots)
    if (tied && !robot.server_estimate.empty() && robot.component != record.server.largest_component)
      out.push_back(fmt::format("{}: no closure joins it with the largest map; it lies in a frame of its own{}",
                                robot.name, robot.misfits.empty() ? "" : ". It does not fit itself: mend that first"));
  return out;
}

void note_undelivered(const std::map<bus::SimulatedRadio::Topic, std::size_t>& undelivered, MissionRecord& record) {
  const auto name = [&](const bus::Endpoint& end) { return end.robot() ? name_of(*end.robot(), record) : "server"; };
  for (const auto& [topic, messages] : undelivered) {
    const auto& [from, to, kind] = topic;
    record.notes.push_back(fmt::format("{} to {}: {} x {} never delivered; the link would have taken more than a day",
                                       name(from), name(to), messages, wire::name(kind)));
  }
}

void note_remarks(const server::Refinements& refinements, MissionRecord& record) {
  if (!refinements.has_whole()) return;
  for (const RefinementRemark& remark : refinements.all().begin()->second->remarks)
    record.notes.push_back(fmt::format("{}: {}", name_of(remark.robot, record), remark.text));
}

void note_changes_of_mind(MissionRecord& record) {
  for (const RobotRecord& robot : record.robots) {
    std::vector<ChangeOfMindRecord> changes;
    std::ranges::copy_if(record.server.changes_of_mind, std::back_inserter(changes),
                         [&](const ChangeOfMindRecord& change) { return change.robot == robot.id; });
    if (changes.empty()) continue;
    const auto greatest = std::ranges::max_element(
        changes, {}, [](const ChangeOfMindRecord& change) { return change.change.translation_m; });
    record.notes.push_back(
        fmt::format("{}: the map changed its mind {}, by more than it had allowed for. The greatest change was {:.2f} "
                    "m at {:.0f} s: {}",
                    robot.name, changes.size() == 1 ? "once" : fmt::format("{} times", changes.size()),
                    greatest->change.translation_m, greatest->time_s, greatest->reason));
  }
}

void note_what_the_map_lacks(const server::MapEstimate& map, MissionRecord& record) {
  if (!map.left_out.empty()) {
    const SubmapId first = map.left_out.front();
    record.notes.push_back(fmt::format(
        "{} submaps are not in the map, because they contradict earlier ones of their robot or keep the map from being "
        "solved; the first is {} of {}",
        map.left_out.size(), first.index, name_of(first.chain.robot, record)));
  }
  for (const auto& [chain, factor] : map.understated)
    record.notes.push_back(
        fmt::format("{}: its odometry errs {:.1f} times as much as its covariance says, by the loops it makes; the map "
                    "counts it so",
                    name_of(chain.robot, record), std::sqrt(factor)));
  note_understated_closures(map, record);
  note_inconsistent_closures(map, record);
  note_separate_maps(map, record);
  note_ranges(map, record);
  if (map.spare_pairs > 0)
    record.notes.push_back(
        fmt::format("{} pairs of submaps have closures that the map does not need and that were not judged "
                    "(server.map.most_closed_pairs, server.map.most_pairs_in_all)",
                    map.spare_pairs));
}

}  // namespace tutti::mission
