// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "tutti/base/result.hpp"
#include "tutti/formats/pyfg.hpp"

/// Reads multi-robot pose graphs as JRL (JSON Robot Log, github.com/DanMcGann/jrl), in which COSMO-Bench is published,
/// into the same values as PyFG. These parts of the format are read:
///   measurements: {"a": [{"stamp": ns, "measurements": [factor ..]} ..] ..}, what each robot had and when
///   groundtruth (optional): {"a": [{"key": .., "type": "Pose3", "translation": [x, y, z], "rotation": [w, x, y, z]}
///   ..]}
/// A factor has `type`, `covariance` (36 numbers, rotation first) and, as BetweenFactorPose3, key1, key2, measurement,
/// or, as PriorFactorPose3, key, prior. A key is GTSAM's symbol, letter << 56 | number; numbers from 1e9 on are no
/// poses. Stamps are taken as nanoseconds. A vertex is at the stamp of its prior or of the odometry that ends at it. A
/// closure that two robots have counts once, with the stamp of the first. Other factors, and files in CBOR, are
/// refused, because the rest would be another graph.
namespace tutti::formats {

/// Errors name file and place, as "g.jrl: measurements['a'][3].measurements[0].covariance: ..". Covariances that are
/// not positive semidefinite are treated as in PyFG.
Result<PyfgFile> parse_jrl(std::string_view text, const std::string& name);
/// True if the text begins as an object of JSON does.
bool looks_like_jrl(std::string_view text);

}  // namespace tutti::formats
