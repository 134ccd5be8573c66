// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/model/pose_graph.hpp"

/// The lines of g2o and TORO files before edges are led to their vertices.
namespace tutti::formats::internal {

inline constexpr std::array<int, 3> kPlanarAxes = {0, 1, 5};  // x y theta within [tx ty tz rx ry rz]

struct G2oVertex {
  std::int64_t id = 0;
  Pose3 pose;
  std::string where;  ///< "FILE:LINE"
};
/// Edge between ids; PoseGraphEdge has positions.
struct G2oEdge {
  std::int64_t from = 0;
  std::int64_t to = 0;
  Pose3 T_from_to;
  Matrix6d information;
  std::string where;
};
struct G2oLines {
  std::vector<G2oVertex> vertices;
  std::vector<G2oEdge> edges;
  std::vector<std::int64_t> fixed;
  std::map<std::string, std::size_t> left_out;  ///< Lines of other kinds, by their tags.
  std::size_t indefinite_edges = 0;             ///< Information matrices that were not positive semidefinite.
  double worst_indefinite_share = 0.0;
  bool has_2d = false;
  bool has_3d = false;
};

/// Adds the lines of a file to `lines`; `name` stands for it in errors, which name the line.
Status read_g2o_lines(std::string_view text, const std::string& name, G2oLines& lines);

}  // namespace tutti::formats::internal
