// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>

#include "tutti/base/timestamp.hpp"
#include "tutti/node/broadcast.hpp"
#include "tutti/node/step.hpp"
#include "tutti/node/update_pacer.hpp"
#include "tutti/server/map_job.hpp"

namespace tutti::node {

/// A map that a server is to make, and those who are to hear of it. It shares nothing with its node that changes, so
/// make_map() may run on another thread while the node takes what comes.
struct MapTask {
  server::MapJob job;
  bool is_update = false;  ///< Makes a new revision.
  Timestamp begun;
  std::uint32_t incarnation = 0;
  std::set<RobotId> robots;
  std::map<RobotId, std::string> names;  ///< The robots' names.
  bool at_once = false;                  ///< Robots are sent it whatever it says.
  Broadcast broadcast;
};

/// The outcome of a task.
struct MapOfTask {
  server::MadeMap made;
  bool is_update = false;
  LastUpdate pace;  ///< Its cost is counted (server/update_cost.hpp), unless the host has measured it.
  Broadcast broadcast;
  Step step;  ///< The messages to robots on the map, and the events of that.
};

/// Makes the map, and what robots are sent of it.
MapOfTask make_map(MapTask task);

}  // namespace tutti::node
