// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/misfit_record.hpp"

#include <gtest/gtest.h>

#include <cstdio>

#include "tutti/geometry/so3.hpp"
#include "tutti/mission/mission_config.hpp"

namespace tutti::mission {
namespace misfit_record_test {

MissionRecording bravo() {
  MissionRecording out;
  out.recording.name = "bravo";
  out.recording.odometry = {{Timestamp{} + 100.0, {}}};
  out.start_s = 5.0;
  out.scan_setup = {.T_body_lidar = {so3_exp({0.1, 0.0, 0.4}), {0.2, -0.1, 0.3}}, .time_offset_s = 0.2};
  return out;
}

/// Pasted, it makes the pose that the misfit asks for.
TEST(MisfitRecord, TheSettingToPasteIsTheCorrectedPose) {
  const MissionRecording recording = bravo();
  const fit::Misfit misfit{.kind = fit::MisfitKind::turned,
                           .T_correction = {so3_exp({0.3, -0.2, 1.5}), {0.5, 0.0, -0.1}}};
  const std::string way_on = record_of(misfit, recording).way_on;
  const std::size_t at = way_on.find("--set robots.bravo.T_body_lidar.translation_m=[");
  ASSERT_NE(at, std::string::npos) << way_on;
  LidarPoseConfig pasted{.translation_m = {0, 0, 0}, .rpy_deg = {0, 0, 0}};
  ASSERT_EQ(std::sscanf(way_on.c_str() + at,
                        "--set robots.bravo.T_body_lidar.translation_m=[%lf,%lf,%lf] "
                        "--set robots.bravo.T_body_lidar.rpy_deg=[%lf,%lf,%lf]",
                        &pasted.translation_m[0], &pasted.translation_m[1], &pasted.translation_m[2],
                        &pasted.rpy_deg[0], &pasted.rpy_deg[1], &pasted.rpy_deg[2]),
            6)
      << way_on;
  const Vector6d apart = local(misfit.T_correction * recording.scan_setup->T_body_lidar, to_pose(pasted).value());
  EXPECT_LT(apart.head<3>().norm(), 0.01);
  EXPECT_LT(apart.tail<3>().norm(), 0.1 * kRadPerDeg);
}

TEST(MisfitRecord, AClockIsCorrectedOnTopOfWhatIsSet) {
  const fit::Misfit misfit{
      .kind = fit::MisfitKind::clock, .value = -0.6, .from = Timestamp{} + 100.0, .to = Timestamp{} + 130.0};
  const MisfitRecord record = record_of(misfit, bravo());
  EXPECT_NE(record.way_on.find("add -0.600 to scan_time_offset_s"), std::string::npos) << record.way_on;
  EXPECT_NE(record.way_on.find("--set robots.bravo.scan_time_offset_s=-0.400"), std::string::npos) << record.way_on;
  EXPECT_EQ(record.from_s, 5.0);
  EXPECT_EQ(record.until_s, 35.0);
  MissionRecording live = bravo();
  live.scan_setup.reset();
  EXPECT_EQ(record_of(misfit, live).way_on.find("--set"), std::string::npos);
}

/// As of points in millimetres.
TEST(MisfitRecord, OneWithoutTimesIsOfTheWholeRecording) {
  MissionRecording recording = bravo();
  recording.recording.odometry.push_back({Timestamp{} + 130.0, {}});
  const MisfitRecord record = record_of({.kind = fit::MisfitKind::far_points, .value = 4000.0}, recording);
  EXPECT_EQ(record.from_s, 5.0);
  EXPECT_EQ(record.until_s, 35.0);
}

TEST(MisfitRecord, AKindIsKeptAsItWasSaidLastAndEachStandstillIs) {
  std::vector<fit::Misfit> all;
  const auto still = [](double from_s) {
    return fit::Misfit{
        .kind = fit::MisfitKind::stood_still, .from = Timestamp{} + from_s, .to = Timestamp{} + from_s + 5.0};
  };
  for (const double value : {0.1, 0.3}) note_misfit({.kind = fit::MisfitKind::drift, .value = value}, all);
  note_misfit(still(10.0), all);
  note_misfit(still(50.0), all);
  ASSERT_EQ(all.size(), 3U);
  EXPECT_EQ(all[0].value, 0.3);
  note_misfit(still(12.0), all);  // the first again, longer
  EXPECT_EQ(all.size(), 3U);
}

}  // namespace misfit_record_test
}  // namespace tutti::mission
