// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/misfit_record.hpp"

#include <fmt/format.h>

#include "tutti/mission/mission_config.hpp"

namespace tutti::mission {

using ScanSetup = MissionRecording::ScanSetup;

std::optional<ScanSetup> corrected_setup(const fit::Misfit& misfit, const ScanSetup& stated) {
  if (misfit.by != fit::Witness::scans) return std::nullopt;
  ScanSetup out = stated;
  const bool is_of_pose = misfit.kind == fit::MisfitKind::turned || misfit.kind == fit::MisfitKind::displaced ||
                          misfit.kind == fit::MisfitKind::upside_down;
  if (misfit.kind == fit::MisfitKind::clock)
    out.time_offset_s += misfit.value;
  else if (is_of_pose)
    out.T_body_lidar = misfit.T_correction * stated.T_body_lidar;
  else
    return std::nullopt;
  return out;
}

std::string to_paste(const fit::Misfit& misfit, const MissionRecording& recording) {
  const auto setup = recording.scan_setup ? corrected_setup(misfit, *recording.scan_setup) : std::nullopt;
  if (!setup) return {};
  const std::string robot = "--set robots." + recording.recording.name;
  if (misfit.kind == fit::MisfitKind::clock)
    return fmt::format(": {}.scan_time_offset_s={:.3f}", robot, setup->time_offset_s);
  const Eigen::Vector3d& t = setup->T_body_lidar.translation;
  const Eigen::Vector3d rpy = to_rpy_deg(setup->T_body_lidar.rotation);
  return fmt::format(
      ": {0}.T_body_lidar.translation_m=[{1:.2f},{2:.2f},{3:.2f}] {0}.T_body_lidar.rpy_deg=[{4:.1f},{5:.1f},{6:.1f}]",
      robot, t.x(), t.y(), t.z(), rpy.x(), rpy.y(), rpy.z());
}

MisfitRecord record_of(const fit::Misfit& misfit, const MissionRecording& recording) {
  const Timestamp begin = recording.recording.odometry.front().stamp;
  const bool is_timed = misfit.to != Timestamp{};  // else it is true all the time
  const Timestamp from = is_timed ? misfit.from : begin;
  const Timestamp to = is_timed ? misfit.to : recording.recording.odometry.back().stamp;
  return {.kind = std::string(to_string(misfit.kind)),
          .says = to_string(misfit),
          .way_on = way_on(misfit) + to_paste(misfit, recording),
          .value = misfit.value,
          .sigma = misfit.sigma,
          .from_s = recording.start_s + (from - begin),
          .until_s = recording.start_s + (to - begin)};
}

std::string warning_of(const std::string& robot, const MisfitRecord& misfit) {
  return fmt::format("{}: by {:.0f} to {:.0f} s {}: {}", robot, misfit.from_s, misfit.until_s, misfit.says,
                     misfit.way_on);
}

void note_misfit(const fit::Misfit& misfit, std::vector<fit::Misfit>& all) {
  std::erase_if(all, [&](const fit::Misfit& before) { return are_one(before, misfit); });
  all.push_back(misfit);
}

}  // namespace tutti::mission
