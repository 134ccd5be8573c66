// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/model/pose_graph.hpp"

/// Pose graphs as g2o text: VERTEX_SE3:QUAT, EDGE_SE3:QUAT or VERTEX_SE2, EDGE_SE2; FIX lines name vertices that the
/// solver leaves where they are. One file is all SE(2) or all SE(3).
///
/// Information of an SE(3) edge is the upper triangle, row by row, in the tangent [translation; rotation vector] of
/// PoseGraphEdge, as GTSAM and SE-Sync read these files. g2o itself perturbs rotations by the vector part of a
/// quaternion, half the rotation vector, so g2o's chi2 of the same file weighs rotations four times less.
///
/// Published graphs have information matrices with negative eigenvalues. The nearest positive semidefinite matrix is
/// taken instead (Frobenius norm: negative eigenvalues become 0, here 1e-9 of the largest, so that every direction
/// stays determined) and counted; eigenvalues within 1e-12 of the largest are rounding and stay. A matrix without a
/// positive eigenvalue, or with a number that is not finite, is refused: nothing of it would be left.
///
/// SE(2) edges are lifted to SE(3): [x y theta] becomes [tx ty rz] with the information as given; tz gets the mean of
/// tx's and ty's, rx and ry that of rz (1 where that is zero), with no coupling to the plane. At planar poses those
/// three residuals and their gradient are zero, so the planar optimum and its chi2 stay what they were.
namespace tutti::formats {

struct G2oFile {
  PoseGraph graph;                       ///< Edges in file order.
  std::vector<std::int64_t> vertex_ids;  ///< Of graph.poses, ascending.
  bool has_vertices = true;              ///< Poses were in the file; false: they were chained from its edges.
  bool is_2d = false;                    ///< SE(2), lifted.
  std::vector<std::size_t> fixed;        ///< Positions in graph.poses of the vertices of FIX lines, ascending.
  std::size_t indefinite_edges = 0;      ///< Whose information had to be replaced.
  double worst_indefinite_share = 0.0;   ///< Their most negative eigenvalue, over the largest of its matrix.
};

/// Without VERTEX lines the smallest id sits at the origin and every other pose follows along the path that uses the
/// fewest edges between non-consecutive ids (a plain walk when odometry is complete); the graph must then be connected.
/// With them, every edge must name known vertices and several components are fine.
Result<G2oFile> parse_g2o(std::string_view text, const std::string& name);
Result<G2oFile> read_g2o(const std::string& path);

/// Always with VERTEX lines, whatever has_vertices says, and one FIX line per fixed vertex. SE(3) reads back bit for
/// bit; is_2d writes the planar part as SE(2) (exact but for the rounding of the angle).
std::string to_g2o(const G2oFile& file);
Status write_g2o(const std::string& path, const G2oFile& file);
/// As SE(3), ids = positions.
Status write_g2o(const std::string& path, const PoseGraph& graph);

}  // namespace tutti::formats
