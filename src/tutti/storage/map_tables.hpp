// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// The tables of a map's store (map_schema()).
namespace tutti::map_tables {

inline constexpr const char* kSubmaps = "submaps";      ///< Submaps as they came.
inline constexpr const char* kVerdicts = "verdicts";    ///< Verdicts with closures, by pair.
inline constexpr const char* kAnswers = "answers";      ///< The refusals of each job, and closures that are set aside.
inline constexpr const char* kDecisions = "decisions";  ///< Operators' decisions, by pair.
inline constexpr const char* kMeta = "meta";  ///< The map's own numbers, settings, robots, refinements, places.

}  // namespace tutti::map_tables
