// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "tutti/evaluation/association.hpp"
#include "tutti/mission/mission_config.hpp"
#include "tutti/mission/recordings.hpp"
#include "tutti/model/proxy_graph.hpp"
#include "tutti/server/map_server.hpp"

namespace tutti::mission {

/// The error of a perfect judge's map (perfect_judge.hpp) while a mission runs: it tells an update which leaves a robot
/// worse than its odometry from one at which no judge of these closures could have done better. It makes a
/// map of its own for an update as long as all of them took at most kShare of the server's factorisations.
class PerfectCourse {
 public:
  static constexpr double kShare = 0.25;

  /// To be called after an update with what the server has broadcast of it.
  void update(const server::MapServer& server, const ProxyGraph& broadcast, const server::MapConfig& config,
              const std::vector<const MissionRecording*>& robots, const evaluation::AssociationConfig& association,
              const ClosureCheckConfig& check);
  /// RMSE of this robot's nodes in the broadcast of this revision, in the perfect judge's map, after a rigid alignment
  /// of their own, as UpdateRecord::server_rmse_m is of the broadcast. Nothing where no such map was made.
  [[nodiscard]] std::optional<double> rmse_m(std::uint64_t revision, RobotId robot) const;

 private:
  std::map<std::uint64_t, std::map<RobotId, double>> rmse_m_;  // by revision
  std::size_t factorisations_ = 0;                             // of all maps so far
  std::size_t last_ = 0;                                       // of the last one
};

}  // namespace tutti::mission
