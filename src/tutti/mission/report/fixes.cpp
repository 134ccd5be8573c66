// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include "tutti/geometry/so3.hpp"
#include "tutti/mission/report/format.hpp"
#include "tutti/mission/report/json_parts.hpp"

namespace tutti::mission {

Json fixes_json(const FixesRecord& fixes) {
  Json robots = Json::array();
  for (const RobotFixesRecord& robot : fixes.robots)
    robots.push_back({{"robot", robot.robot},
                      {"fixes", robot.fixes},
                      {"used", robot.used},
                      {"submaps", robot.submaps},
                      {"submaps_used", robot.submaps_used},
                      {"contradictory", robot.contradictory},
                      {"misfit", robot.misfit},
                      {"unaligned", robot.unaligned},
                      {"understated", number(robot.understated)}});
  Json out{{"mode", fixes.mode}, {"robots", std::move(robots)}, {"origin", nullptr}};
  if (const auto& earth = fixes.georeference) {
    out["origin"] = {{"latitude_deg", number(earth->origin.latitude_deg, 1e9)},
                     {"longitude_deg", number(earth->origin.longitude_deg, 1e9)},
                     {"height_m", number(earth->origin.height_m)}};
    out["T_enu_world"] = pose_json(earth->T_enu_world);
    out["component"] = earth->component;
    out["levelled"] = earth->is_levelled;
    out["sigma_m"] = number(earth->sigma_m);
    out["sigma_yaw_rad"] = number(earth->sigma_yaw_rad);
  }
  return out;
}

std::string format_fixes(const FixesRecord& fixes) {
  std::string out;
  if (const auto& earth = fixes.georeference)
    out = fmt::format(
        "origin at latitude {:.7f}, longitude {:.7f}, height {:.2f} m (enu); map {} it, to {:.2f} m and "
        "{:.2f} deg",
        earth->origin.latitude_deg, earth->origin.longitude_deg, earth->origin.height_m,
        fixes.mode == "factors" ? "follows the fixes round" : "is laid as it is on", earth->sigma_m,
        earth->sigma_yaw_rad / kRadPerDeg);
  else
    out = "where the map lies is not certain";
  for (const RobotFixesRecord& robot : fixes.robots) {
    out += fmt::format(". {}: fixes of {} of {} submaps count", robot.robot, robot.submaps_used, robot.submaps);
    const auto add = [&](std::size_t count, const char* why) {
      if (count > 0) out += fmt::format("; those of {} {}", count, why);
    };
    add(robot.misfit, "do not fit the map");
    add(robot.contradictory, "contradict each other");
    add(robot.unaligned, "lie nowhere for certain");
  }
  return out + ".";
}

}  // namespace tutti::mission
