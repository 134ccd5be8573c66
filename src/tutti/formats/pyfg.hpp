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

/// Multi-robot pose graphs as PyFG text (PyFactorGraph, github.com/MarineRoboticsGroup), as COSMO-Bench's are handed
/// round. Lines that we read, stamps in seconds, quaternions x y z w:
///   VERTEX_SE3:QUAT stamp name x y z qx qy qz qw                     the true pose
///   VERTEX_SE3:QUAT:PRIOR stamp name 7 of the pose, 21 of its covariance
///   EDGE_SE3:QUAT stamp from to 7 of the pose, 21 of its covariance
/// A name is the letter of the robot and a number, A12. A covariance is the upper triangle, row by row, in the tangent
/// [translation; rotation vector] of RelativePose. Writers give it a fixed number of decimals, so small variances may
/// be 0 and matrices may come out indefinite: of these the nearest positive semidefinite one is taken (negative
/// eigenvalues become 0) and counted; one without a positive eigenvalue is refused unless it is 0. Landmarks and ranges
/// (VERTEX_XYZ, EDGE_SE3_XYZ, EDGE_RANGE) and graphs in the plane (SE2) are refused: a map without them is another one.
namespace tutti::formats {

struct PyfgName {
  char robot = 'A';
  std::uint64_t number = 0;
  friend auto operator<=>(const PyfgName&, const PyfgName&) = default;
};
std::string to_string(const PyfgName& name);

struct PyfgVertex {
  PyfgName name;
  Timestamp stamp;
  Pose3 pose;                  ///< T_world_body; in files of benchmarks the truth.
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
  std::vector<PyfgVertex> vertices;  ///< By name: robot after robot, each by number.
  std::vector<PyfgEdge> edges;       ///< In file order.
  std::size_t indefinite = 0;        ///< Covariances that had to be replaced.
};

/// Errors name file and line: another tag, column count, a name that is none, a vertex that comes twice or is not
/// there, values that are not finite, no unit quaternion, no covariance.
Result<PyfgFile> parse_pyfg(std::string_view text, const std::string& name);
Result<PyfgFile> read_pyfg(const std::string& path);
/// True if the first line that is no comment is of PyFG: a name stands where g2o has a number.
bool looks_like_pyfg(std::string_view text);

/// Reads back bit for bit, but for the covariance of priors, which is written as 1e-6 (m2, rad2).
std::string to_pyfg(const PyfgFile& file);
Status write_pyfg(const std::string& path, const PyfgFile& file);

}  // namespace tutti::formats
