// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/report/compare.hpp"
#include "tutti/mission/report/json_parts.hpp"

namespace tutti::mission {
namespace {

/// Seconds after the first node, and the stamp itself.
void add_time(Json& out, const std::string& name, Timestamp stamp, const TrajectoryComparison& c) {
  out[name + "_s"] = number(stamp - c.judged.front().stamp);
  out[name + "_stamp_ns"] = stamp.ns;
}

Json scales_json(const TrajectoryComparison& c) {
  Json out = Json::array();
  for (const ScaleSummary& s : scale_summaries(c.explanation)) {
    Json row{{"length_m", number(s.length_m)}, {"significance", number(s.significance)}};
    add_time(row, "worst", s.worst, c);
    row["position_m"] = number(s.position_m);
    row["rotation_rad"] = number(s.rotation_rad);
    row["since_s"] = s.since ? number(*s.since - c.judged.front().stamp) : Json(nullptr);
    out.push_back(std::move(row));
  }
  return out;
}

Json origins_json(const TrajectoryComparison& c) {
  Json out = Json::array();
  for (const auto& origin : c.explanation.origins) {
    Json row = Json::object();
    add_time(row, "from", origin.from, c);
    add_time(row, "until", origin.until, c);
    row.update({{"place_m", vector_json(origin.place_m)},
                {"scale", origin.scale},
                {"length_m", number(origin.length_m)},
                {"translation_m", number(origin.translation_m)},
                {"rotation_rad", number(origin.rotation_rad)},
                {"significance", number(origin.significance)},
                {"alert", origin.alert}});
    out.push_back(std::move(row));
  }
  return out;
}

Json constraints_json(const TrajectoryComparison& c) {
  Json out = Json::array();
  for (const auto& constraint : c.constraints) {
    Json row = Json::object();
    add_time(row, "from", constraint.from_stamp, c);
    add_time(row, "to", constraint.to_stamp, c);
    row["T_from_to"] = pose_json(constraint.measurement.T_a_b);
    out.push_back(std::move(row));
  }
  return out;
}

/// The disagreement map: one row per node.
Json map_json(const TrajectoryComparison& c) {
  const auto& e = c.explanation;
  Json stamps = Json::array();
  Json distances = Json::array();
  Json significance = Json::array();
  for (std::size_t n = 0; n < e.stamps.size(); ++n) {
    stamps.push_back(e.stamps[n].ns);
    distances.push_back(number(e.distance_m[n], 1e3));
    Json row = Json::array();
    for (Eigen::Index s = 0; s < e.significance.cols(); ++s)
      row.push_back(number(e.significance(static_cast<Eigen::Index>(n), s), 1e3));
    significance.push_back(std::move(row));
  }
  return {
      {"stamp_ns", std::move(stamps)}, {"distance_m", std::move(distances)}, {"significance", std::move(significance)}};
}

Json ate_json(const evaluation::AteResult& ate) {
  return {{"rmse_m", number(ate.rmse_m)}, {"max_m", number(ate.max_m)}, {"rmse_deg", number(ate.rmse_deg)}};
}

Json robot_json(const TrajectoryComparison& c) {
  const bool mended = !c.constraints.empty();
  return {{"name", c.name},
          {"poses", c.poses},
          {"paired", c.paired},
          {"nodes", c.judged.size()},
          {"spacing_m", number(c.spacing_m)},
          {"distance_m", number(c.length_m)},
          {"duration_s", number(c.judged.back().stamp - c.judged.front().stamp)},
          {"disagrees", c.explanation.disagrees()},
          {"aligned", ate_json(c.before)},
          {"T_a_b", pose_json(c.before.T_reference_estimate)},
          {"scales", scales_json(c)},
          {"origins", origins_json(c)},
          {"constraints", constraints_json(c)},
          {"fixed", mended ? ate_json(c.after) : Json(nullptr)},
          {"discontinuity_m", mended ? number(c.discontinuity.translation_m) : Json(nullptr)},
          {"discontinuity_deg", mended ? number(c.discontinuity.rotation_deg) : Json(nullptr)},
          {"map", map_json(c)}};
}

}  // namespace

std::string compare_json(const CompareReport& report) {
  bool disagree = false;
  Json robots = Json::array();
  for (const TrajectoryComparison& c : report.robots) {
    disagree = disagree || c.explanation.disagrees();
    robots.push_back(robot_json(c));
  }
  const Json out{{"format", 2},  // raised when a key changes its meaning or goes
                 {"a", report.a},
                 {"b", report.b},
                 {"disagree", disagree},
                 {"tolerance_m", number(report.config.tolerance_m)},
                 {"tolerance_deg", number(report.config.tolerance_deg)},
                 {"false_alarm_rate", number(report.config.false_alarm_rate, 1e9)},
                 {"notes", report.notes},
                 {"robots", std::move(robots)}};
  // Paths may hold any bytes: replaced where they are not UTF-8.
  return out.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace tutti::mission
