// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "tutti/evaluation/ate.hpp"
#include "tutti/model/trajectory.hpp"

namespace tutti::evaluation {

/// How well two estimates of one robot agree (the server's against the robot's corrected one): the ATE of `a` with `b`
/// as the reference, over the poses of equal stamps. No value when they have no stamp in common.
std::optional<AteResult> agreement(const Trajectory& a, const Trajectory& b);

}  // namespace tutti::evaluation
