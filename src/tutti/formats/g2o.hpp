// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/model/pose_graph.hpp"

/// Pose graphs as g2o text: VERTEX_SE3:QUAT, EDGE_SE3:QUAT or VERTEX_SE2, EDGE_SE2; FIX lines name vertices whose poses
/// a solver must not move. TORO's VERTEX2, EDGE2, VERTEX3 and EDGE3 are read, too. One file is all SE(2) or all SE(3).
/// Lines of other kinds (priors, landmarks, parameters: any tag of capitals) are left out and counted. An edge that is
/// there twice to the digit, as where two robots' files both have it, counts once.
///
/// Information of an SE(3) edge is the upper triangle, row by row, in the tangent [translation; rotation vector] of
/// PoseGraphEdge, as GTSAM and SE-Sync read these files. g2o itself perturbs rotations by the vector part of a
/// quaternion, half the rotation vector, so g2o's chi2 of the same file weighs rotations four times less.
///
/// Some published graphs have information matrices with negative eigenvalues. Such a matrix is replaced by the nearest
/// positive semidefinite one in the Frobenius norm, in which negative eigenvalues become 0 (here 1e-9 of the largest
/// one, so that every direction stays determined), and counted. Negative eigenvalues below 1e-12 of the largest one are
/// rounding and stay. A matrix without a positive eigenvalue, or with a number that is not finite, is an error, because
/// nothing of it would be left.
///
/// SE(2) edges are lifted to SE(3): [x y theta] becomes [tx ty rz] with the information as given; tz gets the mean of
/// tx's and ty's, rx and ry that of rz (1 where that is zero), with no coupling to the plane. At planar poses the
/// residuals of tz, rx and ry and their gradient are zero, so the planar optimum and its chi2 stay what they were.
namespace tutti::formats {

struct G2oFile {
  PoseGraph graph;                       ///< Edges in file order.
  std::vector<std::int64_t> vertex_ids;  ///< Per entry of graph.poses its id, ascending.
  bool has_vertices = true;              ///< False: the file had no poses, and graph.poses were chained from its edges.
  bool is_2d = false;                    ///< The file was SE(2).
  std::vector<std::size_t> fixed;        ///< Positions in graph.poses of the vertices of FIX lines, ascending.
  std::size_t indefinite_edges = 0;      ///< Edges whose information was replaced.
  /// The worst ratio, among them, of the most negative to the largest eigenvalue of a matrix (positive).
  double worst_indefinite_share = 0.0;
  std::size_t repeated_edges = 0;               ///< Edges that were there before, to the digit.
  std::map<std::string, std::size_t> left_out;  ///< Lines that are not read, by their tags.
};
/// "32 x EDGE_SE3_PRIOR, 2 x PARAMS_SE3OFFSET"
std::string counted(const std::map<std::string, std::size_t>& left_out);

/// For each vertex, whether an edge joins it to the one before: without one, another robot begins there.
std::vector<bool> joined_to_previous(const G2oFile& graph);

/// Reads a pose graph; `name` stands for the text in errors, which name the line. Without VERTEX lines the smallest id
/// is placed at the origin and every other pose follows along the path that uses the fewest edges between
/// non-consecutive ids (along odometry, where that is complete); the graph must then be connected. With VERTEX lines
/// every edge must name known vertices, and several components are allowed.
Result<G2oFile> parse_g2o(std::string_view text, const std::string& name);
Result<G2oFile> read_g2o(const std::string& path);
/// Several files are one graph: one for each robot, where edges between robots are in one or both. A vertex that two of
/// them have must have one pose.
Result<G2oFile> read_g2o(std::span<const std::string> paths);
/// The same for who needs the edges alone: without VERTEX lines every pose is the identity, and the graph need not be
/// connected.
Result<G2oFile> parse_g2o_edges(std::string_view text, const std::string& name);
Result<G2oFile> read_g2o_edges(const std::string& path);

/// Text with VERTEX lines, whatever has_vertices is, and one FIX line per fixed vertex. SE(3) reads back bit for bit.
/// With is_2d only the planar part is written, as SE(2), exact but for the rounding of the angle.
std::string to_g2o(const G2oFile& file);
Status write_g2o(const std::string& path, const G2oFile& file);
/// Writes a graph as SE(3), with positions as ids.
Status write_g2o(const std::string& path, const PoseGraph& graph);

}  // namespace tutti::formats
