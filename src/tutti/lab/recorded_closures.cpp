// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/lab/recorded_closures.hpp"

#include <algorithm>
#include <map>
#include <string>
#include <utility>

namespace tutti::lab {
namespace {

/// The keyframe of this stamp that counts for this submap; null: none.
const Keyframe* recorded_keyframe(const Submap& submap, RobotId robot, Timestamp stamp) {
  const auto& keyframes = submap.keyframes;
  if (submap.id.chain.robot != robot) return nullptr;
  const auto found = std::ranges::lower_bound(keyframes, stamp, {}, &Keyframe::stamp);
  if (found == keyframes.end() || found->stamp != stamp) return nullptr;
  return found == keyframes.begin() && submap.id.index > 0 ? nullptr : &*found;
}

}  // namespace

RecordedClosureVerifier::RecordedClosureVerifier(const std::vector<mission::MissionRecording>& recordings) {
  std::map<std::pair<std::string, std::string>, RobotId> robots;
  for (const mission::MissionRecording& recording : recordings)
    robots[{recording.graph, recording.graph_robot}] = recording.recording.robot;
  for (const mission::MissionRecording& recording : recordings)
    for (const mission::RecordedClosure& closure : recording.closures) {
      const auto other = robots.find({recording.graph, closure.from});
      if (other == robots.end()) continue;  // a robot that the mission leaves out
      Recorded recorded{.from = {other->second, closure.from_stamp},
                        .to = {recording.recording.robot, closure.to_stamp},
                        .measurement = closure.measurement,
                        .known_at = std::max({closure.arrived, closure.from_stamp, closure.to_stamp})};
      if (recorded.to < recorded.from) {
        std::swap(recorded.from, recorded.to);
        recorded.measurement = inverse(recorded.measurement);
      }
      closures_.push_back(std::move(recorded));
    }
  std::ranges::stable_sort(closures_, {}, &Recorded::from);
}

std::vector<const RecordedClosureVerifier::Recorded*> RecordedClosureVerifier::between(const Submap& first,
                                                                                       const Submap& second) const {
  const RobotId robot = first.id.chain.robot;
  const auto begin =
      std::ranges::lower_bound(closures_, End{robot, first.keyframes.front().stamp}, {}, &Recorded::from);
  const auto end = std::ranges::upper_bound(closures_, End{robot, first.keyframes.back().stamp}, {}, &Recorded::from);
  std::vector<const Recorded*> out;
  for (auto closure = begin; closure < end; ++closure)
    if (recorded_keyframe(first, robot, closure->from.stamp) != nullptr &&
        recorded_keyframe(second, closure->to.robot, closure->to.stamp) != nullptr)
      out.push_back(&*closure);
  std::ranges::stable_sort(out, {}, &Recorded::known_at);
  return out;
}

bool RecordedClosureVerifier::is_candidate(const Submap& first, const Submap& second) const {
  return !between(first, second).empty();
}

Result<ClosureVerdict> RecordedClosureVerifier::verify(const Submap& first, const Submap& second,
                                                       const server::PayloadStore& /*payloads*/) const {
  ClosureVerdict verdict{.pair = {first.id, second.id}, .closures = {}, .refusal = {}, .verifier = id()};
  for (const Recorded* closure : between(first, second)) {
    const Keyframe* from = recorded_keyframe(first, closure->from.robot, closure->from.stamp);
    const Keyframe* to = recorded_keyframe(second, closure->to.robot, closure->to.stamp);
    verdict.closures.push_back({{first.id.chain, from->index}, {second.id.chain, to->index}, closure->measurement});
  }
  if (verdict.closures.empty()) verdict.refusal = Refusal{};
  return verdict;
}

std::vector<Timestamp> RecordedClosureVerifier::known_at(const Submap& first, const Submap& second) const {
  std::vector<Timestamp> out;
  for (const Recorded* closure : between(first, second)) out.push_back(closure->known_at);
  return out;
}

}  // namespace tutti::lab
