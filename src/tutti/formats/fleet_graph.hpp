// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "tutti/base/result.hpp"
#include "tutti/formats/g2o.hpp"
#include "tutti/formats/pyfg.hpp"

/// Reads pose graphs of several robots in any format.
namespace tutti::formats {

/// PyFG, JRL or g2o, as the file's content begins. A g2o graph has the robots that the letters of its symbol keys name,
/// or else one for each stretch of ids along which every vertex has an edge to the one before it ('a', 'b', ..). Poses
/// in g2o are where a solver begins, no truth, and are not read. Times are those of IN_stamps.csv, or else the n-th
/// pose of a robot is at n seconds. Errors name file and line.
Result<PyfgFile> read_fleet_graph(const std::string& path);

/// The same of a g2o graph that was read; `name` stands for it in errors.
Result<PyfgFile> as_fleet(const G2oFile& graph, const std::string& name);

}  // namespace tutti::formats
