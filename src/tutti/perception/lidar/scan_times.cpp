// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/scan_times.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

namespace tutti::lidar {
namespace {

constexpr std::array<std::pair<const char*, double>, 4> kUnits = {
    {{"s", 1.0}, {"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}}};
constexpr double kNearZero = 0.1;  // of the sweep: its first and last points may be missing
constexpr const char* kStateIt = "state robots[].scan_time_unit, or scans_deskewed: yes";

bool is_sweep(double duration_s) { return kShortestSweep_s <= duration_s && duration_s <= kLongestSweep_s; }

double seconds(Timestamp stamp) { return 1e-9 * static_cast<double>(stamp.ns); }

/// First and last of the times; an error unless all are numbers.
Result<std::pair<double, double>> range_of(const formats::TimedCloud& scan) {
  for (std::size_t i = 0; i < scan.times.size(); ++i)
    if (!std::isfinite(scan.times[i]))
      return fail(ErrorCode::invalid, "{} of point {} is {}, expected a time", scan.time_field, i, scan.times[i]);
  const auto [first, last] = std::ranges::minmax(scan.times);
  return std::pair(first, last);
}

/// Two times may be what rounding left of a clock's.
bool has_more_than_two(const std::vector<double>& times, double first, double last) {
  return std::ranges::any_of(times, [&](double time) { return time != first && time != last; });
}

PointTimes::Zero zero_of(double first_s, double last_s, Timestamp stamp) {
  const double margin_s = kNearZero * (last_s - first_s);
  if (std::abs(first_s) <= margin_s) return PointTimes::Zero::sweep_begin;
  if (std::abs(last_s) <= margin_s) return PointTimes::Zero::sweep_end;
  const bool is_near =
      std::abs(seconds(stamp) - first_s) < kLongestAge_s && std::abs(seconds(stamp) - last_s) < kLongestAge_s;
  return is_near ? PointTimes::Zero::odometry_clock : PointTimes::Zero::unknown;
}

/// One of `share` points may stray on either side, by more than so many times the span of the others.
struct Strays {
  std::size_t share;
  double spans;
};
/// A few that are as far away as a sweep is long; or many that are farther than any sweep is longer than the part of it
/// in which a LiDAR in the open sees nearly all of its points.
constexpr std::array<Strays, 2> kStrays = {{{50, 1.0}, {10, 30.0}}};

/// Times that are no strays, first and last.
std::pair<double, double> bounds_of(std::vector<double>& times, const Strays& strays) {
  const auto trimmed = static_cast<std::ptrdiff_t>(std::max<std::size_t>(1, times.size() / strays.share));
  std::ranges::nth_element(times, times.begin() + trimmed);
  const double low = times[static_cast<std::size_t>(trimmed)];
  std::ranges::nth_element(times, times.end() - 1 - trimmed);
  const double high = times[times.size() - 1 - static_cast<std::size_t>(trimmed)];
  const double most = high > low ? strays.spans * (high - low) : std::numeric_limits<double>::infinity();
  return {low - most, high + most};
}

}  // namespace

std::size_t drop_stray_times(formats::TimedCloud& scan) {
  constexpr std::size_t kFewest = 10;  // points
  const std::size_t count = scan.times.size();
  if (count < kFewest || scan.cloud.points.size() != count) return 0;
  std::vector<double> times = scan.times;
  if (!std::ranges::all_of(times, [](double time) { return std::isfinite(time); })) return 0;
  const auto [few_low, few_high] = bounds_of(times, kStrays[0]);
  const auto [many_low, many_high] = bounds_of(times, kStrays[1]);
  const double low = std::max(few_low, many_low), high = std::min(few_high, many_high);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (scan.times[i] < low || scan.times[i] > high) continue;
    scan.times[kept] = scan.times[i];
    scan.cloud.points[kept++] = scan.cloud.points[i];
  }
  scan.times.resize(kept);
  scan.cloud.points.resize(kept);
  return count - kept;
}

Result<std::optional<PointTimes>> find_point_times(formats::TimedCloud& scan, Timestamp stamp,
                                                   const ScanTimesConfig& config) {
  if (config.deskewed == "yes") return std::optional<PointTimes>{};
  const auto without = [&](const std::string& what) -> Result<std::optional<PointTimes>> {
    if (config.deskewed != "no") return std::optional<PointTimes>{};
    return fail(ErrorCode::invalid, "{}, but scans_deskewed is 'no'", what);
  };
  if (scan.times.empty()) return without("points carry no time");
  const std::size_t strays = drop_stray_times(scan);
  const auto range = range_of(scan);
  if (!range) return tl::unexpected(range.error());
  const auto [first, last] = *range;
  if (first == last) return without(fmt::format("all points have the same {}", scan.time_field));
  PointTimes times{.field = scan.time_field, .unit = config.unit, .strays = strays};
  for (const auto& [name, unit_s] : kUnits)
    if (config.unit == "auto" ? is_sweep(unit_s * (last - first)) : config.unit == name) {
      times.unit = name;
      times.unit_s = unit_s;
    }
  const double duration_s = times.unit_s * (last - first);
  if (times.unit == "auto" || !is_sweep(duration_s) || !has_more_than_two(scan.times, first, last))
    return fail(ErrorCode::invalid, "{} goes from {} to {}, expected a sweep of {} to {} s; {}", scan.time_field, first,
                last, kShortestSweep_s, kLongestSweep_s, kStateIt);
  times.zero = zero_of(times.unit_s * first, times.unit_s * last, stamp);
  times.pose_at_begin = config.pose_at == "begin";
  return times;
}

Result<std::optional<PointTimes>> find_message_times(formats::TimedCloud& scan, Timestamp stamp,
                                                     const ScanTimesConfig& config) {
  auto times = find_point_times(scan, stamp, config);
  if (!times || !*times || (*times)->zero == PointTimes::Zero::odometry_clock) return times;
  const auto [first, last] = std::ranges::minmax(scan.times);
  const double farthest_s = (*times)->unit_s * std::max(std::abs(first), std::abs(last));
  if (farthest_s > kLongestAge_s)
    return fail(ErrorCode::invalid,
                "{} goes from {} to {} {}, expected within {} s of 0 or of the stamp {} ns: a clock of its own? {}",
                (*times)->field, first, last, (*times)->unit, kLongestAge_s, stamp.ns, kStateIt);
  (*times)->zero = PointTimes::Zero::message;
  return times;
}

Result<std::vector<float>> point_ages(const formats::TimedCloud& scan, Timestamp stamp, const PointTimes& times) {
  if (scan.times.empty()) return fail(ErrorCode::invalid, "points carry no time, unlike those of other scans");
  const auto range = range_of(scan);
  if (!range) return tl::unexpected(range.error());
  const auto [first, last] = *range;
  if (times.unit_s * (last - first) > kLongestSweep_s)
    return fail(ErrorCode::invalid, "{} goes from {} to {} {}, expected a sweep of at most {} s", times.field, first,
                last, times.unit, kLongestSweep_s);
  double pose_s = times.unit_s * (times.pose_at_begin ? first : last);
  if (times.zero == PointTimes::Zero::odometry_clock) {
    pose_s = seconds(stamp);
  } else if (times.zero == PointTimes::Zero::message) {
    pose_s = 0.0;
  } else if (times.zero == (times.pose_at_begin ? PointTimes::Zero::sweep_begin : PointTimes::Zero::sweep_end)) {
    pose_s = 0.0;  // exact, also when the sweep's first or last points are missing
  }
  for (const double time : {first, last})
    if (const double age_s = pose_s - times.unit_s * time; std::abs(age_s) > kLongestAge_s)
      return fail(ErrorCode::invalid, "{} is {} {}, {} s before the pose, expected at most {} s before or after it",
                  times.field, time, times.unit, age_s, kLongestAge_s);
  std::vector<float> ages;
  ages.reserve(scan.times.size());
  for (const double time : scan.times) ages.push_back(static_cast<float>(pose_s - times.unit_s * time));
  return ages;
}

std::string in_words(const std::optional<PointTimes>& times) {
  if (!times) return "scans are taken as deskewed to the stamps of their poses";
  const auto zero = [&]() -> std::string {
    switch (times->zero) {
      case PointTimes::Zero::sweep_begin:
        return "since the sweep's begin";
      case PointTimes::Zero::sweep_end:
        return "until the sweep's end";
      case PointTimes::Zero::odometry_clock:
        return "by the odometry's clock";
      case PointTimes::Zero::message:
        return "after the message's stamp";
      case PointTimes::Zero::unknown:
        break;
    }
    return "by a clock of its own";
  };
  const bool is_stated = times->zero == PointTimes::Zero::odometry_clock || times->zero == PointTimes::Zero::message;
  return fmt::format(
      "scans are deskewed by the robot's odometry: their field '{}' is taken as {} {}{}{}", times->field, times->unit,
      zero(),
      is_stated ? "" : fmt::format(", their poses as of the sweep's {}", times->pose_at_begin ? "begin" : "end"),
      times->strays == 0 ? ""
                         : fmt::format("; points whose time is none of the sweep's are left out ({} in the first scan)",
                                       times->strays));
}

}  // namespace tutti::lidar
