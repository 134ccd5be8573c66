// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "tutti/evaluation/ate.hpp"
#include "tutti/model/trajectory.hpp"

namespace tutti::evaluation {

/// How well two estimates of the same robot agree where their stamps are equal (server against corrected robot): their
/// difference after one rigid alignment, with `b` in the role of the reference. Nothing when no stamp is in both.
std::optional<AteResult> agreement(const Trajectory& a, const Trajectory& b);

}  // namespace tutti::evaluation
