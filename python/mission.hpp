// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "arrays.hpp"
#include "tutti/lab/mission_config.hpp"

namespace tutti::python {

/// A mission's file, or 'demo', with these settings; throws what Python shall see.
lab::MissionConfig mission_config(const PathLike& mission, const py::dict& settings);
/// The mission of what robots have recorded, {name: bag}.
lab::MissionConfig bags_config(const py::dict& bags, const py::dict& topics, const py::dict& settings);

}  // namespace tutti::python
