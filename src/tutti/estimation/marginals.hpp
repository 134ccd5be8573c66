// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "tutti/model/pose_graph.hpp"

namespace tutti::estimation {

/// Covariances of relative poses T_a_b = T_a^-1 T_b (right tangent) at the optimum `poses`, from the joint Gauss-Newton
/// Hessian of all edges: the exact blocks of its inverse, computed only on the pattern of the sparse factor (Takahashi,
/// Fagan, Chin 1973; blocked by supernodes). About the time of one factorisation for neighbouring pairs; each far pair
/// adds fill. `weights` scales each edge's information (empty: all 1).
/// Pairs in different components, or a graph that does not determine its poses: infinity on the diagonal. a == b: zero.
std::vector<Matrix6d> relative_covariances(const PoseGraph& graph, std::span<const Pose3> poses,
                                           std::span<const std::pair<std::size_t, std::size_t>> pairs,
                                           std::span<const double> weights = {});

}  // namespace tutti::estimation
