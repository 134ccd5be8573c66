// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/mission/report/svg.hpp"

/// Draws axes and views from above with Svg.
namespace tutti::mission {

inline constexpr double kWide_px = 1160.0;  ///< Width of pictures that take the whole row.

/// The smallest and largest value included so far; values that are not finite are ignored.
struct Range {
  double low = 0.0;
  double high = 0.0;
  bool empty = true;
  void include(double value);
};

/// One axis: values to pixels, linear or logarithmic, with ticks at 1, 2, 5 x 10^n (many decades: powers of ten).
class Axis {
 public:
  /// A linear axis; `widen` extends it to the next tick on both sides. An empty or single-valued range is widened.
  static Axis linear(Range values, double pixel_low, double pixel_high, int max_ticks, bool widen);
  /// A logarithmic axis, widened to the next 1, 2 or 5 x 10^n, with at most 6 decades. Values below its lower end, and
  /// those <= 0, are clamped to that end.
  static Axis logarithmic(Range values, double pixel_low, double pixel_high);

  [[nodiscard]] double operator()(double value) const;
  [[nodiscard]] const std::vector<double>& ticks() const { return ticks_; }

 private:
  double low_ = 0.0;
  double high_ = 1.0;
  double pixel_low_ = 0.0;
  double pixel_high_ = 1.0;
  bool logarithmic_ = false;
  std::vector<double> ticks_;
};

/// Shortest plain text of a tick: "0.05", "200".
std::string tick_label(double value);
/// Label of a length on an axis in metres: "1 mm", "5 cm", "2 m".
std::string length_label(double value_m);

/// Draws grid, tick labels and axis names of a chart whose plot area the two axes span. Without `x_name`, x has no
/// labels.
void draw_axes(Svg& svg, const Axis& x, const Axis& y, const Eigen::Vector2d& top_left,
               const Eigen::Vector2d& bottom_right, std::string_view x_name, bool y_is_length);

/// A map seen from above: metres to pixels with equal axes, x to the right, y up.
class PlanView {
 public:
  /// Fits the bounding box of all points into `width` and at most `max_height`, with a margin.
  PlanView(const std::vector<Points2d>& layers, double width, double max_height);
  [[nodiscard]] double width() const { return width_; }
  [[nodiscard]] double height() const { return height_; }
  [[nodiscard]] double pixels_per_metre() const { return scale_; }
  [[nodiscard]] Eigen::Vector2d operator()(const Eigen::Vector2d& p) const;
  [[nodiscard]] Points2d operator()(const Points2d& points) const;
  /// Draws a bar of a round length in the lower left corner; `look` is a further CSS class for it.
  void draw_scale_bar(Svg& svg, std::string_view look = {}) const;
  [[nodiscard]] double scale_bar_m() const;

 private:
  double width_;
  double height_;
  double scale_ = 1.0;
  Eigen::Vector2d center_ = Eigen::Vector2d::Zero();
};

/// One line of a legend: a coloured square and a label; HTML.
struct LegendEntry {
  std::string css_class;  ///< The stroke's.
  std::string label;
};
std::string legend_html(const std::vector<LegendEntry>& entries);

/// A bar with all colours of `colour` (a function of 0 to 1) above its ticks, each with position and text; HTML.
/// `label` as in Svg.
std::string colour_bar_html(std::string_view label, std::string_view words,
                            const std::vector<std::pair<double, std::string>>& ticks,
                            const std::function<std::string(double)>& colour);

}  // namespace tutti::mission
