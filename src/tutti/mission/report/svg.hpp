// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

/// Just enough SVG for the report: shapes with a CSS class (colours live in the page's style sheet, so that light and
/// dark work) and an optional tooltip. Pixels, y down, 0.1 px resolution. Shapes with a NaN or infinity are left out.
namespace tutti::mission {

using Points2d = std::vector<Eigen::Vector2d>;
using Strokes = std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>>;

/// For text and attributes of XML and HTML: the five special characters; control characters become spaces.
std::string escape_xml(std::string_view text);

/// Douglas-Peucker: a subset of the points, ends included, that stays within `tolerance` of all of them.
Points2d simplify(std::span<const Eigen::Vector2d> points, double tolerance);

/// Evenly picked, at most a few thousand: more would only darken the picture and swell the page.
Strokes thinned(const Strokes& strokes);

class Svg {
 public:
  /// `label` says what the picture shows, for those who cannot see it.
  Svg(double width, double height, std::string_view label);

  /// Simplified to 0.15 px, coarser when more than 800 points remain; breaks at points that are not finite.
  void polyline(std::span<const Eigen::Vector2d> points, std::string_view css_class, std::string_view title = {});
  /// Many separate strokes as one shape.
  void segments(std::span<const std::pair<Eigen::Vector2d, Eigen::Vector2d>> strokes, std::string_view css_class,
                std::string_view title = {});
  /// The same, each bent to one side, so that parallel strokes stay apart.
  void arcs(std::span<const std::pair<Eigen::Vector2d, Eigen::Vector2d>> strokes, std::string_view css_class,
            std::string_view title = {});
  /// Many dots as one shape; their size is the class's stroke width.
  void dots(std::span<const Eigen::Vector2d> centers, std::string_view css_class);
  void circle(const Eigen::Vector2d& center, double radius, std::string_view css_class, std::string_view title = {});
  /// `fill`: a colour that overrides the class, or empty.
  void rect(const Eigen::Vector2d& corner, const Eigen::Vector2d& size, std::string_view css_class,
            std::string_view title = {}, std::string_view fill = {});
  /// A picture, stretched; `uri` holds it all ("data:...").
  void image(const Eigen::Vector2d& corner, const Eigen::Vector2d& size, std::string_view uri);
  /// `anchor`: start, middle or end.
  void text(const Eigen::Vector2d& position, std::string_view text, std::string_view css_class,
            std::string_view anchor = "start");
  /// Turned to be read from below to above, centred.
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
