// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <tuple>
#include <vector>

#include "tutti/perception/lidar/closure_config.hpp"
#include "tutti/perception/lidar/fft.hpp"
#include "tutti/perception/lidar/oriented_cloud.hpp"

namespace tutti::lidar {

/// A part of wall seen from above; level frame, relative to BirdsEyeView::centre.
struct WallCell {
  Eigen::Vector2f position;  ///< m
  Eigen::Vector2f normal;    ///< Mean horizontal normal of the cell's points, times the root of their number.
};

/// Key by which floors are looked up: column and row of a patch of two by two cells, and whether it is a floor or a
/// ceiling.
using FloorPatch = std::tuple<int, int, bool>;
FloorPatch floor_patch(const Eigen::Vector2f& position, bool faces_up, double cell_m);

/// A part of floor (its normal points up) or ceiling.
struct FloorCell {
  Eigen::Vector2f position;  ///< m, level frame, relative to BirdsEyeView::centre.
  float height;              ///< m, level frame.
  FloorPatch patch;
  [[nodiscard]] bool faces_up() const { return std::get<2>(patch); }
};

/// A submap seen from above, in cells.
struct BirdsEyeView {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< Mean position of the wall cells, level frame, m.
  std::vector<WallCell> walls;
  std::vector<FloorCell> floors;  ///< Sorted by patch.
};

/// Walls (normals within 20 degrees of horizontal) are summed in cells of cell_m / 2, floors and ceilings in cells of
/// `cell_m` and layers of 0.25 m. `cloud` is in the submap frame.
BirdsEyeView make_view(const OrientedCloud& cloud, const Eigen::Quaterniond& R_level_submap, double cell_m);

/// False for a view that shows hardly any walls and thus has no information.
bool has_enough_walls(const BirdsEyeView& view);

/// At most `count` directions in [0, pi), rad, that most wall faces or face away from, most first. They turn with the
/// submap and hardly depend on which of the walls were seen, so the yaw between two submaps of one place is the
/// difference of a direction of each, or half a turn more.
std::vector<double> wall_directions(const BirdsEyeView& view, int count);

/// A view turned so that one of its wall directions is the x axis, ready to be correlated.
struct TurnedView {
  double direction = 0.0;  ///< rad, level frame.
  ComplexImage spectrum;   ///< The wall normals' (x + i y), whitened; the sum of its squares is 1.
};

/// One turned view per wall direction; none when the view is empty. Whitening (all wavelengths count alike, down to
/// about four cells) makes what is special about a place, corners and niches, outweigh the long walls that all
/// corridors share (phase correlation, Kuglin and Hines 1975).
std::vector<TurnedView> turn_views(const BirdsEyeView& view, const CandidateConfig& config);

}  // namespace tutti::lidar
