// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/report/format.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace tutti::mission {
namespace {

/// Three significant digits without exponent, for 0 <= value < 1000.
std::string three_digits(double value) {
  if (value < 9.995) return fmt::format("{:.2f}", value);
  if (value < 99.95) return fmt::format("{:.1f}", value);
  return fmt::format("{:.0f}", value);
}

}  // namespace

std::string format_metres(std::optional<double> value_m) {
  return value_m && std::isfinite(*value_m) ? fmt::format("{:.3f} m", *value_m) : "-";
}

std::string format_error(std::optional<double> value_m, std::optional<double> scored_share) {
  const std::string value = format_metres(value_m);
  return is_partial(scored_share) && value != "-" ? "(" + value + ")" : value;
}

std::string format_scored(std::optional<double> scored_share) {
  if (!scored_share || !std::isfinite(*scored_share)) return "-";
  const double percent = 100.0 * *scored_share;
  return fmt::format("{:.0f} %", is_partial(scored_share) ? std::floor(percent) : percent);
}

std::optional<double> server_share(const RobotRecord& robot) {
  if (robot.server.scored_share || robot.server_estimate.empty()) return robot.server.scored_share;
  return robot.mapped_share;
}

bool has_partial_figures(const MissionRecord& record) {
  const auto partial = [](const Accuracy& accuracy) { return is_partial(accuracy.scored_share); };
  return std::ranges::any_of(record.robots, [&](const RobotRecord& robot) {
    return is_partial(server_share(robot)) || partial(robot.onboard) ||
           std::ranges::any_of(robot.policies, [&](const PolicyRecord& policy) { return partial(policy.accuracy); });
  });
}

std::string format_distance(double value_m) {
  if (!std::isfinite(value_m)) return "-";
  return value_m < 999.5 ? fmt::format("{:.0f} m", value_m) : fmt::format("{:.2f} km", value_m / 1000.0);
}

std::string format_duration_ms(double value_ms) {
  if (!std::isfinite(value_ms)) return "-";
  return value_ms < 999.5 ? three_digits(value_ms) + " ms" : fmt::format("{:.2f} s", value_ms / 1000.0);
}

std::string format_mission_time(double value_s) {
  if (!std::isfinite(value_s)) return "-";
  const auto seconds = static_cast<long long>(std::llround(value_s));
  if (seconds < 60) return fmt::format("{} s", seconds);
  if (seconds < 3600) return fmt::format("{} min {:02} s", seconds / 60, seconds % 60);
  return fmt::format("{} h {:02} min", seconds / 3600, seconds % 3600 / 60);
}

std::string format_bytes(double bytes) {
  if (!std::isfinite(bytes)) return "-";
  if (bytes < 999.5) return fmt::format("{:.0f} B", bytes);
  constexpr std::array<const char*, 4> kUnits{"kB", "MB", "GB", "TB"};
  std::size_t unit = 0;
  for (bytes /= 1000.0; bytes >= 999.5 && unit + 1 < kUnits.size(); ++unit) bytes /= 1000.0;
  return three_digits(bytes) + " " + kUnits[unit];
}

std::optional<Spread> spread(std::span<const double> samples) {
  if (samples.empty()) return std::nullopt;
  std::vector<double> sorted(samples.begin(), samples.end());
  std::sort(sorted.begin(), sorted.end());
  const std::size_t middle = sorted.size() / 2;
  const double median = sorted.size() % 2 == 1 ? sorted[middle] : 0.5 * (sorted[middle - 1] + sorted[middle]);
  return Spread{sorted.size(), median, sorted.back()};
}

std::string format_spread(std::span<const double> samples) {
  const auto s = spread(samples);
  return s ? fmt::format("{:.1f} / {:.1f}", s->median, s->max) : "-";
}

std::string_view drift_name(DriftOrigin::Kind kind) {
  switch (kind) {
    case DriftOrigin::Kind::slip:
      return "slip";
    case DriftOrigin::Kind::degeneracy:
      return "degeneracy";
    case DriftOrigin::Kind::failure:
      return "failure";
  }
  return "";
}

ClosureCounts count_closures(const ServerRecord& server) {
  ClosureCounts counts;
  for (const auto& closure : server.closures)
    ++(closure.from.chain.robot == closure.to.chain.robot ? counts.accepted_intra : counts.accepted_inter);
  for (const auto& rejection : server.rejections) {
    counts.rejected_intra += rejection.intra;
    counts.rejected_inter += rejection.inter;
  }
  return counts;
}

std::string format_mapped_robots(const MissionRecord& record) {
  if (record.server.components <= 1) return "all robots";
  std::vector<std::string> names;
  for (const RobotRecord& robot : record.robots)
    if (robot.component == record.server.largest_component && !robot.server_estimate.empty())
      names.push_back(robot.name);
  std::string out;
  for (std::size_t i = 0; i < names.size(); ++i)
    out += (i == 0 ? "" : i + 1 < names.size() ? ", " : " and ") + names[i];
  return out;
}

std::string format_maps(const MissionRecord& record) {
  std::map<std::uint32_t, std::string> robots;  // by component
  for (const RobotRecord& robot : record.robots)
    if (!robot.server_estimate.empty()) {
      std::string& names = robots[robot.component];
      names += (names.empty() ? "" : " + ") + robot.name;
    }
  if (robots.size() < 2) return "";
  std::string out;
  for (const auto& [component, names] : robots) out += (out.empty() ? "" : "; ") + names;
  return out;
}

std::string format_surer_turns(std::span<const RobotRecord> robots) {
  std::string names;
  for (const RobotRecord& robot : robots)
    if (robot.rotation_factor < 1.0)
      names += fmt::format("{}{} {:.1f} times", names.empty() ? "" : ", ", robot.name,
                           1.0 / std::sqrt(robot.rotation_factor));
  if (names.empty()) return "";
  return "Closures show that odometry turns better than it says (at least: " + names + "); the server counts it so.";
}

std::string format_refinement(const RefinementCounts& counts) {
  return fmt::format(
      "Bundle adjustment: {} views of {} landmarks at {} keyframes, {:.2f} px off before and {:.2f} px after (root "
      "mean "
      "square). Landmarks merged by a shared keyframe: {}, by closures: {}. Conflicts: {} of these had two positions "
      "and "
      "were triangulated again, {} were two things and taken apart; {} views that contradict and {} landmarks too "
      "uncertain were dropped.",
      counts.observations, counts.landmarks, counts.keyframes, counts.rms_before_px, counts.rms_after_px,
      counts.joined_by_keyframe, counts.joined_by_closure, counts.two_positions, counts.two_things,
      counts.views_contradicting, counts.landmarks_uncertain);
}

}  // namespace tutti::mission
