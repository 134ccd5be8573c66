// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "tutti/mission/record.hpp"
#include "tutti/mission/report/geometry.hpp"
#include "tutti/mission/report/plot.hpp"
#include "tutti/mission/report/raster.hpp"

/// What the robots saw, beside what is there: rasterised, because it is millions of points.
namespace tutti::mission {

/// One map; all panels of a picture show the same place at the same scale.
struct MapPanel {
  std::string name;   ///< "onboard", "server", "survey", "distance"
  std::string words;  ///< What is to be seen, one short sentence.
  Image image;        ///< kPixelRatio times as fine as the view.
};

struct MapPicture {
  PlanView view{{}, 1.0, 1.0};
  std::vector<MapPanel> panels;  ///< Empty when no robot of the largest component saw anything.
};

inline constexpr double kPixelRatio = 2.0;

/// Onboard, server and, where there is one, survey and distance to the survey, from above.
MapPicture map_from_above(const MissionRecord& record);
/// The same in a vertical slice, kSliceThickness_m thick, across the ways of the robots.
MapPicture map_section(const MissionRecord& record);
inline constexpr double kSliceThickness_m = 1.0;

/// All panels as one image with names and a scale bar, for use without the page.
Image compose(const MapPicture& picture, std::size_t columns);

/// A vertical plane: through `centre`, along the horizontal direction `along`, both in the view from above.
struct Slice {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  Eigen::Vector2d along = Eigen::Vector2d::UnitX();
  double length_m = 0.0;
};
/// The slice of this length that the routes cross, as squarely as may be, at most places: a cut through several
/// corridors or a junction shows more than one along a wall. Among equals, the one crossed most often.
Slice busiest_slice(const std::vector<Points2d>& routes, double length_m);

/// What the robots of one component saw, in the joint map.
std::vector<CloudLayer> server_layers(const MissionRecord& record, std::uint32_t component);

/// Two corners of the part of the clouds worth showing: all but the outermost 1 % on every side, and no farther from
/// the routes than half their size (at least 4 m). A range sensor sees far more than where the robots were.
Points2d cloud_corners(const std::vector<CloudLayer>& clouds, const GroundPlane& ground,
                       const std::vector<Points2d>& routes);

}  // namespace tutti::mission
