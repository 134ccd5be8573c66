// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/report/svg.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace tutti::mission {
namespace {

constexpr double kSimplifyPx = 0.15;
constexpr std::size_t kMaxPoints = 800;

/// 0.1 px, without a needless ".0" or "-0".
std::string px(double value) {
  const double rounded = std::round(value * 10.0) / 10.0;
  return fmt::format("{}", rounded == 0.0 ? 0.0 : rounded);
}

std::string xy(const Eigen::Vector2d& p) { return px(p.x()) + " " + px(p.y()); }

std::string tooltip(std::string_view title) {
  return title.empty() ? std::string() : fmt::format("<title>{}</title>", escape_xml(title));
}

/// Closes `tag`, with a tooltip inside when there is one.
std::string close(std::string_view tag, std::string_view title) {
  return title.empty() ? "/>\n" : fmt::format(">{}</{}>\n", tooltip(title), tag);
}

double distance_to_segment(const Eigen::Vector2d& p, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector2d ab = b - a;
  const double length2 = ab.squaredNorm();
  const double s = length2 > 0.0 ? std::clamp((p - a).dot(ab) / length2, 0.0, 1.0) : 0.0;
  return (p - a - s * ab).norm();
}

}  // namespace

std::string escape_xml(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      case '\n':
      case '\t':
        out += c;
        break;
      default:
        out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
    }
  }
  return out;
}

Points2d simplify(std::span<const Eigen::Vector2d> points, double tolerance) {
  if (points.size() < 3) return {points.begin(), points.end()};
  std::vector<bool> keep(points.size(), false);
  keep.front() = keep.back() = true;
  std::vector<std::pair<std::size_t, std::size_t>> todo{{0, points.size() - 1}};
  while (!todo.empty()) {
    const auto [first, last] = todo.back();
    todo.pop_back();
    double worst = tolerance;
    std::size_t split = 0;
    for (std::size_t i = first + 1; i < last; ++i) {
      const double distance = distance_to_segment(points[i], points[first], points[last]);
      if (distance > worst) {
        worst = distance;
        split = i;
      }
    }
    if (split == 0) continue;
    keep[split] = true;
    todo.emplace_back(first, split);
    todo.emplace_back(split, last);
  }
  Points2d out;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (keep[i]) out.push_back(points[i]);
  return out;
}

Strokes thinned(const Strokes& strokes) {
  constexpr std::size_t kMaxStrokes = 4000;
  if (strokes.size() <= kMaxStrokes) return strokes;
  Strokes out;
  for (std::size_t i = 0; i < kMaxStrokes; ++i) out.push_back(strokes[i * strokes.size() / kMaxStrokes]);
  return out;
}

Svg::Svg(double width, double height, std::string_view label) : width_(width), height_(height), label_(label) {}

void Svg::path(const std::string& data, std::string_view css_class, std::string_view title) {
  if (data.empty()) return;
  body_ += fmt::format("<path class=\"{}\" d=\"{}\"", css_class, data) + close("path", title);
}

void Svg::polyline(std::span<const Eigen::Vector2d> points, std::string_view css_class, std::string_view title) {
  std::string data;
  for (std::size_t first = 0; first < points.size();) {
    std::size_t last = first;
    while (last < points.size() && points[last].allFinite()) ++last;
    const auto original = points.subspan(first, last - first);
    Points2d run = simplify(original, kSimplifyPx);
    for (double tolerance = kSimplifyPx; run.size() > kMaxPoints; run = simplify(original, tolerance)) tolerance *= 1.5;
    for (std::size_t i = 0; i < run.size(); ++i) data.append(i == 0 ? "M" : "L").append(xy(run[i]));
    first = last + 1;
  }
  path(data, css_class, title);
}

void Svg::segments(std::span<const std::pair<Eigen::Vector2d, Eigen::Vector2d>> strokes, std::string_view css_class,
                   std::string_view title) {
  std::string data;
  for (const auto& [a, b] : strokes)
    if (a.allFinite() && b.allFinite()) data += fmt::format("M{}L{}", xy(a), xy(b));
  path(data, css_class, title);
}

void Svg::arcs(std::span<const std::pair<Eigen::Vector2d, Eigen::Vector2d>> strokes, std::string_view css_class,
               std::string_view title) {
  constexpr double kBend = 0.25;         // control point's distance from the stroke, as a share of its length,
  constexpr double kLargestBend = 44.0;  // but at most this: the arc itself goes half as far
  std::string data;
  for (const auto& [a, b] : strokes) {
    if (!a.allFinite() || !b.allFinite()) continue;
    const double bend = std::min(kBend, kLargestBend / std::max((b - a).norm(), 1e-9));
    const Eigen::Vector2d side(a.y() - b.y(), b.x() - a.x());
    data += fmt::format("M{}Q{} {}", xy(a), xy(0.5 * (a + b) + bend * side), xy(b));
  }
  path(data, css_class, title);
}

void Svg::dots(std::span<const Eigen::Vector2d> centers, std::string_view css_class) {
  std::string data;
  for (const auto& p : centers)
    if (p.allFinite()) data += fmt::format("M{}h0", xy(p));  // an empty stroke with round ends
  path(data, css_class, {});
}

void Svg::circle(const Eigen::Vector2d& center, double radius, std::string_view css_class, std::string_view title) {
  if (!center.allFinite()) return;
  body_ += fmt::format("<circle class=\"{}\" cx=\"{}\" cy=\"{}\" r=\"{}\"", css_class, px(center.x()), px(center.y()),
                       px(radius)) +
           close("circle", title);
}

void Svg::rect(const Eigen::Vector2d& corner, const Eigen::Vector2d& size, std::string_view css_class,
               std::string_view title, std::string_view fill) {
  if (!corner.allFinite() || !size.allFinite()) return;
  body_ += fmt::format("<rect class=\"{}\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"", css_class, px(corner.x()),
                       px(corner.y()), px(size.x()), px(size.y()));
  if (!fill.empty()) body_ += fmt::format(" fill=\"{}\"", fill);
  body_ += close("rect", title);
}

void Svg::image(const Eigen::Vector2d& corner, const Eigen::Vector2d& size, std::string_view uri) {
  body_ += fmt::format("<image x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" href=\"{}\"/>\n", px(corner.x()),
                       px(corner.y()), px(size.x()), px(size.y()), uri);
}

void Svg::text(const Eigen::Vector2d& position, std::string_view text, std::string_view css_class,
               std::string_view anchor) {
  if (!position.allFinite()) return;
  body_ += fmt::format("<text class=\"{}\" x=\"{}\" y=\"{}\" text-anchor=\"{}\">{}</text>\n", css_class,
                       px(position.x()), px(position.y()), anchor, escape_xml(text));
}

void Svg::vertical_text(const Eigen::Vector2d& position, std::string_view text, std::string_view css_class) {
  body_ += fmt::format("<text class=\"{}\" transform=\"translate({}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
                       css_class, xy(position), escape_xml(text));
}

std::string Svg::str() const {
  return fmt::format("<svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\">\n{}</svg>\n", px(width_), px(height_),
                     escape_xml(label_), body_);
}

}  // namespace tutti::mission
