// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tutti/mission/record.hpp"
#include "tutti/mission/report/geometry.hpp"
#include "tutti/mission/report/plot.hpp"
#include "tutti/mission/report/raster.hpp"

/// Pictures of what the robots saw beside what is there, rasterised because they are of millions of points.
namespace tutti::mission {

/// One panel of a picture; all panels show the same place at the same scale.
struct MapPanel {
  std::string name;   ///< "onboard", "server", "survey" or "distance"
  std::string words;  ///< What it shows, in one short sentence.
  RgbaImage image;    ///< With kPixelRatio times the view's resolution.
};

/// A picture of several panels, and the view that they share.
struct MapPicture {
  PlanView view{{}, 1.0, 1.0};
  std::vector<MapPanel> panels;  ///< Empty when no robot of the largest component saw anything.
};

inline constexpr double kPixelRatio = 2.0;

/// From above: onboard, server and, where there is a survey, survey and distance to it.
MapPicture map_from_above(const MissionRecord& record);
/// The same in a vertical slice of kSliceThickness_m across the robots' routes.
MapPicture map_section(const MissionRecord& record);
inline constexpr double kSliceThickness_m = 1.0;

/// All panels as one image with names and a scale bar, for use outside the page.
RgbaImage compose(const MapPicture& picture, std::size_t columns);

/// A vertical plane through `centre` along the horizontal direction `along`, both in the view from above.
struct Slice {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  Eigen::Vector2d along = Eigen::Vector2d::UnitX();
  double length_m = 0.0;
};
/// The slice of this length that the routes cross at most places and as squarely as possible, because a cut through
/// several corridors or a junction shows more than one along a wall. Among equals, the one crossed most often. With
/// `shows`, which counts what there is to see in a slice, the one that shows most of those that are at least half as
/// busy: outdoors most cuts across a route show little but the ground below it.
Slice busiest_slice(const std::vector<Points2d>& routes, double length_m,
                    const std::function<std::size_t(const Slice&)>& shows = {});

/// The clouds of the robots of one component, in the joint map.
std::vector<CloudLayer> server_layers(const MissionRecord& record, std::uint32_t component);

/// Two opposite corners of the part of the clouds that is worth showing: without the outermost 1 % on every side, and
/// no farther from the routes than half their extent (at least 4 m), because a range sensor sees much farther than
/// robots go.
Points2d cloud_corners(const std::vector<CloudLayer>& clouds, const GroundPlane& ground,
                       const std::vector<Points2d>& routes);

}  // namespace tutti::mission
