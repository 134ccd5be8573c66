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
inline constexpr double kRpeDistance_m = 10.0;  ///< Along the reference.

/// One robot after a mission: the agent that talked to the server, and the shadow agents that only listened.
struct RobotOutcome {
  const MissionRecording* recording = nullptr;
  std::string default_policy;
  std::vector<std::pair<std::string, const robot::RobotAgent*>> agents;  ///< By policy, including the default one.
  std::size_t replayed = 0;  ///< Odometry poses that were replayed, from the first; a mission may end before the last.

  [[nodiscard]] std::span<const StampedPose> way() const { return {recording->recording.odometry.data(), replayed}; }
};

/// Fills in how far every estimate is from the reference at the nodes of `map`, the server's estimate of the robot's
/// trajectory, when the robot has taken an update of it.
void score_update(const RobotOutcome& robot, const Trajectory& map, const evaluation::AssociationConfig& association,
                  UpdateRecord& update);

/// These functions fill in what is measured at the end, in this order: the accuracy of every estimate; the final map,
/// its closures and the transforms between robots; the clouds. Accuracy is the ATE after one rigid alignment (SE(3), no
/// scale) and the RPE over 1 s and over 10 m, at keyframes, each with the share of the distance on which it was scored;
/// the discontinuity of every correction; and the server's joint accuracy over all robots of its largest component,
/// with one alignment. Agreement is the ATE of a robot's estimate with the server's as the reference. Robots whose
/// reference is not for scoring get no accuracy. `perfect` is the map of perfect_judge.hpp, or null.
void evaluate_robots(const std::vector<RobotOutcome>& robots, const server::MapEstimate& map,
                     const server::MapEstimate* perfect, const evaluation::AssociationConfig& association,
                     MissionRecord& record);
/// Checks accepted closures against the reference poses of their ends; nothing when none can be checked.
std::optional<ClosureCheckRecord> check_closures(const server::MapEstimate& map,
                                                 const std::vector<const MissionRecording*>& robots,
                                                 const evaluation::AssociationConfig& association,
                                                 const ClosureCheckConfig& config);
/// Fills in everything about the server; calls evaluate_map() at the end.
void evaluate_server(const std::vector<RobotOutcome>& robots, const server::MapServer& server,
                     const evaluation::AssociationConfig& association, const ClosureCheckConfig& check,
                     MissionRecord& record);
/// Fills in what became of fixes, with notes on them.
void evaluate_fixes(const server::MapEstimate& map, const std::string& mode, MissionRecord& record);
/// Fills in what became of the robots' images, with a note on each robot.
void evaluate_images(const server::MapServer& server, MissionRecord& record);
/// Fills in the clouds of what the robots saw, by every estimate, thinned; and their distance to record.survey where
/// there is one.
void evaluate_map(const server::MapServer& server, const evaluation::AssociationConfig& association,
                  MissionRecord& record);

}  // namespace tutti::mission
