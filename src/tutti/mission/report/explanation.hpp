// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tutti/consistency/explanation.hpp"
#include "tutti/formats/ply.hpp"
#include "tutti/mission/report/geometry.hpp"
#include "tutti/mission/report/plot.hpp"
#include "tutti/mission/report/png.hpp"
#include "tutti/model/recording.hpp"

/// An explanation as pictures and words; the same for a mission's report and for `tutti compare`.
namespace tutti::mission {

/// Colour of a disagreement in units of its threshold: dark blue to slate below 1, red to yellow above, lightness
/// increasing with a jump at 1; from kMostShown on all look the same.
formats::Rgb significance_colour(double significance);
inline constexpr double kMostShown = 10.0;

/// The disagreement map, `row_height` rows of pixels per scale (0 on top), the time axis over `width` columns: in each
/// the largest significance of the nodes there; a node speaks for the time half-way to its neighbours. Transparent
/// where no node is.
Image significance_image(const consistency::Explanation& explanation, const PictureClock& clock, const Range& time_s,
                         std::size_t width, std::size_t row_height);

struct ExplanationPicture {
  const consistency::Explanation* explanation = nullptr;
  std::string label;
  PictureClock clock;
  Range time_s;
  std::string time_axis;               ///< "mission time [s]"
  std::span<const DriftOrigin> truth;  ///< Beside the suspected origins; empty = unknown.
  std::size_t hover_columns = 60;      ///< With words for those who point at them.
};

/// Time x scale with a bar for every suspected origin, and one for every true one under it.
std::string explanation_svg(const ExplanationPicture& picture, double width_px);
/// HTML: what the colours of significance_image() mean.
std::string significance_scale_html();
/// What the bars and strokes mean.
std::vector<LegendEntry> origin_legend(std::span<const consistency::SuspectedOrigin> origins);

/// Strokes along a way where odometry is suspected, with the time they begin (of many, alerts only); `pixels`: one per
/// pose of `route`, in a picture `width_px` wide.
void draw_origins(Svg& svg, std::span<const consistency::SuspectedOrigin> origins, const Trajectory& route,
                  const Points2d& pixels, const PictureClock& clock, double width_px);

/// Of any node, scale or missed way, over its threshold; 0 without nodes.
double largest_significance(const consistency::Explanation& explanation);

/// Seconds, as on the pictures' axes: "712.3 s".
std::string format_moment(double value_s);
/// "0.41 m, 1.30 deg over 12.0 m".
std::string format_origin_size(const consistency::SuspectedOrigin& origin);
/// Where, when, how much and at which scale: "62.0 s - 72.0 s, at (12.3, -4.0, 0.2) m: 0.41 m, 1.30 deg over 12.0 m
/// (scale 16 m)"; without an explanation no scale.
std::string format_origin(const consistency::SuspectedOrigin& origin, const PictureClock& clock,
                          const std::optional<consistency::Explanation>& explanation);
/// "(12.3, -4.0, 0.2) m"
std::string format_place(const Eigen::Vector3d& place_m);
/// "0.10 m, 20.3 deg"
std::string format_motion_error(double translation_m, double rotation_rad);
/// "slip for 2.0 s: 0.10 m, 20.3 deg"
std::string format_drift(const DriftOrigin& origin);
/// "odometry and map part by up to 12 x the threshold", and the way that odometry misses by most, if any; or that they
/// agree.
std::string format_disagreement(const consistency::Explanation& explanation);
/// The same of a robot's last update, whose explanation is there; or that there was nothing to compare with, where the
/// map of it is its own odometry.
std::string format_comparison(const MissionRecord& record, const RobotRecord& robot);
/// The scale an origin stands out at, as a length: "16 m"; "-" when the explanation does not have it.
std::string format_scale(const consistency::Explanation& explanation, int scale);
/// "62.0 s - 72.0 s"
std::string format_between(const PictureClock& clock, Timestamp from, Timestamp until);
/// "3.1 x"
std::string format_significance(double significance);

/// The true origin that a suspected one overlaps most in time; nothing when none.
std::optional<DriftOrigin> overlapping(const consistency::SuspectedOrigin& origin, std::span<const DriftOrigin> truth);

}  // namespace tutti::mission
