// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tutti/mission/evaluate.hpp"

namespace tutti::mission {
namespace {

RobotFixesRecord fixes_of(RobotId robot, const server::Fixes& fixes) {
  RobotFixesRecord out;
  for (const server::JudgedFixes& judged : fixes.judged) {
    if (judged.submap.chain.robot != robot) continue;
    ++out.submaps;
    out.fixes += judged.fixes;
    out.used += judged.used;
    if (judged.objection == server::FixObjection::none) ++out.submaps_used;
    if (judged.objection == server::FixObjection::contradictory) ++out.contradictory;
    if (judged.objection == server::FixObjection::misfit) ++out.misfit;
    if (judged.objection == server::FixObjection::unaligned) ++out.unaligned;
  }
  for (const auto& [chain, factor] : fixes.understated)
    if (chain.robot == robot) out.understated = std::max(out.understated, std::sqrt(factor));
  return out;
}

}  // namespace

void evaluate_fixes(const server::MapEstimate& map, const std::string& mode, MissionRecord& record) {
  if (map.fixes.judged.empty()) return;
  FixesRecord out{.mode = mode, .robots = {}, .georeference = map.fixes.georeference};
  for (const RobotRecord& robot : record.robots) {
    RobotFixesRecord of = fixes_of(robot.id, map.fixes);
    of.robot = robot.name;
    if (of.submaps == 0) continue;
    if (of.understated > 1.0)
      record.notes.push_back(
          fmt::format("{}: its fixes err {:.1f} times as much as they say, by the map that odometry and closures make; "
                      "the map counts "
                      "them so",
                      robot.name, of.understated));
    for (const server::Unaligned& unaligned : map.fixes.unaligned)
      if (unaligned.chain.robot == robot.id)
        record.notes.push_back(fmt::format("{}: not laid on the earth: {}", robot.name, unaligned.why));
    out.robots.push_back(std::move(of));
  }
  record.server.fixes = std::move(out);
}

}  // namespace tutti::mission
