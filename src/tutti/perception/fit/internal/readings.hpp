// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>

#include "tutti/model/trajectory.hpp"
#include "tutti/perception/fit/internal/motion_model.hpp"
#include "tutti/perception/fit/misfit.hpp"

namespace tutti::fit {

/// A way of reading odometry's poses: as they are, or as if a bridge had mixed something up.
struct Reading {
  std::optional<MisfitKind> kind;  ///< Nothing: as they are.
  Pose3 (*read)(const Pose3&) = nullptr;
};
std::span<const Reading> readings();
Trajectory read_as(const Reading& reading, const Trajectory& odometry);

/// Where a solution may begin for one reading: the clock's offset from a grid, with the best rotation and scale there.
struct Beginning {
  MotionModel model;
  Cost cost;
};
Beginning best_beginning(const WeighedSteps& weighed, const Trajectory& odometry);

}  // namespace tutti::fit
