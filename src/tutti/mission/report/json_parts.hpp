// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>
#include <optional>

#include "tutti/geometry/pose3.hpp"

/// What the JSON files of a mission and of `tutti compare` write alike.
namespace tutti::mission {

using Json = nlohmann::ordered_json;

/// Rounded, so that the shortest text that reads back the same is also short; null unless finite.
Json number(std::optional<double> value, double per_unit = 1e6);
/// [x, y, z]
Json vector_json(const Eigen::Vector3d& v);
/// {"translation_m", "quaternion_xyzw"}
Json pose_json(const Pose3& T);

}  // namespace tutti::mission
