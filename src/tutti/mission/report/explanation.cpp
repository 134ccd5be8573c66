// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/report/explanation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "tutti/geometry/so3.hpp"
#include "tutti/mission/report/colours.hpp"
#include "tutti/mission/report/format.hpp"
#include "tutti/mission/report/map_pictures.hpp"

namespace tutti::mission {
namespace {

using consistency::Explanation;
using consistency::SuspectedOrigin;

constexpr double kLeastShown = 0.1;  // of the threshold: below, all look the same
constexpr double kLeft_px = 96.0;
constexpr double kRight_px = 16.0;
constexpr double kTop_px = 8.0;
constexpr double kBar_px = 12.0;
constexpr double kThinnest_px = 3.0;

/// Rows get thinner when there are many, but stay legible.
double row_px(const Explanation& e) {
  return std::clamp(std::floor(320.0 / static_cast<double>(std::max<Eigen::Index>(e.significance.cols(), 1))), 16.0,
                    26.0);
}

/// When node `n` speaks: half-way to its neighbours.
std::pair<double, double> span_s(const Explanation& e, const PictureClock& clock, std::size_t n) {
  const double now = clock(e.stamps[n]);
  const double before = n > 0 ? clock(e.stamps[n - 1]) : now;
  const double after = n + 1 < e.stamps.size() ? clock(e.stamps[n + 1]) : now;
  return {0.5 * (before + now), 0.5 * (now + after)};
}

/// Calls visit(node, first column, last column) for every node that a picture of `width` columns shows.
template <class Visit>
void for_columns(const Explanation& e, const PictureClock& clock, const Range& time_s, std::size_t width, Visit visit) {
  const double length_s = time_s.high - time_s.low;
  if (!(length_s > 0.0) || width == 0) return;
  const auto column = [&](double t) {
    const double position = (t - time_s.low) / length_s * static_cast<double>(width);
    return static_cast<std::size_t>(std::clamp(position, 0.0, static_cast<double>(width - 1)));
  };
  for (std::size_t n = 0; n < std::min<std::size_t>(e.stamps.size(), static_cast<std::size_t>(e.significance.rows()));
       ++n) {
    const auto [from, until] = span_s(e, clock, n);
    if (until >= time_s.low && from <= time_s.high) visit(n, column(from), column(until));
  }
}

/// Three significant digits without exponent.
std::string significant(double value) {
  if (!std::isfinite(value)) return "-";
  const double size = std::abs(value);
  return fmt::format("{:.{}f}", value, size < 0.1 ? 3 : size < 10.0 ? 2 : size < 100.0 ? 1 : 0);
}

std::string origin_class(const SuspectedOrigin& origin) { return origin.alert ? "origin alert" : "origin"; }

std::string words(const Explanation& e, const SuspectedOrigin& origin, const PictureClock& clock) {
  return fmt::format("{}, {} to {}: {}; {} the threshold at scale {}",
                     origin.alert ? "localisation failure suspected" : "drift", format_moment(clock(origin.from)),
                     format_moment(clock(origin.until)), format_origin_size(origin),
                     format_significance(origin.significance), format_scale(e, origin.scale));
}

/// Left edge and width of a stretch of time in pixels; never too thin to see.
std::pair<double, double> extent(const Axis& x, double from_s, double until_s) {
  const double width = std::max(kThinnest_px, x(until_s) - x(from_s));
  return {0.5 * (x(from_s) + x(until_s) - width), width};
}

void draw_hover_cells(Svg& svg, const ExplanationPicture& picture, const Axis& x) {
  const Explanation& e = *picture.explanation;
  const double row = row_px(e);
  const std::size_t columns = picture.hover_columns;
  std::vector<std::vector<std::size_t>> nodes(columns);
  for_columns(e, picture.clock, picture.time_s, columns, [&](std::size_t n, std::size_t first, std::size_t last) {
    for (std::size_t c = first; c <= last; ++c) nodes[c].push_back(n);
  });
  const double width =
      (x(picture.time_s.high) - x(picture.time_s.low)) / static_cast<double>(std::max<std::size_t>(columns, 1));
  for (std::size_t c = 0; c < columns; ++c)
    for (Eigen::Index s = 0; s < e.significance.cols() && !nodes[c].empty(); ++s) {
      const auto worst = static_cast<Eigen::Index>(
          *std::max_element(nodes[c].begin(), nodes[c].end(), [&](std::size_t a, std::size_t b) {
            return e.significance(static_cast<Eigen::Index>(a), s) < e.significance(static_cast<Eigen::Index>(b), s);
          }));
      if (!(e.significance(worst, s) > 0.0)) continue;
      svg.rect({x(picture.time_s.low) + width * static_cast<double>(c), kTop_px + row * static_cast<double>(s)},
               {width, row}, "hover",
               fmt::format("{}, {} along: scale {}: {} the threshold ({}, {:.2f} deg)",
                           format_moment(picture.clock(e.stamps[static_cast<std::size_t>(worst)])),
                           format_distance(e.distance_m[static_cast<std::size_t>(worst)]),
                           format_scale(e, static_cast<int>(s)), format_significance(e.significance(worst, s)),
                           format_metres(e.position_m(worst, s)), e.rotation_rad(worst, s) / kRadPerDeg));
    }
}

}  // namespace

formats::Rgb significance_colour(double significance) {
  using Colour = std::array<double, 3>;
  static constexpr Colour kQuiet{18, 35, 84};
  static constexpr Colour kNearlyThere{74, 104, 140};
  static constexpr Colour kThere{214, 68, 48};
  static constexpr Colour kMore{244, 148, 54};
  static constexpr Colour kMost{253, 231, 76};
  const auto mix = [](const Colour& a, const Colour& b, double t) {
    const auto channel = [&](std::size_t c) {
      return static_cast<std::uint8_t>(std::lround(a[c] + std::clamp(t, 0.0, 1.0) * (b[c] - a[c])));
    };
    return formats::Rgb{channel(0), channel(1), channel(2)};
  };
  if (!(significance > kLeastShown)) return mix(kQuiet, kQuiet, 0.0);
  const double decades = std::log10(significance);
  if (significance <= 1.0) return mix(kQuiet, kNearlyThere, 1.0 - decades / std::log10(kLeastShown));
  const double hot = decades / std::log10(kMostShown);
  return hot < 0.5 ? mix(kThere, kMore, 2.0 * hot) : mix(kMore, kMost, 2.0 * hot - 1.0);
}

RgbaImage significance_image(const Explanation& e, const PictureClock& clock, const Range& time_s, std::size_t width,
                             std::size_t row_height) {
  const auto scales = static_cast<std::size_t>(e.significance.cols());
  RgbaImage image{.width = width, .height = row_height * scales, .rgba = {}};
  std::vector<double> value(width * scales, -1.0);  // below 0: nothing there
  for_columns(e, clock, time_s, width, [&](std::size_t n, std::size_t first, std::size_t last) {
    for (std::size_t s = 0; s < scales; ++s)
      for (std::size_t c = first; c <= last; ++c) {
        const double here = e.significance(static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(s));
        double& cell = value[s * width + c];
        if (std::isfinite(here)) cell = std::max(cell, here);
      }
  });
  image.rgba.reserve(4 * image.width * image.height);
  for (std::size_t y = 0; y < image.height; ++y)
    for (std::size_t c = 0; c < width; ++c) {
      const double v = value[y / row_height * width + c];
      const formats::Rgb colour = significance_colour(v);
      image.rgba.insert(image.rgba.end(),
                        {colour.red, colour.green, colour.blue, static_cast<std::uint8_t>(v < 0.0 ? 0 : 255)});
    }
  return image;
}

std::string explanation_svg(const ExplanationPicture& picture, double width_px) {
  const Explanation& e = *picture.explanation;
  const double row = row_px(e);
  const auto scales = e.significance.cols();
  const double right = width_px - kRight_px;
  const double map_bottom = kTop_px + row * static_cast<double>(scales);
  const double suspected_top = map_bottom + 8.0;
  const double truth_top = suspected_top + kBar_px + 6.0;
  const double bottom = picture.truth.empty() ? suspected_top + kBar_px + 5.0 : truth_top + kBar_px + 5.0;
  const Axis x = Axis::linear(picture.time_s, kLeft_px, right, 14, false);
  Svg svg(width_px, bottom + 40.0, picture.label);
  if (scales > 0 && e.stamps.size() > 1)
    svg.image({kLeft_px, kTop_px}, {right - kLeft_px, map_bottom - kTop_px},
              data_uri(encode_png(significance_image(e, picture.clock, picture.time_s,
                                                     static_cast<std::size_t>(kPixelRatio * (right - kLeft_px)),
                                                     static_cast<std::size_t>(kPixelRatio * row)))));
  Strokes rows;
  for (Eigen::Index s = 0; s < scales; ++s) {
    const double top = kTop_px + row * static_cast<double>(s);
    if (s > 0) rows.push_back({{kLeft_px, top}, {right, top}});
    svg.text({kLeft_px - 8.0, top + 0.5 * row + 4.0}, format_scale(e, static_cast<int>(s)), "tick", "end");
  }
  svg.segments(rows, "rowline");
  svg.vertical_text({13.0, 0.5 * (kTop_px + map_bottom)}, "scale: distance", "axis");
  draw_hover_cells(svg, picture, x);

  Strokes grid;
  for (const double tick : x.ticks()) {
    grid.push_back({{x(tick), map_bottom}, {x(tick), bottom}});
    svg.text({x(tick), bottom + 16.0}, tick_label(tick), "tick", "middle");
  }
  svg.segments(grid, "gridline");
  svg.text({kLeft_px - 8.0, suspected_top + kBar_px - 2.0}, "suspected", "tick", "end");
  for (const SuspectedOrigin& origin : e.origins) {
    const auto [left, width] = extent(x, picture.clock(origin.from), picture.clock(origin.until));
    svg.rect({left, suspected_top}, {width, kBar_px}, origin_class(origin), words(e, origin, picture.clock));
    if (origin.scale >= 0 && origin.scale < scales)
      svg.rect({left, kTop_px + row * origin.scale + 1.5}, {width, row - 3.0}, "originbox",
               words(e, origin, picture.clock));
  }
  if (!picture.truth.empty()) svg.text({kLeft_px - 8.0, truth_top + kBar_px - 2.0}, "true", "tick", "end");
  for (const DriftOrigin& origin : picture.truth) {
    const auto [left, width] = extent(x, picture.clock(origin.from), picture.clock(origin.until));
    svg.rect({left, truth_top}, {width, kBar_px}, fmt::format("truth {}", drift_name(origin.kind)),
             format_drift(origin));
  }
  svg.polyline(Points2d{{kLeft_px, bottom}, {right, bottom}}, "baseline");
  svg.text({0.5 * (kLeft_px + right), bottom + 33.0}, picture.time_axis, "axis", "middle");
  return svg.str();
}

std::string significance_scale_html() {
  const double low = std::log10(kLeastShown), range = std::log10(kMostShown) - low;
  std::vector<std::pair<double, std::string>> ticks;
  for (const double tick : {0.1, 0.3, 1.0, 3.0, 10.0})
    ticks.emplace_back((std::log10(tick) - low) / range, tick == 1.0 ? "1 = threshold" : tick_label(tick));
  return colour_bar_html("Colour scale of the disagreement in units of its threshold",
                         "disagreement over its threshold", ticks,
                         [&](double share) { return hex(significance_colour(std::pow(10.0, low + range * share))); });
}

std::vector<LegendEntry> origin_legend(std::span<const SuspectedOrigin> origins) {
  std::vector<LegendEntry> out;
  const auto any = [&](bool alert) {
    return std::any_of(origins.begin(), origins.end(), [&](const SuspectedOrigin& o) { return o.alert == alert; });
  };
  if (any(false)) out.push_back({"origin", "suspected origin of drift"});
  if (any(true)) out.push_back({"origin alert", "suspected localisation failure"});
  return out;
}

void draw_origins(Svg& svg, std::span<const SuspectedOrigin> origins, const Trajectory& route, const Points2d& pixels,
                  const PictureClock& clock, double width_px) {
  constexpr double kName_px = 70.0;
  constexpr std::size_t kFewOrigins = 8;  // more names would lie over each other
  for (const SuspectedOrigin& origin : origins) {
    const auto [first, last] = stretch(route, origin.from, origin.until);
    if (last <= first) continue;
    const auto way = std::span(pixels).subspan(first, last - first);
    const std::string title = fmt::format("{} to {}: {}", format_moment(clock(origin.from)),
                                          format_moment(clock(origin.until)), format_origin_size(origin));
    svg.polyline(way, origin_class(origin) + " along", title);
    if (!origin.alert && origins.size() > kFewOrigins) continue;
    const Eigen::Vector2d middle = way[way.size() / 2];
    const bool at_edge = middle.x() > width_px - kName_px;
    svg.text(middle + Eigen::Vector2d(at_edge ? -9.0 : 9.0, -9.0), format_moment(clock(origin.from)), "name",
             at_edge ? "end" : "start");
  }
}

double largest_significance(const Explanation& e) {
  return std::max(e.significance.size() > 0 ? e.significance.maxCoeff() : 0.0, e.direction_significance);
}

std::string format_moment(double value_s) { return std::isfinite(value_s) ? fmt::format("{:.1f} s", value_s) : "-"; }

std::string format_between(const PictureClock& clock, Timestamp from, Timestamp until) {
  return fmt::format("{} - {}", format_moment(clock(from)), format_moment(clock(until)));
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

std::string format_drift(const DriftOrigin& origin) {
  return fmt::format("{} for {:.1f} s: {}", drift_name(origin.kind), origin.until - origin.from,
                     format_motion_error(origin.translation_m, origin.rotation_rad));
}

std::string format_disagreement(const Explanation& e) {
  if (!e.disagrees()) return "odometry and map agree within what the server is sure of";
  const double largest = largest_significance(e);
  return fmt::format("odometry and map part by up to {} the threshold{}", format_significance(largest),
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

std::optional<DriftOrigin> overlapping(const SuspectedOrigin& origin, std::span<const DriftOrigin> truth) {
  std::optional<DriftOrigin> best;
  double longest_s = -1.0;
  for (const DriftOrigin& real : truth) {
    const double common_s = std::min(origin.until, real.until) - std::max(origin.from, real.from);
    if (common_s < 0.0 || common_s <= longest_s) continue;
    longest_s = common_s;
    best = real;
  }
  return best;
}

}  // namespace tutti::mission
