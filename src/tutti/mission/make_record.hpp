// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tutti/bus/simulated_radio.hpp"
#include "tutti/mission/evaluate.hpp"
#include "tutti/mission/mission_config.hpp"
#include "tutti/mission/mission_events.hpp"
#include "tutti/mission/perfect_course.hpp"
#include "tutti/mission/record.hpp"
#include "tutti/node/server_node.hpp"

namespace tutti::mission {

/// One robot whose mission is over.
struct FinishedRobot {
  RobotOutcome outcome;
  std::vector<UpdateRecord> updates;
  std::optional<consistency::Explanation> explanation;  ///< The last update's.
  std::vector<std::string> troubles;
  std::string refused_images;          ///< Why images were refused first; empty when none were.
  std::vector<TrafficRecord> traffic;  ///< bytes_per_s is not set.
  NodeStatus status;
  std::vector<fit::Misfit> misfits;  ///< note_misfit()
};

/// A mission that is over, whichever program ran it. The references must outlive it.
struct FinishedMission {
  const MissionConfig& config;
  std::uint64_t seed = 1;
  std::string version;
  std::string settings_yaml = {};  ///< RunOptions::settings_yaml
  double duration_s = 0.0;
  std::shared_ptr<const PointCloud> survey;
  std::vector<FinishedRobot> robots;  ///< By number, from 0.
  const node::ServerNode& server;
  const MissionEvents& events;
  PerfectCourse perfect = {};  ///< Empty in missions of programs.
  std::map<bus::SimulatedRadio::Topic, std::size_t> undelivered;
};

/// The mission's record without its timing.
MissionRecord make_record(const FinishedMission& mission);

/// The traffic from and to one robot, by kind, as its radio counted it; bytes_per_s is not set.
std::vector<TrafficRecord> traffic_of(const bus::SimulatedRadio& radio, RobotId robot, const std::string& name);

}  // namespace tutti::mission
