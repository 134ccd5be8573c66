// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/report/explanation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tutti/geometry/so3.hpp"
#include "tutti/mission/report/format.hpp"

namespace tutti::mission {
namespace {

using consistency::Explanation;
using consistency::SuspectedOrigin;

/// Three significant digits without exponent.
std::string significant(double value) {
  if (!std::isfinite(value)) return "-";
  const double size = std::abs(value);
  return fmt::format("{:.{}f}", value, size < 0.1 ? 3 : size < 10.0 ? 2 : size < 100.0 ? 1 : 0);
}

}  // namespace

double largest_significance(const Explanation& e) {
  return std::max(e.significance.size() > 0 ? e.significance.maxCoeff() : 0.0, e.direction_significance);
}

std::string format_time_s(double value_s) { return std::isfinite(value_s) ? fmt::format("{:.1f} s", value_s) : "-"; }

std::string format_between(const PictureClock& clock, Timestamp from, Timestamp until) {
  return fmt::format("{} - {}", format_time_s(clock(from)), format_time_s(clock(until)));
}

std::string format_origin_size(const SuspectedOrigin& origin) {
  return fmt::format("{} m, {} deg over {} m", significant(origin.translation_m),
                     significant(origin.rotation_rad / kRadPerDeg), significant(origin.length_m));
}

std::string format_place(const Eigen::Vector3d& place_m) {
  const Eigen::Vector3d shown = 0.1 * (10.0 * place_m).array().round() + 0.0;  // no -0.0
  return fmt::format("({:.1f}, {:.1f}, {:.1f}) m", shown.x(), shown.y(), shown.z());
}

std::string format_origin(const SuspectedOrigin& origin, const PictureClock& clock,
                          const std::optional<Explanation>& explanation) {
  std::string out = fmt::format("{}, at {}: {}", format_between(clock, origin.from, origin.until),
                                format_place(origin.place_m), format_origin_size(origin));
  if (explanation) out += fmt::format(" (scale {})", format_scale(*explanation, origin.scale));
  return out;
}

std::string format_motion_error(double translation_m, double rotation_rad) {
  return fmt::format("{}, {:.1f} deg", format_metres(translation_m), rotation_rad / kRadPerDeg);
}

std::string format_disagreement(const Explanation& e) {
  if (!e.disagrees()) return "odometry and map agree within what the server is sure of";
  const double largest = largest_significance(e);
  return fmt::format("odometry and map differ by up to {} the threshold{}", format_significance(largest),
                     e.direction_significance == largest ? ", in what closures know best" : "");
}

std::string format_comparison(const MissionRecord& record, const RobotRecord& robot) {
  if (!robot.explanation->disagrees() && !is_tied(record, robot.id))
    return "there was nothing to compare odometry with: no loop closure ties its map";
  return format_disagreement(*robot.explanation);
}

std::string format_scale(const Explanation& explanation, int scale) {
  if (scale < 0 || static_cast<std::size_t>(scale) >= explanation.scale_length_m.size()) return "-";
  const double length_m = explanation.scale_length_m[static_cast<std::size_t>(scale)];
  if (!std::isfinite(length_m)) return "-";
  return length_m < 9.95 ? fmt::format("{:.1f} m", length_m) : format_distance(length_m);
}

std::string format_significance(double significance) {
  if (!std::isfinite(significance)) return "-";
  return significance < 9.95 ? fmt::format("{:.1f} x", significance) : fmt::format("{:.0f} x", significance);
}

}  // namespace tutti::mission
