// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include "tutti/geometry/so3.hpp"
#include "tutti/mission/report/compare.hpp"
#include "tutti/mission/report/explanation.hpp"
#include "tutti/mission/report/format.hpp"
#include "tutti/mission/report/html_parts.hpp"

namespace tutti::mission {
namespace {

Points3d positions(const Trajectory& trajectory) {
  Points3d out;
  for (const StampedPose& p : trajectory) out.push_back(p.pose.translation);
  return out;
}

/// Both ways from above, B laid on A, with the suspected origins and the constraints that would mend B.
std::string top_view(const TrajectoryComparison& c, const PictureClock& clock) {
  const Points3d a = positions(c.judge);
  const Points3d b = positions(c.judged);
  const Points3d fixed = positions(c.corrected);
  const GroundPlane ground = ground_plane({a, b});
  const PlanView view({ground(a), ground(b)}, kWide_px, 0.56 * kWide_px);
  const Points2d pixels_a = view(ground(a));
  const Points2d pixels_b = view(ground(b));
  Svg svg(view.width(), view.height(), "Both trajectories from above, B aligned to A");
  svg.polyline(pixels_a, "server", "A");
  draw_origins(svg, c.explanation.origins, c.judged, pixels_b, clock, view.width());
  svg.polyline(pixels_b, "onboard", "B");
  if (!c.constraints.empty()) svg.polyline(view(ground(fixed)), "corrected", "B with the constraints");
  Points2d ends;
  for (const auto& constraint : c.constraints)
    for (const std::size_t node : {constraint.from, constraint.to})
      if (node < pixels_a.size()) ends.push_back(pixels_a[node]);
  svg.dots(ends, "node other");
  svg.circle(pixels_b.front(), 6.0, "start onboard", "start of B");
  view.draw_scale_bar(svg);
  return svg.str();
}

std::string scales_html(const TrajectoryComparison& c, const PictureClock& clock) {
  HtmlTable table{{"scale", "over threshold", "worst at", "position there", "rotation there", "above since"}, {}, 1};
  for (const ScaleSummary& s : scale_summaries(c.explanation))
    table.rows.push_back({fmt::format("{:.1f} m", s.length_m),
                          s.significance > 1.0 ? "<b>" + format_significance(s.significance) + "</b>"
                                               : format_significance(s.significance),
                          format_moment(clock(s.worst)), format_metres(s.position_m),
                          fmt::format("{:.2f}°", s.rotation_rad / kRadPerDeg),
                          s.since ? format_moment(clock(*s.since)) : "-"});
  return html(table);
}

std::string origins_html(const TrajectoryComparison& c, const PictureClock& clock) {
  if (c.explanation.origins.empty()) return "";
  HtmlTable table{
      {"suspected", "from", "until", "where", "distance", "translation", "rotation", "scale", "over threshold"}, {}, 1};
  for (const auto& o : c.explanation.origins)
    table.rows.push_back({o.alert ? "<b>localisation failure</b>" : "drift", format_moment(clock(o.from)),
                          format_moment(clock(o.until)), format_place(o.place_m), fmt::format("{:.1f} m", o.length_m),
                          format_metres(o.translation_m), fmt::format("{:.2f}°", o.rotation_rad / kRadPerDeg),
                          format_scale(c.explanation, o.scale), format_significance(o.significance)});
  return "<h3>Where it was born</h3>\n" + html(table);
}

std::string constraints_html(const TrajectoryComparison& c, const PictureClock& clock) {
  if (c.constraints.empty()) return "";
  HtmlTable table{{"from", "to", "x", "y", "z", "turn"}, {}, 0};
  for (const auto& link : c.constraints) {
    const Pose3& T = link.measurement.T_a_b;
    table.rows.push_back({format_moment(clock(link.from_stamp)), format_moment(clock(link.to_stamp)),
                          format_metres(T.translation.x()), format_metres(T.translation.y()),
                          format_metres(T.translation.z()), fmt::format("{:.2f}°", rotation_angle(T) / kRadPerDeg)});
  }
  return fmt::format("<details><summary>Relative poses of A that would fix it: {}</summary>\n{}</details>\n",
                     c.constraints.size(), html(table));
}

/// What bending B by the constraints does to its own motion.
std::string bent_html(const TrajectoryComparison& c) {
  if (c.constraints.empty()) return "";
  return fmt::format(
      "<ul class=\"notes\">\n<li>No motion over 1 s or between nodes changes by more than {} and "
      "{:.3f}°.</li>\n</ul>\n",
      format_metres(c.kink.translation_m), c.kink.rotation_deg);
}

std::string lead_text(const TrajectoryComparison& c) {
  const std::string off = fmt::format("{} RMSE after one rigid alignment, {} at most", format_metres(c.before.rmse_m),
                                      format_metres(c.before.max_m));
  if (!c.explanation.disagrees()) return fmt::format("They agree: {}, and nothing stands out at any scale.", off);
  std::string out = fmt::format("They disagree, by up to {} the threshold: {}.",
                                format_significance(largest_significance(c.explanation)), off);
  if (!c.constraints.empty())
    out += fmt::format(" {} relative poses of A would bring B to {}, {} at most.", c.constraints.size(),
                       format_metres(c.after.rmse_m), format_metres(c.after.max_m));
  return out;
}

std::string robot_html(const TrajectoryComparison& c) {
  const PictureClock clock{c.judged.front().stamp};
  const auto& e = c.explanation;
  Range time_s;
  time_s.include(0.0);
  time_s.include(clock(c.judged.back().stamp));
  const ExplanationPicture picture{.explanation = &e,
                                   .label = "Disagreement of B with A: time and scale",
                                   .clock = clock,
                                   .time_s = time_s,
                                   .time_axis = "time after B's first pose that has one of A [s]"};
  std::vector<LegendEntry> legend{{"server", "A"}, {"onboard", "B, aligned"}};
  if (!c.constraints.empty()) {
    legend.push_back({"corrected", "B with the constraints"});
    legend.push_back({"node other", "ends of constraints"});
  }
  for (auto& entry : origin_legend(e.origins)) legend.push_back(std::move(entry));
  return section(
      c.name.empty() ? "B against A" : c.name, lead_text(c),
      legend_html(legend) + "<div class=\"figures\">\n" + figure(top_view(c, clock), "From above", "", true) +
          "</div>\n<br>\n" + significance_scale_html() + "<div class=\"figures\">\n" +
          figure(explanation_svg(picture, kWide_px), "Disagreement by time and scale", "", true) + "</div>\n" +
          scales_html(c, clock) + origins_html(c, clock) + constraints_html(c, clock) + bent_html(c));
}

}  // namespace

std::string compare_html(const CompareReport& report) {
  std::string body = fmt::format(
      "<p class=\"brand\">Tutti compare</p>\n<h1>{}</h1>\n<p class=\"description\">judged by {}</p>\n<ul "
      "class=\"facts\">\n<li>A counts as sure to {:.3g} m, {:.2g}° (standard deviation)</li>\n<li>false alarms: {:g} "
      "per "
      "comparison</li>\n</ul>\n",
      escape_xml(report.b), escape_xml(report.a), report.config.tolerance_m, report.config.tolerance_deg,
      report.config.false_alarm_rate);
  for (const TrajectoryComparison& c : report.robots) body += robot_html(c);
  for (const std::string& note : report.notes) body += "<p class=\"lead\">" + escape_xml(note) + "</p>\n";
  body += fmt::format("<footer>Made by Tutti {}. Every figure is defined in docs/compare.md.</footer>\n",
                      escape_xml(report.version));
  return page("compare - Tutti", body);
}

}  // namespace tutti::mission
