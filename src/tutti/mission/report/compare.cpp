// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/report/compare.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tutti/geometry/so3.hpp"
#include "tutti/mission/report/explanation.hpp"
#include "tutti/mission/report/format.hpp"
#include "tutti/mission/report/table.hpp"

namespace tutti::mission {
namespace {

constexpr std::size_t kMostRows = 20;

std::string degrees(double rad) { return fmt::format("{:.3f} deg", rad / kRadPerDeg); }

std::string more(std::size_t rows, const char* what) {
  return rows > kMostRows ? fmt::format("  and {} more {}; --json has all\n", rows - kMostRows, what) : std::string();
}

std::string scales_table(const TrajectoryComparison& c, const PictureClock& clock) {
  TextTable table(0);
  table.add({"scale", "over threshold", "worst at", "position", "rotation", "above since"});
  table.rule();
  for (const ScaleSummary& s : scale_summaries(c.explanation))
    table.add({fmt::format("{:.1f} m", s.length_m), format_significance(s.significance), format_time_s(clock(s.worst)),
               format_metres(s.position_m), degrees(s.rotation_rad), s.since ? format_time_s(clock(*s.since)) : "-"});
  return table.str();
}

std::string origins_table(const TrajectoryComparison& c, const PictureClock& clock) {
  const auto& origins = c.explanation.origins;
  if (origins.empty()) return "  No segment stands out from the rest of the trajectory: B drifts all along.\n";
  TextTable table(0);
  table.add({"from", "until", "where", "over", "translation", "rotation", "scale", "over threshold", ""});
  table.rule();
  for (std::size_t i = 0; i < std::min(origins.size(), kMostRows); ++i) {
    const auto& o = origins[i];
    table.add({format_time_s(clock(o.from)), format_time_s(clock(o.until)), format_place(o.place_m),
               fmt::format("{:.1f} m", o.length_m), format_metres(o.translation_m), degrees(o.rotation_rad),
               format_scale(c.explanation, o.scale), format_significance(o.significance), o.alert ? "failure?" : ""});
  }
  return table.str() + more(origins.size(), "segments");
}

std::string constraints_table(const TrajectoryComparison& c, const PictureClock& clock) {
  if (c.constraints.empty()) return "  none needed\n";
  TextTable table(0);
  table.add({"from", "to", "x", "y", "z", "turn"});
  table.rule();
  for (std::size_t i = 0; i < std::min(c.constraints.size(), kMostRows); ++i) {
    const auto& link = c.constraints[i];
    const Pose3& T = link.measurement.T_a_b;
    table.add({format_time_s(clock(link.from_stamp)), format_time_s(clock(link.to_stamp)),
               format_metres(T.translation.x()), format_metres(T.translation.y()), format_metres(T.translation.z()),
               degrees(rotation_angle(T))});
  }
  return table.str() + more(c.constraints.size(), "constraints");
}

std::string robot_text(const CompareReport& report, const TrajectoryComparison& c) {
  const consistency::Explanation& e = c.explanation;
  const PictureClock clock{c.judged.front().stamp};
  std::string out = "\n";
  if (!c.name.empty()) out += c.name + "\n";
  out += wrap(
      fmt::format("{} of {} poses of B have one of A; {} nodes, every {:.2f} m along {:.1f} m and {:.1f} s.", c.paired,
                  c.poses, c.judged.size(), c.spacing_m, c.length_m, c.judged.back().stamp - c.judged.front().stamp),
      "  ");
  out +=
      wrap(fmt::format("After one rigid alignment B is off A by {} RMSE, {} at most, {:.2f} deg; A counts as sure to "
                       "{:.3g} m and {:.2g} deg.",
                       format_metres(c.before.rmse_m), format_metres(c.before.max_m), c.before.rmse_deg,
                       report.config.tolerance_m, report.config.tolerance_deg),
           "  ");
  if (!e.disagrees())
    return out + "\n  They agree: nothing stands out of that at any scale.\n\n" + scales_table(c, clock);
  out += fmt::format("\n  They disagree, by up to {} the threshold.\n\n", format_significance(largest_significance(e)));
  out += scales_table(c, clock);
  out += "\n  Where it was born (relative motion of B against A's over the segment)\n\n" + origins_table(c, clock);
  out += fmt::format("\n  Relative poses of A that would fix B: {}\n\n", c.constraints.size());
  out += constraints_table(c, clock);
  if (c.constraints.empty()) return out;
  out += '\n';
  out += wrap(fmt::format("With them B is off A by {} RMSE, {} at most.", format_metres(c.after.rmse_m),
                          format_metres(c.after.max_m)),
              "  ");
  return out += wrap(fmt::format("No motion over 1 s or between nodes changes by more than {} and {:.3f} deg.",
                                 format_metres(c.discontinuity.translation_m), c.discontinuity.rotation_deg),
                     "  ");
}

}  // namespace

std::vector<ScaleSummary> scale_summaries(const consistency::Explanation& e) {
  std::vector<ScaleSummary> out;
  for (Eigen::Index s = 0; s < e.significance.cols() && e.significance.rows() > 0; ++s) {
    Eigen::Index worst = 0;
    const double largest = e.significance.col(s).maxCoeff(&worst);
    ScaleSummary row{.length_m = e.scale_length_m[static_cast<std::size_t>(s)],
                     .significance = largest,
                     .worst = e.stamps[static_cast<std::size_t>(worst)],
                     .position_m = e.position_m(worst, s),
                     .rotation_rad = e.rotation_rad(worst, s),
                     .since = {}};
    for (Eigen::Index n = 0; n < e.significance.rows() && !row.since; ++n)
      if (e.significance(n, s) > 1.0) row.since = e.stamps[static_cast<std::size_t>(n)];
    out.push_back(row);
  }
  return out;
}

std::string compare_text(const CompareReport& report) {
  std::string out = fmt::format("A, which judges:    {}\nB, which is judged: {}\n", report.a, report.b);
  for (const TrajectoryComparison& c : report.robots) out += robot_text(report, c);
  for (const std::string& note : report.notes) out += wrap(note, "  note  ");
  return out;
}

}  // namespace tutti::mission
