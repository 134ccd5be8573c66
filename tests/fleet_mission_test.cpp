// SPDX-License-Identifier: BSD-3-Clause
// Fleets from pose graphs as missions: one of COSMO-Bench's (skipped without ../shared), and a simulated twin of its
// shape.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "support/formats/jrl.hpp"
#include "support/mission/fleet_graph.hpp"
#include "support/shared_data.hpp"
#include "tutti/base/file.hpp"
#include "tutti/formats/fleet_graph.hpp"
#include "tutti/lab/run_mission.hpp"
#include "tutti/mission/graph_recording.hpp"

namespace tutti::mission {
namespace fleet_mission_test {

struct FleetRun {
  MissionRecord record;
  formats::PyfgFile graph;
};

FleetRun run_fleet(const std::string& file, const std::filesystem::path& data,
                   const std::vector<std::string>& assignments = {}) {
  FleetRun out{.record = {}, .graph = formats::read_fleet_graph((data / file).string()).value()};
  const auto config = lab::parse_mission(graph_mission(file, data).value(), file, assignments);
  EXPECT_TRUE(config.has_value()) << config.error().message;
  if (!config) return out;
  auto record = lab::run_mission(*config, {.data = data});
  EXPECT_TRUE(record.has_value()) << record.error().message;
  if (record) out.record = std::move(*record);
  return out;
}

/// Mission time of each closure's arrival, in order.
std::vector<double> arrivals_of(const formats::PyfgFile& graph) {
  Timestamp begin = kLastTimestamp;
  for (const auto& vertex : graph.vertices) begin = std::min(begin, vertex.stamp);
  std::vector<double> out;
  for (const auto& edge : graph.edges)
    if (!formats::is_odometry(graph.vertices[edge.from].name, graph.vertices[edge.to].name))
      out.push_back(edge.stamp - begin);
  std::ranges::sort(out);
  return out;
}

/// At least so many closures do not join a submap of 10 s to itself.
std::size_t joining_submaps(const formats::PyfgFile& graph) {
  return static_cast<std::size_t>(std::ranges::count_if(graph.edges, [&](const formats::PyfgEdge& edge) {
    const auto &from = graph.vertices[edge.from], &to = graph.vertices[edge.to];
    return from.name.robot != to.name.robot || std::abs(to.stamp - from.stamp) > 25.0;
  }));
}

/// Checks what is true of every fleet, whatever is made of its closures.
void expect_the_graph(const FleetRun& run) {
  const auto& [record, graph] = run;
  std::size_t keyframes = 0;
  for (const RobotRecord& robot : record.robots) {
    keyframes += robot.keyframes;
    const auto first =
        std::ranges::find(graph.vertices, robot.name.front(), [](const auto& v) { return v.name.robot; });
    ASSERT_NE(first, graph.vertices.end());
    for (std::size_t k = 0; k < robot.odometry.size(); ++k)
      ASSERT_EQ(robot.odometry[k].stamp, (first + static_cast<std::ptrdiff_t>(k))->stamp) << robot.name << k;
    EXPECT_GT(robot.server.scored_share.value_or(0.0), 0.99) << robot.name;
  }
  EXPECT_EQ(keyframes, graph.vertices.size());
  const std::vector<double> arrivals = arrivals_of(graph);
  bool waits = false;
  for (const MapUpdateRecord& update : record.server.updates) {
    const auto known = std::ranges::upper_bound(arrivals, update.time_s + 1e-6) - arrivals.begin();
    EXPECT_LE(update.closures, static_cast<std::size_t>(known)) << "at " << update.time_s << " s";
    waits = waits || static_cast<std::size_t>(known) < arrivals.size();
  }
  EXPECT_TRUE(waits);
  std::size_t judged = record.server.closures.size();
  for (const RejectionRecord& refused : record.server.rejections) judged += refused.intra + refused.inter;
  EXPECT_LE(judged, arrivals.size());
  EXPECT_GE(judged, joining_submaps(graph));
}

class FleetTwin : public testing::Test {
 protected:
  FleetTwin() { std::filesystem::create_directories(folder_); }
  ~FleetTwin() override { std::filesystem::remove_all(folder_); }
  std::filesystem::path folder_ = std::filesystem::path(testing::TempDir()) / fmt::format("fleet_{}", getpid());
};

TEST_F(FleetTwin, IsAMissionFromItsOdometryToTheCorrectedRobots) {
  ASSERT_TRUE(formats::write_pyfg((folder_ / "twin.pyfg").string(), fleets::fleet_graph(1)));
  const FleetRun run = run_fleet("twin.pyfg", folder_, {"compare_policies=[every_node,spectral,skeleton]"});
  expect_the_graph(run);
  const MissionRecord& record = run.record;
  EXPECT_EQ(record.mission, "twin");
  ASSERT_EQ(record.robots.size(), 3U);
  EXPECT_EQ(record.robots[1].start_s, 7.0);
  EXPECT_EQ(record.server.components, 1U);
  ASSERT_TRUE(record.server.closure_check);
  EXPECT_EQ(record.server.closure_check->wrong, 0U);
  for (const RobotRecord& robot : record.robots) {
    ASSERT_EQ(robot.policies.size(), 4U);
    EXPECT_LT(*robot.server.rmse_m, 1.2 * *robot.perfect->rmse_m + 0.02) << robot.name;
    EXPECT_LT(*robot.server.rmse_m, 0.7 * *robot.onboard.rmse_m) << robot.name;
    EXPECT_LT(*find_policy(robot, record.default_policy)->accuracy.rmse_m, 1.1 * *robot.server.rmse_m + 0.02)
        << robot.name;
  }
}

TEST_F(FleetTwin, IsTheSameAsJrl) {
  const formats::PyfgFile graph = fleets::fleet_graph(2, 120.0);
  ASSERT_TRUE(formats::write_pyfg((folder_ / "twin.pyfg").string(), graph));
  ASSERT_TRUE(write_file((folder_ / "twin.jrl").string(), formats::jrl_files::to_jrl(graph)));
  const MissionRecord pyfg = run_fleet("twin.pyfg", folder_).record, jrl = run_fleet("twin.jrl", folder_).record;
  ASSERT_EQ(pyfg.robots.size(), jrl.robots.size());
  EXPECT_EQ(pyfg.server.closures.size(), jrl.server.closures.size());
  ASSERT_EQ(pyfg.server.updates.size(), jrl.server.updates.size());
  for (std::size_t r = 0; r < pyfg.robots.size(); ++r)
    EXPECT_NEAR(*pyfg.robots[r].server.rmse_m, *jrl.robots[r].server.rmse_m, 1e-6);
}

TEST_F(FleetTwin, OfOneRobotOrWithoutTruthRuns) {
  formats::PyfgFile graph = fleets::fleet_graph(3, 120.0);
  for (auto& vertex : graph.vertices) vertex.pose.reset();
  const auto is_of_others = [&](const formats::PyfgEdge& edge) {
    return graph.vertices[edge.from].name.robot != 'a' || graph.vertices[edge.to].name.robot != 'a';
  };
  std::erase_if(graph.edges, is_of_others);
  std::erase_if(graph.vertices, [](const auto& vertex) { return vertex.name.robot != 'a'; });
  ASSERT_TRUE(formats::write_pyfg((folder_ / "one.pyfg").string(), graph));
  const MissionRecord record = run_fleet("one.pyfg", folder_).record;
  ASSERT_EQ(record.robots.size(), 1U);
  EXPECT_EQ(record.robots[0].keyframes, graph.vertices.size());
  EXPECT_FALSE(record.robots[0].onboard.rmse_m);
  EXPECT_FALSE(record.server.closure_check);
}

TEST(RealFleets, TuhhIsAMission) {
  TUTTI_REQUIRE_SHARED("data/cosmo");
  const FleetRun run = run_fleet("tuhh_r3_00_day_wifi.pyfg", ::tutti::test::shared_path("data/cosmo"));
  expect_the_graph(run);
  const MissionRecord& record = run.record;
  EXPECT_EQ(record.server.components, 1U);
  double onboard = 0.0;
  for (const RobotRecord& robot : record.robots) onboard = std::max(onboard, robot.onboard.rmse_m.value_or(0.0));
  EXPECT_LT(record.server.joint.rmse_m.value_or(1e9), 1.5 * onboard);
}

}  // namespace fleet_mission_test
}  // namespace tutti::mission
