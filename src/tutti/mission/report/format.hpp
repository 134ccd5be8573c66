// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "tutti/mission/record.hpp"

/// Turns the report's figures into text, for console and page.
namespace tutti::mission {

/// Three decimals with the unit: "0.013 m"; "-" when not measured or not finite.
std::string format_metres(std::optional<double> value_m);
/// An error; in brackets, "(0.013 m)", when the share of the distance that it was scored on makes it partial.
std::string format_error(std::optional<double> value_m, std::optional<double> scored_share);
/// Such as "100 %"; a partial share is rounded down, and "-" means that nothing was scored.
std::string format_scored(std::optional<double> scored_share);
/// The share on which the server's figures of a robot were scored; without a reference, the share for the distance
/// between the robot and the server.
std::optional<double> server_share(const RobotRecord& robot);
/// True if the report has figures in brackets.
bool has_partial_figures(const MissionRecord& record);
/// Long distances: "46 m", "1.21 km".
std::string format_distance(double value_m);
/// Three significant digits: "0.42 ms", "12.3 ms", "1.20 s".
std::string format_duration_ms(double value_ms);
/// Mission time: "42 s", "9 min 40 s", "1 h 02 min".
std::string format_mission_time(double value_s);
/// Powers of 1000: "812 B", "3.42 kB", "1.20 MB".
std::string format_bytes(double bytes);

/// The median and largest of some samples, for an even number the mean of the two middle ones.
struct Spread {
  std::size_t count = 0;
  double median = 0.0;
  double max = 0.0;
};
std::optional<Spread> spread(std::span<const double> samples);
/// Such as "12.3 / 45.0" (median / max); "-" without samples.
std::string format_spread(std::span<const double> samples);

/// "slip", "degeneracy" or "failure".
std::string_view drift_name(DriftOrigin::Kind kind);

/// Counts that several tables use.
struct ClosureCounts {
  std::size_t accepted_intra = 0;
  std::size_t accepted_inter = 0;
  std::size_t rejected_intra = 0;
  std::size_t rejected_inter = 0;
  [[nodiscard]] std::size_t accepted() const { return accepted_intra + accepted_inter; }
  [[nodiscard]] std::size_t rejected() const { return rejected_intra + rejected_inter; }
};
ClosureCounts count_closures(const ServerRecord& server);
/// The robots that the figures of the joint map are about: "all robots", or when there are several maps those in the
/// largest: "alpha and bravo".
std::string format_mapped_robots(const MissionRecord& record);
/// Which robots share a map, as "alpha + bravo; charlie"; empty where all do.
std::string format_maps(const MissionRecord& record);
/// A sentence on the robots whose odometry turns better than it states, in standard deviations; empty when there are
/// none.
std::string format_surer_turns(std::span<const RobotRecord> robots);
/// Sentences on what bundle adjustment did to the map.
std::string format_refinement(const RefinementCounts& counts);
/// Sentences on where on the earth the map lies, and what became of each robot's fixes.
std::string format_fixes(const FixesRecord& fixes);

}  // namespace tutti::mission
