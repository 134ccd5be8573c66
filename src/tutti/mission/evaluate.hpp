// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <vector>

#include "tutti/evaluation/association.hpp"
#include "tutti/mission/mission_config.hpp"
#include "tutti/mission/record.hpp"
#include "tutti/mission/recordings.hpp"
#include "tutti/robot/agent.hpp"
#include "tutti/server/map_server.hpp"

namespace tutti::mission {

inline constexpr double kRpeInterval_s = 1.0;
inline constexpr double kRpeWay_m = 10.0;  ///< Along the reference.

/// One robot after a mission: the agent that talked to the server and the shadow agents that only listened.
struct RobotOutcome {
  const MissionRecording* recording = nullptr;
  std::string default_policy;
  std::vector<std::pair<std::string, const robot::RobotAgent*>> agents;  ///< By policy; the default one is among them.
  std::size_t replayed = 0;  ///< Odometry poses of the recording, from the first; a mission may end before the rest.

  [[nodiscard]] std::span<const StampedPose> way() const { return {recording->recording.odometry.data(), replayed}; }
};

/// Fill in what is measured at the end, in this order: accuracy of every estimate; the final map, its closures and the
/// transforms between robots; the clouds. Accuracy: ATE after one rigid alignment (SE(3), no scale), RPE over 1 s and
/// over 10 m, at keyframes, each beside the share of the way it was scored on; kink of every correction; the server's
/// joint figure over all robots of its largest component with one alignment. Agreement: ATE of a robot's estimate with
/// the server's in the role of the reference.
/// Robots whose reference is not for scoring get no accuracy. `perfect`: the map of perfect_judge.hpp, or null.
void evaluate_robots(const std::vector<RobotOutcome>& robots, const server::MapEstimate& map,
                     const server::MapEstimate* perfect, const evaluation::AssociationConfig& association,
                     MissionRecord& record);
/// Accepted closures against the reference poses of their ends; nothing where none can be checked.
std::optional<ClosureCheckRecord> check_closures(const server::MapEstimate& map,
                                                 const std::vector<const MissionRecording*>& robots,
                                                 const evaluation::AssociationConfig& association,
                                                 const ClosureCheckConfig& config);
/// Calls evaluate_map() at the end.
void evaluate_server(const std::vector<RobotOutcome>& robots, const server::MapServer& server,
                     const evaluation::AssociationConfig& association, const ClosureCheckConfig& check,
                     MissionRecord& record);
/// What came of the robots' images, and a note of each.
void evaluate_images(const server::MapServer& server, MissionRecord& record);
/// What the robots saw, put together by every estimate, thinned; and, where record.survey is there, how far it is from
/// that.
void evaluate_map(const server::MapServer& server, const evaluation::AssociationConfig& association,
                  MissionRecord& record);

}  // namespace tutti::mission
