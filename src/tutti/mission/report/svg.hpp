// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

/// As much SVG as the report needs: shapes with a CSS class (colours are in the page's style sheet, which has a light
/// and a dark version) and an optional tooltip. Coordinates are pixels, y down, rounded to 0.1. Shapes with a NaN or
/// infinity are left out.
namespace tutti::mission {

using Points2d = std::vector<Eigen::Vector2d>;
using Strokes = std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>>;

/// Escapes the five special characters for text and attributes of XML and HTML; control characters become spaces.
std::string escape_xml(std::string_view text);

/// Douglas-Peucker: a subset of the points, including both ends, that stays within `tolerance` of all of them.
Points2d simplify(std::span<const Eigen::Vector2d> points, double tolerance);

/// Evenly chosen strokes, at most a few thousand, because more would only darken the picture and enlarge the page.
Strokes thinned(const Strokes& strokes);

/// One SVG picture; shapes that are added later are drawn on top.
class Svg {
 public:
  /// `label` says what the picture shows, for people who cannot see it.
  Svg(double width, double height, std::string_view label);

  /// A line, simplified to 0.15 px (coarser while more than 800 points remain) and broken at points that are not
  /// finite.
  void polyline(std::span<const Eigen::Vector2d> points, std::string_view css_class, std::string_view title = {});
  /// Many separate strokes as one shape.
  void segments(std::span<const std::pair<Eigen::Vector2d, Eigen::Vector2d>> strokes, std::string_view css_class,
                std::string_view title = {});
  /// The same, with each stroke bent to one side, so that parallel ones stay apart.
  void arcs(std::span<const std::pair<Eigen::Vector2d, Eigen::Vector2d>> strokes, std::string_view css_class,
            std::string_view title = {});
  /// Many dots as one shape; their size is the stroke width of the class.
  void dots(std::span<const Eigen::Vector2d> centers, std::string_view css_class);
  void circle(const Eigen::Vector2d& center, double radius, std::string_view css_class, std::string_view title = {});
  /// `fill` is a colour that overrides the class, or empty.
  void rect(const Eigen::Vector2d& corner, const Eigen::Vector2d& size, std::string_view css_class,
            std::string_view title = {}, std::string_view fill = {});
  /// A picture, stretched to `size`; `uri` contains it ("data:...").
  void image(const Eigen::Vector2d& corner, const Eigen::Vector2d& size, std::string_view uri);
  /// `anchor` is start, middle or end.
  void text(const Eigen::Vector2d& position, std::string_view text, std::string_view css_class,
            std::string_view anchor = "start");
  /// Centred text that reads from bottom to top.
  void vertical_text(const Eigen::Vector2d& position, std::string_view text, std::string_view css_class);

  [[nodiscard]] std::string str() const;

 private:
  void path(const std::string& data, std::string_view css_class, std::string_view title);
  std::string body_;
  double width_;
  double height_;
  std::string label_;
};

}  // namespace tutti::mission
