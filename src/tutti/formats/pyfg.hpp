// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/base/timestamp.hpp"
#include "tutti/model/relative_pose.hpp"

/// Reads and writes multi-robot pose graphs as PyFG text (PyFactorGraph, github.com/MarineRoboticsGroup), the format of
/// COSMO-Bench. Three kinds of lines are read, stamps in seconds, positions in m, quaternions x y z w:
///   VERTEX_SE3:QUAT stamp name x y z qx qy qz qw                     the true pose
///   VERTEX_SE3:QUAT:PRIOR stamp name 7 of the pose, 21 of its covariance
///   EDGE_SE3:QUAT stamp from to 7 of the pose, 21 of its covariance
/// A name is the letter of the robot and a number: A12. A covariance is the upper triangle, row by row, in the tangent
/// [translation; rotation vector] of RelativePose. Writers give it a fixed number of decimals, so small variances may
/// be 0 and a matrix may become indefinite; the nearest positive semidefinite one is then taken (negative eigenvalues
/// become 0) and counted. A matrix without a positive eigenvalue is refused unless it is 0. A file without any vertex
/// line has the vertices that edges between consecutive numbers of one robot name; their poses are unknown. Files with
/// landmarks or ranges (VERTEX_XYZ, EDGE_SE3_XYZ, EDGE_RANGE) and planar graphs (SE2) are refused, because the rest of
/// them would be another graph.
namespace tutti::formats {

struct PyfgName {
  char robot = 'A';
  std::uint64_t number = 0;
  friend auto operator<=>(const PyfgName&, const PyfgName&) = default;
};
std::string to_string(const PyfgName& name);
/// True of an edge between consecutive numbers of one robot.
bool is_odometry(const PyfgName& a, const PyfgName& b);

struct PyfgVertex {
  PyfgName name;
  Timestamp stamp;
  std::optional<Pose3> pose;   ///< T_world_body; in benchmarks the ground truth. Nothing: not in the file.
  std::optional<Pose3> prior;  ///< T_world_body of its PRIOR line, whose covariance is checked and not kept.
  friend bool operator==(const PyfgVertex&, const PyfgVertex&) = default;
};

struct PyfgEdge {
  Timestamp stamp;
  std::size_t from = 0;  ///< Positions in PyfgFile::vertices.
  std::size_t to = 0;
  RelativePose measurement;  ///< T_from_to
  friend bool operator==(const PyfgEdge&, const PyfgEdge&) = default;
};

struct PyfgFile {
  std::vector<PyfgVertex> vertices;             ///< Sorted by name: by robot, then by number.
  std::vector<PyfgEdge> edges;                  ///< In file order.
  std::size_t indefinite = 0;                   ///< Covariances that were replaced.
  std::string stamps_from = "of the vertices";  ///< For people: where the vertices' stamps are from.
};

/// Errors name file and line: an unknown tag, a wrong column count, a bad name, a vertex that is missing or comes
/// twice, a number that is not finite, a quaternion that is not of unit norm, a covariance that is none.
Result<PyfgFile> parse_pyfg(std::string_view text, const std::string& name);
Result<PyfgFile> read_pyfg(const std::string& path);
/// True if the first line that is no comment has a name where g2o has a number.
bool looks_like_pyfg(std::string_view text);

/// When each vertex was, and how that is known, for people.
struct PyfgTimes {
  std::vector<Timestamp> stamps;
  std::string from;
};
/// The stamps of the vertices, or of the odometry that ends at them, which benchmarks give instead. Nothing when
/// neither are times (are_times() in graph_stamps.hpp).
std::optional<PyfgTimes> times_of(const PyfgFile& file);

/// Text that reads back bit for bit, if all vertices have a pose. Priors are written with a covariance of 1e-6 (m^2,
/// rad^2).
std::string to_pyfg(const PyfgFile& file);
Status write_pyfg(const std::string& path, const PyfgFile& file);

}  // namespace tutti::formats
