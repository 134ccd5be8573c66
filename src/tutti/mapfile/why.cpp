// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/why.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include "tutti/node/refused_rows.hpp"
#include "tutti/server/map_components.hpp"

namespace tutti::mapfile {
namespace {

using enum RefusalReason;

/// In the order in which a pair passes them: what is stopped later was nearer to a closure.
constexpr std::array kStages{unverified,        too_small,         too_few_keyframes,
                             too_short,         no_images,         descriptor_kinds,
                             too_few_landmarks, unlike_from_above, no_alignment,
                             too_few_matches,   too_few_inliers,   ambiguous,
                             overlap,           plane_rmse,        misfit,
                             free_to_slide,     viewpoints,        both_ways_distance,
                             both_ways_angle,   contradicted,      ambiguous_along,
                             landmark_residual, position_sigma,    image_spread,
                             inconsistent};

std::ptrdiff_t stage_of(RefusalReason reason) { return std::ranges::find(kStages, reason) - kStages.begin(); }

/// By how many times the limit was missed; 0: nothing was measured.
double missed_by(const Refusal& refusal) {
  if (!is_measured(refusal) || refusal.limit == 0.0 || refusal.value == 0.0) return 0.0;
  return std::abs(std::log(std::abs(refusal.value / refusal.limit)));
}

std::optional<RobotId> robot_called(const Content& content, const std::string& name) {
  for (const auto& [robot, own] : content.names)
    if (own == name) return robot;
  for (const auto& [id, submap] : content.submaps)
    if (std::to_string(id.chain.robot.value) == name) return id.chain.robot;
  return std::nullopt;
}

NearMiss miss_of(const server::ClosureNames& names, const SubmapPair& pair, const Refusal& refusal,
                 std::string reason) {
  return {pair, names.of(pair), refusal, std::move(reason), hint_for(refusal.reason)};
}

std::string sentence_of(const WhyNotJoined& why, const std::string& robot, const std::string& other) {
  if (why.is_joined)
    return fmt::format("{} and {} are merged: {} pairs of their submaps have closures in the map", robot, other,
                       why.accepted);
  if (why.compared == 0)
    return fmt::format(
        "{} and {} are not merged: none of their submaps were compared, not yet or because others look more alike from "
        "above (server.candidates_per_submap)",
        robot, other);
  if (why.nearest.empty())
    return fmt::format("{} and {} are not merged: of {} pairs of submaps none came near", robot, other, why.compared);
  return fmt::format("{} and {} are not merged: of {} pairs of submaps the nearest is {}, stopped by: {}", robot, other,
                     why.compared, why.nearest.front().name, why.nearest.front().reason);
}

}  // namespace

std::string hint_for(RefusalReason reason) {
  switch (reason) {
    case too_small:
    case too_few_keyframes:
    case too_short:
      return "longer submaps: the robot hardly moved, or its sensor saw hardly anything";
    case overlap:
    case viewpoints:
      return "drive one of them nearer to where the other was";
    case unlike_from_above:
    case no_alignment:
      return "most likely these are different places; let the two meet where both see the same walls";
    case plane_rmse:
    case misfit:
    case both_ways_distance:
    case both_ways_angle:
      return "clouds are bent or the sensor's extrinsics differ: look at odometry within the submaps";
    case free_to_slide:
    case ambiguous:
    case ambiguous_along:
      return "a place that looks the same all along: go on to a crossing, a niche, a door";
    case contradicted:
      return "one saw through what the other saw: another place, or something has moved";
    case no_images:
    case too_few_landmarks:
    case too_few_matches:
    case too_few_inliers:
    case image_spread:
    case position_sigma:
      return "more light, or the same way round: images of one place from one direction match best";
    case landmark_residual:
      return "calibrate the camera again";
    case descriptor_kinds:
      return "the two robots' images have different descriptors: use one setting for both";
    case unverified:
      return "see the worker's log: it could not compute this pair";
    case inconsistent:
      return "the map contradicts it: look at it, and accept it if it is right";
    default:
      return "look at both clouds";
  }
}

Result<WhyNotJoined> why_not_joined(const storage::TableStore& store, const Content& content,
                                    const server::MapEstimate& map, const std::string& robot, const std::string& other,
                                    std::size_t most) {
  const auto first = robot_called(content, robot), second = robot_called(content, other);
  for (const auto& [name, found] : {std::pair(robot, first), std::pair(other, second)})
    if (!found) return fail(ErrorCode::invalid, "the map has no robot '{}'", plain_text(name));
  if (first == second) return fail(ErrorCode::invalid, "{} and {}: expected two robots", robot, other);
  const server::ClosureNames names = content.closure_names();
  const server::MapComponents components = server::choose_components(map);
  WhyNotJoined out;
  std::vector<NearMiss> all;
  const auto read = node::read_refusals(store, *first, *second, [&](const SubmapPair& pair, const Refusal& refusal) {
    ++out.compared;
    ++out.stopped_by[kind_of(refusal.reason).words];
    all.push_back(miss_of(names, pair, refusal, to_string(refusal)));
  });
  if (!read) return tl::unexpected(read.error());
  for (const ClosureInfo& info : closures(content, map)) {
    const auto robots = std::minmax(info.pair.first.chain.robot, info.pair.second.chain.robot);
    if (robots != std::minmax(*first, *second)) continue;
    ++out.compared;
    if (info.state == ClosureState::accepted) {
      ++out.accepted;
      continue;
    }
    ++out.stopped_by[kind_of(inconsistent).words];
    all.push_back(miss_of(names, info.pair, {inconsistent, 0.0, 0.0}, info.reason));
  }
  const auto component = [&](RobotId of) {
    const auto found = components.of_robot.find(of);
    return found == components.of_robot.end() ? std::nullopt : std::optional(found->second);
  };
  out.is_joined = component(*first) && component(*first) == component(*second);
  std::ranges::stable_sort(
      all, {}, [](const NearMiss& miss) { return std::pair(-stage_of(miss.refusal.reason), missed_by(miss.refusal)); });
  all.resize(std::min(all.size(), most));
  out.nearest = std::move(all);
  out.sentence = sentence_of(out, robot, other);
  return out;
}

}  // namespace tutti::mapfile
