// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/misfit_record.hpp"

#include <fmt/format.h>

#include "tutti/geometry/so3.hpp"

namespace tutti::mission {
namespace {

/// Roll, pitch, yaw about fixed axes, degrees, as LidarPoseConfig has them.
Eigen::Vector3d rpy_deg(const Eigen::Quaterniond& q) {
  const Eigen::Matrix3d R = q.toRotationMatrix();
  const double pitch = std::asin(std::clamp(-R(2, 0), -1.0, 1.0));
  return Eigen::Vector3d(std::atan2(R(2, 1), R(2, 2)), pitch, std::atan2(R(1, 0), R(0, 0))) / kRadPerDeg;
}

std::string to_paste(const fit::Misfit& misfit, const MissionRecording& recording) {
  const std::string robot = "--set robots." + recording.recording.name;
  const bool is_of_pose = misfit.kind == fit::MisfitKind::turned || misfit.kind == fit::MisfitKind::displaced ||
                          misfit.kind == fit::MisfitKind::upside_down;
  if (misfit.kind == fit::MisfitKind::clock && recording.scan_setup)
    return fmt::format(": {}.scan_time_offset_s={:.3f}", robot, recording.scan_setup->time_offset_s + misfit.value);
  if (!is_of_pose || !recording.scan_setup) return {};
  const Pose3 T_body_lidar = misfit.T_correction * recording.scan_setup->T_body_lidar;
  const Eigen::Vector3d& t = T_body_lidar.translation;
  const Eigen::Vector3d rpy = rpy_deg(T_body_lidar.rotation);
  return fmt::format(
      ": {0}.T_body_lidar.translation_m=[{1:.2f},{2:.2f},{3:.2f}] {0}.T_body_lidar.rpy_deg=[{4:.1f},{5:.1f},{6:.1f}]",
      robot, t.x(), t.y(), t.z(), rpy.x(), rpy.y(), rpy.z());
}

}  // namespace

MisfitRecord record_of(const fit::Misfit& misfit, const MissionRecording& recording) {
  const Timestamp begin = recording.recording.odometry.front().stamp;
  return {.kind = std::string(to_string(misfit.kind)),
          .says = to_string(misfit),
          .way_on = way_on(misfit) + to_paste(misfit, recording),
          .value = misfit.value,
          .sigma = misfit.sigma,
          .from_s = recording.start_s + (misfit.from - begin),
          .until_s = recording.start_s + (misfit.to - begin)};
}

void note_misfit(const fit::Misfit& misfit, std::vector<fit::Misfit>& all) {
  std::erase_if(all, [&](const fit::Misfit& before) {
    if (before.kind != misfit.kind) return false;
    return misfit.kind != fit::MisfitKind::stood_still || (before.from <= misfit.to && misfit.from <= before.to);
  });
  all.push_back(misfit);
}

}  // namespace tutti::mission
