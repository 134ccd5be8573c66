// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "arrays.hpp"

namespace tutti::python {

/// Turns {"submap.duration_s": 5} into "submap.duration_s=5"; values are written as YAML.
std::vector<std::string> to_assignments(const py::dict& settings);

}  // namespace tutti::python
