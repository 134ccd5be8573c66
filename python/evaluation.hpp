// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "arrays.hpp"
#include "tutti/evaluation/ate.hpp"

namespace tutti::python {

/// How poses of two trajectories are paired: interpolated over gaps of at most `max_gap_s`, or with `max_difference_s`
/// by the nearest stamp.
evaluation::AssociationConfig association_of(double max_gap_s, std::optional<double> max_difference_s);

}  // namespace tutti::python
