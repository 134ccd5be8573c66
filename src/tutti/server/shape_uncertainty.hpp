// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <span>

#include "tutti/geometry/pose3.hpp"
#include "tutti/model/proxy_graph.hpp"

namespace tutti::server {

/// How sure the map is of the shape of one robot's trajectory through `poses` (T_world_body, at least one), from joint
/// samples of what they are off by: (6 poses) x samples, right tangents, zero mean (JointPosterior::samples), and from
/// what they would move by if any one closure were wrong: (6 poses) x closures, right tangents (largest_influences).
/// Each standard deviation is the samples' and the largest of those moves', as if the two were independent.
/// First order: a sample's rigid motion is the small one that fits its displacements best. What the poses do not
/// determine of it (a turn about the line they all lie on) moves none of them. Relative error of a sag: about
/// 1 / sqrt(2 samples).
ShapeUncertainty shape_uncertainty(const ChainId& chain, std::span<const Pose3> poses, const Eigen::MatrixXd& samples,
                                   const Eigen::MatrixXd& shifts = {});

}  // namespace tutti::server
