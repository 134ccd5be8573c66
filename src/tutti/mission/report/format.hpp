// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "tutti/mission/record.hpp"

/// How the report's figures are worded; shared by console and page.
namespace tutti::mission {

/// Three decimals with the unit, "-" when not measured or not finite: "0.013 m".
std::string format_metres(std::optional<double> value_m);
/// An error and the share of the way that it was scored on; in brackets when that makes it partial: "(0.013 m)".
std::string format_error(std::optional<double> value_m, std::optional<double> scored_share);
/// "100 %"; a partial share is rounded down; "-" when nothing was scored.
std::string format_scored(std::optional<double> scored_share);
/// An RMSE in a sentence: "0.013 m"; partial: "(0.013 m, partial: on 62 %)".
std::string format_rmse(const Accuracy& accuracy);
/// The same error, unless it is partial: then nothing, for a headline.
std::optional<double> for_headline(std::optional<double> value_m, std::optional<double> scored_share);
/// What the server's figures of a robot were scored on; without a reference, what the robot's distance to it was.
std::optional<double> server_share(const RobotRecord& robot);
/// Whether a figure of the report is in brackets.
bool has_partial_figures(const MissionRecord& record);
/// Long distances: "46 m", "1.21 km".
std::string format_distance(double value_m);
/// Three significant digits: "0.42 ms", "12.3 ms", "1.20 s".
std::string format_duration_ms(double value_ms);
/// Mission time: "42 s", "9 min 40 s", "1 h 02 min".
std::string format_mission_time(double value_s);
/// Powers of 1000: "812 B", "3.42 kB", "1.20 MB".
std::string format_bytes(double bytes);
/// "3.42 kB/s"
std::string format_rate(std::uint64_t bytes, double seconds);
/// "2.6 %"; "-" when the whole is 0.
std::string format_share(std::size_t part, std::size_t whole);

/// Middle and largest of some samples; none without samples. An even number of samples: mean of the two middle ones.
struct Spread {
  std::size_t count = 0;
  double median = 0.0;
  double max = 0.0;
};
std::optional<Spread> spread(std::span<const double> samples);
/// "12.3 / 45.0" (median / max); "-" without samples.
std::string format_spread(std::span<const double> samples);

/// "slip", "degeneracy", "failure".
std::string_view drift_name(DriftOrigin::Kind kind);

/// Sums of what the tables repeat.
struct ClosureCounts {
  std::size_t accepted_intra = 0;
  std::size_t accepted_inter = 0;
  std::size_t rejected_intra = 0;
  std::size_t rejected_inter = 0;
  [[nodiscard]] std::size_t accepted() const { return accepted_intra + accepted_inter; }
  [[nodiscard]] std::size_t rejected() const { return rejected_intra + rejected_inter; }
};
ClosureCounts count_closures(const ServerRecord& server);
/// Whom the figures of the joint map speak of: "all robots", or of several maps those of the largest: "alpha and
/// bravo".
std::string format_mapped_robots(const MissionRecord& record);
/// Whose odometry turns better than it says, in standard deviations, as a sentence; empty when nobody's does.
std::string format_surer_turns(std::span<const RobotRecord> robots);
/// What bundle adjustment made of the map, as sentences.
std::string format_refinement(const RefinementCounts& counts);

}  // namespace tutti::mission
