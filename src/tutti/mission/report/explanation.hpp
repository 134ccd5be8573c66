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

/// Shows an explanation as pictures and words; used by missions' reports and by `tutti compare`.
namespace tutti::mission {

/// The colour of a disagreement in units of its threshold: dark blue to slate below 1, red to yellow above, with
/// lightness increasing and a jump at 1. From kMostShown on all are the same.
formats::Rgb significance_colour(double significance);
inline constexpr double kMostShown = 10.0;

/// The disagreement map: `row_height` rows of pixels per scale (scale 0 on top), time over `width` columns. Each column
/// has the largest significance of its nodes; a node stands for the time half-way to its neighbours. Transparent where
/// there is no node.
RgbaImage significance_image(const consistency::Explanation& explanation, const PictureClock& clock,
                             const Range& time_s, std::size_t width, std::size_t row_height);

/// What explanation_svg() shows.
struct ExplanationPicture {
  const consistency::Explanation* explanation = nullptr;
  std::string label;
  PictureClock clock;
  Range time_s;
  std::string time_axis;               ///< Such as "mission time [s]".
  std::span<const DriftOrigin> truth;  ///< Shown beside the suspected origins; empty: unknown.
  std::size_t hover_columns = 60;      ///< Number of columns with a tooltip.
};

/// Time x scale, with a bar for every suspected origin and below it one for every true one.
std::string explanation_svg(const ExplanationPicture& picture, double width_px);
/// HTML that explains the colours of significance_image().
std::string significance_scale_html();
/// Legend of the bars and strokes.
std::vector<LegendEntry> origin_legend(std::span<const consistency::SuspectedOrigin> origins);

/// Draws strokes along a route where odometry is suspected, with the time at which each begins (if there are many, for
/// alerts only). `pixels` has one entry per pose of `route`, in a picture `width_px` wide.
void draw_origins(Svg& svg, std::span<const consistency::SuspectedOrigin> origins, const Trajectory& route,
                  const Points2d& pixels, const PictureClock& clock, double width_px);

/// The largest significance over nodes, scales and directions; 0 without nodes.
double largest_significance(const consistency::Explanation& explanation);

/// Seconds, as on the axes of pictures: "712.3 s".
std::string format_moment(double value_s);
/// Such as "0.41 m, 1.30 deg over 12.0 m".
std::string format_origin_size(const consistency::SuspectedOrigin& origin);
/// Where, when, how large and at which scale: "62.0 s - 72.0 s, at (12.3, -4.0, 0.2) m: 0.41 m, 1.30 deg over 12.0 m
/// (scale 16 m)"; without an explanation the scale is left out.
std::string format_origin(const consistency::SuspectedOrigin& origin, const PictureClock& clock,
                          const std::optional<consistency::Explanation>& explanation);
/// Such as "(12.3, -4.0, 0.2) m".
std::string format_place(const Eigen::Vector3d& place_m);
/// Such as "0.10 m, 20.3 deg".
std::string format_motion_error(double translation_m, double rotation_rad);
/// Such as "slip for 2.0 s: 0.10 m, 20.3 deg".
std::string format_drift(const DriftOrigin& origin);
/// A sentence such as "odometry and map part by up to 12 x the threshold", with the way that odometry misses most if
/// there is one; or that they agree.
std::string format_disagreement(const consistency::Explanation& explanation);
/// The same for a robot's last update, of which the explanation must exist; or that there was nothing to compare with,
/// when the map of this robot is its own odometry.
std::string format_comparison(const MissionRecord& record, const RobotRecord& robot);
/// The scale of an origin as a length: "16 m"; "-" when the explanation does not have that scale.
std::string format_scale(const consistency::Explanation& explanation, int scale);
/// Such as "62.0 s - 72.0 s".
std::string format_between(const PictureClock& clock, Timestamp from, Timestamp until);
/// Such as "3.1 x".
std::string format_significance(double significance);

/// The true origin that overlaps a suspected one most in time; nothing when none does.
std::optional<DriftOrigin> overlapping(const consistency::SuspectedOrigin& origin, std::span<const DriftOrigin> truth);

}  // namespace tutti::mission
