// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "tutti/geometry/pose3.hpp"
#include "tutti/model/proxy_graph.hpp"

namespace tutti::server {

/// Up to `most` pairs of one robot's nodes, `poses` (T_world_body), that the map knows at least twice as well relative
/// to each other as the way between them allows; those that it knows best compared with that, but none close to one
/// that is taken already (both ends within an eighth of the way). `steps[k]`: covariance of pose k relative to pose k -
/// 1 (right tangent, the first unused), taken as independent. `samples` and `shifts` as for shape_uncertainty(). One
/// half of the samples chooses the pairs and the other half says how well they are known, so that being chosen for a
/// small sigma does not make it smaller; fewer than 8 samples: no ties. About 200 evenly spread nodes are looked at.
std::vector<ShapeTie> shape_ties(std::span<const Pose3> poses, std::span<const Matrix6d> steps,
                                 const Eigen::MatrixXd& samples, const Eigen::MatrixXd& shifts, std::size_t most);

}  // namespace tutti::server
