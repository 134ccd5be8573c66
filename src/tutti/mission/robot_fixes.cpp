// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/robot_fixes.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tutti/formats/fix_file.hpp"

namespace tutti::mission {
namespace {

bool is_by_this_clock(const std::vector<PositionFix>& fixes, const Trajectory& odometry) {
  return std::ranges::any_of(fixes, [&](const PositionFix& fix) {
    return odometry.front().stamp <= fix.stamp && fix.stamp <= odometry.back().stamp;
  });
}

}  // namespace

Status take_measured(const RobotConfig& robot, const std::filesystem::path& data, const BagRecording* bag,
                     const Trajectory& odometry, MissionRecording& out) {
  std::string source, how;
  if (bag != nullptr) {
    source = bag->fix_topic;
    how = bag->fix_note;
    out.recording.measured = bag->measured;
  }
  if (!robot.fixes.empty()) {
    source = (data / robot.fixes).string();
    auto read = formats::read_fixes(source);
    if (!read) return tl::unexpected(read.error());
    for (PositionFix& fix : *read) {
      bags::AntennaSample sample{.measured = fix};
      how = ", of " + bags::place_antenna(sample, robot.p_body_antenna(), Pose3{});
      fix = std::get<PositionFix>(sample.measured);
    }
    set_measured(out.recording, *read);
  }
  const auto fixes = measured<PositionFix>(out.recording);
  if (fixes.empty()) return {};
  const bool fits = is_by_this_clock(fixes, odometry);
  const std::string stamps = fmt::format(
      "of its {} stamps, {} to {} ns, none is within the odometry's, {} to {} ns: are they by another clock?",
      fixes.size(), fixes.front().stamp.ns, fixes.back().stamp.ns, odometry.front().stamp.ns, odometry.back().stamp.ns);
  if (!fits && !robot.fixes.empty()) return fail(ErrorCode::invalid, "{}: {}", source, stamps);
  out.notes.push_back(fits ? fmt::format("{}: {} fixes of {}{}", robot.name, fixes.size(), source, how)
                           : fmt::format("{}: no fixes of {}: {}", robot.name, source, stamps));
  if (!fits) set_measured<PositionFix>(out.recording, {});
  return {};
}

}  // namespace tutti::mission
