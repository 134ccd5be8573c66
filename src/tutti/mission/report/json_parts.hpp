// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "tutti/geometry/pose3.hpp"
#include "tutti/mission/record.hpp"

/// Conversions to JSON that the files of missions and of `tutti compare` share.
namespace tutti::mission {

using Json = nlohmann::ordered_json;

/// The version of report.json and timing.json; keys are added without a new one.
constexpr int kReportFormat = 3;
/// The text of a file. Foreign text with broken UTF-8 must not make the writer throw.
std::string dump(const Json& json);
/// Rounded to 1 / per_unit, so that the shortest text that reads back the same is short; null unless finite.
Json number(std::optional<double> value, double per_unit = 1e6);
/// The cost of a map, of how many degrees of freedom, and from which start it was solved (server::MapEstimate).
Json optimum_json(double cost, std::size_t degrees_of_freedom, bool from_measurements);
/// [x, y, z]
Json vector_json(const Eigen::Vector3d& v);
/// {"translation_m", "quaternion_xyzw"}
Json pose_json(const Pose3& T);
Json fixes_json(const FixesRecord& fixes);

}  // namespace tutti::mission
