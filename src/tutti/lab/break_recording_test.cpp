// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/lab/break_recording.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string>

#include "tutti/lab/mission_config.hpp"
#include "tutti/lab/mission_input.hpp"
#include "tutti/robot/agent.hpp"

namespace tutti::lab {
namespace break_recording_test {

/// A robot says this to its own recording, a walk of 90 simulated seconds.
std::map<std::string, fit::Misfit> said_of(const std::vector<MistakeConfig>& mistakes, std::string* error = nullptr) {
  MissionConfig config;
  config.source = "simulation";
  config.simulation.sensors = "lidar";
  config.simulation.lidar.rays_share = 0.5;  // for the test's time
  config.simulation.world.network = {.rows = 2, .columns = 2, .block_m = 10.0, .jitter_m = 1.0};
  config.simulation.robots.resize(1);
  config.simulation.robots[0].walk.duration_s = 90.0;
  config.mistakes = mistakes;
  std::map<std::string, fit::Misfit> said;
  const auto input = load_input(config, {}, 1);
  if (!input) {
    if (error != nullptr) *error = input.error().message;
    return said;
  }
  const Recording& recording = input->robots.front().recording;
  robot::AgentConfig agent_config;
  agent_config.submap.has_scans = true;
  robot::RobotAgent agent(recording.robot, 1, agent_config);
  const auto collect = [&] {
    agent.take_outgoing();
    for (const fit::Misfit& misfit : agent.take_misfits()) said[std::string(to_string(misfit.kind))] = misfit;
  };
  std::size_t next_scan = 0;
  for (std::size_t k = 0; k < recording.odometry.size(); ++k) {
    const auto& [stamp, pose] = recording.odometry[k];
    const Matrix6d covariance = k == 0 ? Matrix6d(Matrix6d::Zero()) : recording.increment_covariance[k - 1];
    static_cast<void>(agent.add(OdometrySample{stamp, pose, covariance}));
    for (auto at = stamp_at(recording, recording.scan_stamps, next_scan); at && *at <= stamp;
         at = stamp_at(recording, recording.scan_stamps, ++next_scan)) {
      if (!agent.wants_scan(*at)) continue;
      if (const auto scan = recording.scans->scan(next_scan); scan && *scan) static_cast<void>(agent.add(**scan));
    }
    collect();
  }
  return said;
}

TEST(Mistakes, OfAnHonestRobotNothingIsSaid) {
  for (const auto& [kind, misfit] : said_of({})) ADD_FAILURE() << kind << ": " << to_string(misfit);
}

struct Expected {
  const char* mistake;
  fit::MisfitKind kind;
  double value, tolerance;
};

TEST(Mistakes, EachIsSaidWithItsKindAndSize) {
  using Kind = fit::MisfitKind;
  for (const Expected& expected : {Expected{"scans_late", Kind::clock, -0.6, 0.1},
                                   {"lidar_ahead", Kind::displaced, 4.0, 0.2},
                                   {"lidar_turned", Kind::turned, 5.0, 0.5},
                                   {"lidar_head_down", Kind::upside_down, 0.0, 1e9},
                                   {"mirrored", Kind::upside_down, 0.0, 1e9},
                                   {"millimetres", Kind::far_points, 5000.0, 4700.0},
                                   {"world_cloud", Kind::scans_stand_still, 0.0, 1e9},
                                   {"ned_positions", Kind::positions_ned, 0.0, 1e9},
                                   {"ned", Kind::upside_down, 0.0, 1e9},
                                   // far from the origin they deskew scans beyond recognition
                                   {"inverse_poses", Kind::unexplained, 0.9, 0.2},
                                   {"w_first", Kind::w_first, 0.0, 1e9},
                                   {"frozen", Kind::stood_still, 4.0, 2.0},
                                   {"drift", Kind::drift, 0.2, 0.06},
                                   {"scale", Kind::scale, 1.0 / 1.05, 0.015}}) {
    const auto said = said_of({{.robot = "alpha", .kind = expected.mistake}});
    const auto found = said.find(std::string(to_string(expected.kind)));
    std::string all;
    for (const auto& [kind, misfit] : said) all += "\n  " + to_string(misfit) + ": " + way_on(misfit);
    if (found == said.end())
      ADD_FAILURE() << expected.mistake << ", said is:" << all;
    else
      EXPECT_NEAR(found->second.value, expected.value, expected.tolerance) << expected.mistake << all;
    EXPECT_LE(said.size(), 1U) << expected.mistake << all;
  }
}

TEST(Mistakes, ARobotThatIsNotThereIsAnError) {
  std::string error;
  said_of({{.robot = "zulu", .kind = "frozen"}}, &error);
  EXPECT_NE(error.find("mistakes: no robot is called 'zulu'"), std::string::npos) << error;
}

TEST(Mistakes, HaveAName) {
  const auto known = parse_mission(
      "source: simulation\nsimulation: {sensors: lidar}\nmistakes: [{robot: alpha, kind: frozen}]\n", "m", {});
  EXPECT_TRUE(known) << known.error().message;
  const auto unknown = parse_mission("source: simulation\nmistakes: [{robot: alpha, kind: sleepy}]\n", "m", {});
  ASSERT_FALSE(unknown);
  EXPECT_NE(unknown.error().message.find("scans_late"), std::string::npos) << unknown.error().message;
}

}  // namespace break_recording_test
}  // namespace tutti::lab
