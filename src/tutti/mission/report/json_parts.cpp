// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/report/json_parts.hpp"

#include <cmath>

namespace tutti::mission {

std::string dump(const Json& json) { return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n"; }

Json number(std::optional<double> value, double per_unit) {
  if (!value || !std::isfinite(*value)) return nullptr;
  const double rounded = std::round(*value * per_unit) / per_unit;
  return rounded == 0.0 ? 0.0 : rounded;  // no "-0.0"
}

Json optimum_json(double cost, std::size_t degrees_of_freedom, bool from_measurements) {
  return {{"cost", number(cost)},
          {"degrees_of_freedom", degrees_of_freedom},
          {"start", from_measurements ? "measurements" : "closures"}};
}

Json vector_json(const Eigen::Vector3d& v) { return Json::array({number(v.x()), number(v.y()), number(v.z())}); }

Json pose_json(const Pose3& T) {
  Eigen::Vector4d q = T.rotation.coeffs();
  if (q.w() < 0.0) q = -q;  // q and -q are one rotation: always print the same
  constexpr double kPerUnit = 1e9;
  return {{"translation_m", vector_json(T.translation)},
          {"quaternion_xyzw",
           {number(q.x(), kPerUnit), number(q.y(), kPerUnit), number(q.z(), kPerUnit), number(q.w(), kPerUnit)}}};
}

}  // namespace tutti::mission
