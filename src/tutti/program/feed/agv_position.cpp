// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/feed/agv_position.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "tutti/localise/state.hpp"

namespace tutti::program {

std::string agv_position(const InMap& in_map) {
  const bool has_place = in_map.age_s.has_value();
  const bool is_localised = has_place && in_map.state == to_string(localise::State::localised);
  const Eigen::Vector3d forward = in_map.T_world_body.rotation * Eigen::Vector3d::UnitX();
  nlohmann::ordered_json out{{"x", has_place ? in_map.T_world_body.translation.x() : 0.0},
                             {"y", has_place ? in_map.T_world_body.translation.y() : 0.0},
                             {"theta", has_place ? std::atan2(forward.y(), forward.x()) : 0.0},
                             {"mapId", in_map.floor > 1 ? fmt::format("{}_{}", in_map.map, in_map.floor) : in_map.map},
                             {"mapDescription", fmt::format("revision {}", in_map.version)},
                             {"positionInitialized", is_localised},
                             {"localizationScore", is_localised ? in_map.overlap.value_or(1.0) : 0.0}};
  if (is_localised && in_map.sigma_m) out["deviationRange"] = *in_map.sigma_m;
  return out.dump();
}

}  // namespace tutti::program
