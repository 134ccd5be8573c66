// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/report/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace tutti::mission {
namespace {

constexpr double kPlanMarginPx = 26.0;
constexpr double kMinPlanHeightPx = 180.0;
constexpr double kMaxDecades = 6.0;

/// The smallest of 1, 2, 5 x 10^n that is at least `value` (> 0).
double round_up(double value) {
  const double decade = std::pow(10.0, std::floor(std::log10(value)));
  for (const double digit : {1.0, 2.0, 5.0})
    if (digit * decade >= value * (1.0 - 1e-9)) return digit * decade;
  return 10.0 * decade;
}

}  // namespace

void Range::include(double value) {
  if (!std::isfinite(value)) return;
  low = empty ? value : std::min(low, value);
  high = empty ? value : std::max(high, value);
  empty = false;
}

Axis Axis::linear(Range values, double pixel_low, double pixel_high, int max_ticks, bool widen) {
  Axis axis;
  if (values.empty) values = {0.0, 1.0, false};
  if (values.high - values.low < 1e-9 * std::max(1.0, std::abs(values.high)))
    values.high = values.low + std::max(1e-3, std::abs(values.low));
  const double step = round_up((values.high - values.low) / max_ticks);
  const double first = widen ? std::floor(values.low / step + 1e-9) : std::ceil(values.low / step - 1e-9);
  const double last = widen ? std::ceil(values.high / step - 1e-9) : std::floor(values.high / step + 1e-9);
  for (double i = first; i <= last; ++i) axis.ticks_.push_back(i * step);
  axis.low_ = widen ? axis.ticks_.front() : values.low;
  axis.high_ = widen ? axis.ticks_.back() : values.high;
  axis.pixel_low_ = pixel_low;
  axis.pixel_high_ = pixel_high;
  return axis;
}

Axis Axis::logarithmic(Range values, double pixel_low, double pixel_high) {
  constexpr double kFewDecades = 2.5;
  Axis axis;
  if (values.empty || !(values.high > 0.0)) values = {0.1, 1.0, false};
  const double high = round_up(values.high);
  const double low = std::clamp(values.low, high * std::pow(10.0, -kMaxDecades), high / 2.0);
  axis.high_ = std::log10(high);
  axis.low_ = std::log10(1.0 / round_up(1.0 / low));  // 1, 2, 5 x 10^n are their own reciprocals
  const bool few = axis.high_ - axis.low_ < kFewDecades;
  for (double decade = std::floor(axis.low_ - 1e-9); decade <= axis.high_ + 1e-9; ++decade)
    for (const double digit : {1.0, 2.0, 5.0}) {
      const double exponent = decade + std::log10(digit);
      if ((few || digit == 1.0) && exponent > axis.low_ - 1e-9 && exponent < axis.high_ + 1e-9)
        axis.ticks_.push_back(std::pow(10.0, exponent));
    }
  axis.logarithmic_ = true;
  axis.pixel_low_ = pixel_low;
  axis.pixel_high_ = pixel_high;
  return axis;
}

double Axis::operator()(double value) const {
  if (std::isnan(value)) return value;
  if (logarithmic_) value = value > 0.0 ? std::max(low_, std::log10(value)) : low_;
  return pixel_low_ + (value - low_) / (high_ - low_) * (pixel_high_ - pixel_low_);
}

std::string tick_label(double value) { return fmt::format("{:.6g}", std::abs(value) < 1e-12 ? 0.0 : value); }

std::string length_label(double value_m) {
  if (std::abs(value_m) < 1e-12) return "0";
  if (std::abs(value_m) < 0.00995) return fmt::format("{:.3g} mm", value_m * 1e3);
  if (std::abs(value_m) < 0.995) return fmt::format("{:.3g} cm", value_m * 1e2);
  return fmt::format("{:.6g} m", value_m);
}

void draw_axes(Svg& svg, const Axis& x, const Axis& y, const Eigen::Vector2d& top_left,
               const Eigen::Vector2d& bottom_right, std::string_view x_name, bool y_is_length) {
  std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>> grid;
  for (const double tick : x.ticks()) {
    grid.push_back({{x(tick), top_left.y()}, {x(tick), bottom_right.y()}});
    if (!x_name.empty()) svg.text({x(tick), bottom_right.y() + 16.0}, tick_label(tick), "tick", "middle");
  }
  for (const double tick : y.ticks()) {
    grid.push_back({{top_left.x(), y(tick)}, {bottom_right.x(), y(tick)}});
    svg.text({top_left.x() - 8.0, y(tick) + 4.0}, y_is_length ? length_label(tick) : tick_label(tick), "tick", "end");
  }
  svg.segments(grid, "gridline");
  svg.polyline(Points2d{{top_left.x(), bottom_right.y()}, bottom_right}, "baseline");
  svg.text({0.5 * (top_left.x() + bottom_right.x()), bottom_right.y() + 33.0}, x_name, "axis", "middle");
}

PlanView::PlanView(const std::vector<Points2d>& layers, double width, double max_height)
    : width_(width), height_(kMinPlanHeightPx) {
  Range x;
  Range y;
  for (const auto& layer : layers)
    for (const auto& p : layer)
      if (p.allFinite()) {
        x.include(p.x());
        y.include(p.y());
      }
  if (x.empty) return;
  center_ = {0.5 * (x.low + x.high), 0.5 * (y.low + y.high)};
  constexpr double kSmallestBox_m = 1.0;
  const double wide = std::max(x.high - x.low, kSmallestBox_m);
  const double tall = std::max(y.high - y.low, kSmallestBox_m);
  scale_ = std::min((width - 2.0 * kPlanMarginPx) / wide, (max_height - 2.0 * kPlanMarginPx) / tall);
  height_ = std::max(kMinPlanHeightPx, tall * scale_ + 2.0 * kPlanMarginPx);
}

Eigen::Vector2d PlanView::operator()(const Eigen::Vector2d& p) const {
  return {0.5 * width_ + scale_ * (p.x() - center_.x()), 0.5 * height_ - scale_ * (p.y() - center_.y())};
}

Points2d PlanView::operator()(const Points2d& points) const {
  Points2d out;
  out.reserve(points.size());
  for (const auto& p : points) out.push_back((*this)(p));
  return out;
}

double PlanView::scale_bar_m() const {
  constexpr double kShortestBarPx = 60.0;
  return round_up(kShortestBarPx / scale_);
}

void PlanView::draw_scale_bar(Svg& svg, std::string_view look) const {
  const double length_m = scale_bar_m();
  const Eigen::Vector2d left{12.0, height_ - 10.0};
  const Eigen::Vector2d right = left + Eigen::Vector2d(length_m * scale_, 0.0);
  const Eigen::Vector2d up{0.0, -5.0};
  svg.polyline(Points2d{left + up, left, right, right + up}, fmt::format("scalebar {}", look));
  svg.text(0.5 * (left + right) + Eigen::Vector2d(0.0, -6.0), length_label(length_m), fmt::format("tick {}", look),
           "middle");
}

std::string legend_html(const std::vector<LegendEntry>& entries) {
  std::string out = "<p class=\"legend\">";
  for (const auto& entry : entries)
    out += fmt::format(
        "<span><svg viewBox=\"0 0 26 10\" aria-hidden=\"true\"><path class=\"{}\" d=\"M1 5L25 5\"/></svg>{}</span>",
        entry.css_class, escape_xml(entry.label));
  return out + "</p>\n";
}

std::string colour_bar_html(std::string_view label, std::string_view words,
                            const std::vector<std::pair<double, std::string>>& ticks,
                            const std::function<std::string(double)>& colour) {
  constexpr double kLeft_px = 24.0, kBar_px = 300.0;
  constexpr int kSteps = 120;
  Svg svg(620.0, 38.0, label);
  for (int i = 0; i < kSteps; ++i)
    svg.rect({kLeft_px + kBar_px * i / kSteps, 6.0}, {kBar_px / kSteps + 0.6, 12.0}, "cell", {},
             colour((i + 0.5) / kSteps));
  for (const auto& [share, text] : ticks) svg.text({kLeft_px + kBar_px * share, 32.0}, text, "tick", "middle");
  svg.text({kLeft_px + kBar_px + 28.0, 16.0}, words, "tick");
  return "<div class=\"colourbar\">" + svg.str() + "</div>\n";
}

}  // namespace tutti::mission
