// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/graph_recording.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "support/formats/jrl.hpp"
#include "tutti/base/file.hpp"
#include "tutti/formats/pyfg.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::mission {
namespace graph_recording_test {

constexpr std::int64_t kEpoch = 1'670'403'892'357'527'971;

Pose3 ahead(double x_m) { return {Eigen::Quaterniond::Identity(), {x_m, 0.0, 0.0}}; }

RelativePose measured(const Pose3& T, double sigma) { return {T, sigma * sigma * Matrix6d::Identity()}; }

/// `robots` robots of four poses each, 1.3 s apart, the second robot half a second later; each goes 1 m a step and
/// turns.
formats::PyfgFile fleet(const std::string& robots) {
  formats::PyfgFile file;
  for (const char robot : robots)
    for (std::uint64_t k = 0; k < 4; ++k) {
      const std::int64_t ns = kEpoch + 1'300'000'001 * static_cast<std::int64_t>(k) + (robot == 'b' ? 500'000'000 : 0);
      const Pose3 pose{so3_exp({0, 0, 0.3 * static_cast<double>(k)}), {1.0 * static_cast<double>(k), robot * 1.0, 0.0}};
      file.vertices.push_back({{robot, k}, {ns}, pose, {}});
    }
  for (std::size_t v = 1; v < file.vertices.size(); ++v)
    if (v % 4 != 0)
      file.edges.push_back(
          {file.vertices[v].stamp, v - 1, v,
           measured(file.vertices[v - 1].pose->inverse() * *file.vertices[v].pose, 0.01 * static_cast<double>(v))});
  return file;
}

class GraphRecordingTest : public testing::Test {
 protected:
  GraphRecordingTest() { std::filesystem::create_directories(folder_); }
  ~GraphRecordingTest() override { std::filesystem::remove_all(folder_); }
  std::string path_of(const std::string& text) const {
    const std::string path = (folder_ / "g.pyfg").string();
    EXPECT_TRUE(write_file(path, text));
    return path;
  }
  [[nodiscard]] Result<GraphRecording> read(const formats::PyfgFile& file, const std::string& robot) const {
    return read_graph_recording(path_of(formats::to_pyfg(file)), robot);
  }
  [[nodiscard]] std::string message_of(const formats::PyfgFile& file, const std::string& robot) const {
    const auto recording = read(file, robot);
    return recording ? "no error" : recording.error().message;
  }
  std::filesystem::path folder_ = std::filesystem::path(testing::TempDir()) / fmt::format("graphs_{}", getpid());
};

TEST_F(GraphRecordingTest, OdometryIsAsItCameAndTheVerticesAreTheReference) {
  const formats::PyfgFile file = fleet("ab");
  const auto b = read(file, "b");
  ASSERT_TRUE(b) << b.error().message;
  ASSERT_EQ(b->odometry.size(), 4U);
  ASSERT_EQ(b->increment_covariance.size(), 3U);
  ASSERT_EQ(b->reference.size(), 4U);
  EXPECT_EQ(b->odometry[0].pose, Pose3{});  // whatever frame the truth has
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_EQ(b->odometry[k].stamp, file.vertices[4 + k].stamp);  // to the nanosecond, since 1970
    EXPECT_EQ(b->reference[k].pose, *file.vertices[4 + k].pose);
    if (k == 0) continue;
    EXPECT_LT(
        local(b->odometry[k - 1].pose.inverse() * b->odometry[k].pose, file.edges[2 + k].measurement.T_a_b).norm(),
        1e-12);
    EXPECT_EQ(b->increment_covariance[k - 1], file.edges[2 + k].measurement.covariance);
  }
  EXPECT_TRUE(b->closures.empty());
}

TEST_F(GraphRecordingTest, AnEdgeThatLeadsBackIsTheSameOdometry) {
  formats::PyfgFile file = fleet("a");
  const auto straight = read(file, "a");
  std::swap(file.edges[1].from, file.edges[1].to);
  file.edges[1].measurement = inverse(file.edges[1].measurement);
  const auto turned = read(file, "a");
  ASSERT_TRUE(turned);
  EXPECT_LT(local(straight->odometry[3].pose, turned->odometry[3].pose).norm(), 1e-12);
  EXPECT_LT((straight->increment_covariance[1] - turned->increment_covariance[1]).norm(), 1e-12);
}

TEST_F(GraphRecordingTest, EveryOtherEdgeIsAClosureOfOneRobot) {
  formats::PyfgFile file = fleet("ab");
  const auto add = [&](std::size_t from, std::size_t to, double delay_s, double sigma) {
    file.edges.push_back({file.vertices[to].stamp + delay_s, from, to, measured(ahead(sigma), sigma)});
  };
  add(0, 3, 0.0, 0.1);
  add(1, 6, 700.0, 0.2);
  add(6, 1, 3.0, 0.3);  // two of one pair of keyframes, one of which leads back
  add(1, 2, 5.0, 0.4);  // beside the odometry there
  const auto a = read(file, "a"), b = read(file, "b");
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->increment_covariance[1], file.edges[1].measurement.covariance);
  ASSERT_EQ(a->closures.size(), 2U);
  EXPECT_EQ(a->closures[0].from, "a");
  EXPECT_EQ(a->closures[0].from_stamp, file.vertices[0].stamp);
  EXPECT_EQ(a->closures[0].to_stamp, file.vertices[3].stamp);
  EXPECT_EQ(a->closures[1].to_stamp, file.vertices[2].stamp);
  ASSERT_EQ(b->closures.size(), 2U);
  EXPECT_EQ(b->closures[0].from, "a");
  EXPECT_EQ(b->closures[0].arrived, file.vertices[6].stamp + 700.0);
  EXPECT_EQ(b->closures[1].arrived, file.vertices[1].stamp + 3.0);
  EXPECT_LT(local(b->closures[1].measurement.T_a_b, ahead(-0.3)).norm(), 1e-12);
}

TEST_F(GraphRecordingTest, SaysWhatAGraphLacks) {
  formats::PyfgFile file = fleet("ab");
  EXPECT_NE(message_of(file, "c").find("has no robot 'c', expected one of a, b"), std::string::npos);
  file.edges.erase(file.edges.begin() + 1);
  EXPECT_NE(message_of(file, "a").find("no odometry from a1 to a2: expected a chain without gaps"), std::string::npos)
      << message_of(file, "a");
  EXPECT_EQ(message_of(file, "b"), "no error");
  file = fleet("ab");
  file.vertices[2].name.number = 9;
  file.vertices[3].name.number = 10;
  EXPECT_NE(message_of(file, "a").find("no odometry from a1 to a9"), std::string::npos) << message_of(file, "a");
  file = fleet("ab");
  file.edges[1].stamp = file.vertices[2].stamp = file.vertices[1].stamp;
  EXPECT_NE(message_of(file, "a").find("of a2 does not follow"), std::string::npos) << message_of(file, "a");
}

TEST_F(GraphRecordingTest, WithoutVerticesThereIsNoReference) {
  formats::PyfgFile file = fleet("ab");
  for (auto& vertex : file.vertices) vertex.pose.reset();
  const auto pyfg = read(file, "b");
  ASSERT_TRUE(pyfg) << pyfg.error().message;
  EXPECT_TRUE(pyfg->reference.empty());
  EXPECT_EQ(pyfg->odometry[2].stamp, fleet("ab").vertices[6].stamp);
  const auto jrl = read_graph_recording(path_of(formats::jrl_files::to_jrl(file, false)), "b");
  ASSERT_TRUE(jrl) << jrl.error().message;
  EXPECT_TRUE(jrl->reference.empty());
  EXPECT_EQ(jrl->odometry[0].stamp, fleet("ab").vertices[4].stamp);
}

MissionConfig config_of(const std::string& robots) {
  MissionConfig config;
  for (const char robot : robots)
    config.robots.push_back({.name = fmt::format("robot_{}", robot), .graph = {"g.pyfg", std::string(1, robot)}});
  return config;
}

TEST_F(GraphRecordingTest, RobotsOfAGraphShareItsClock) {
  path_of(formats::to_pyfg(fleet("ab")));
  MissionConfig config = config_of("ba");
  config.robots[1].start_s = 7.0;
  auto input = load_input(config, folder_, 1);
  ASSERT_TRUE(input) << input.error().message;
  EXPECT_NEAR(input->robots[0].start_s, 0.5, 1e-9);
  EXPECT_NEAR(input->robots[1].start_s, 7.0, 1e-9);
  config.robots[1].from_share = 0.5;
  config.robots[1].start_s = 0.0;
  input = load_input(config, folder_, 1);
  ASSERT_TRUE(input);
  EXPECT_NEAR(input->robots[1].start_s, 2.1, 1e-8);  // two steps of 1.3 s less half a second
  EXPECT_EQ(input->robots[1].recording.increment_covariance.at(0), fleet("ab").edges[2].measurement.covariance);
}

TEST_F(GraphRecordingTest, AGraphIsAMission) {
  const std::string path = path_of(formats::to_pyfg(fleet("ab")));
  const auto text = graph_mission("g.pyfg", folder_);
  ASSERT_TRUE(text) << text.error().message;
  for (const char* part : {"mission: g\n", "verifier: recorded", "name: a", "name: b"})
    EXPECT_NE(text->find(part), std::string::npos) << *text;
  EXPECT_FALSE(graph_mission("none.pyfg", folder_));
}

TEST(GraphMissions, AreWholeAndOfNothingElse) {
  MissionConfig config = config_of("ab");
  EXPECT_TRUE(problems_of(config).empty());
  config.robots[0].bag = "b";
  config.robots[1].graph.file = "";
  config.odometry_hz = 10.0;
  const auto problems = problems_of(config);
  const auto has = [&](const std::string& text) {
    return std::ranges::any_of(problems,
                               [&](const std::string& problem) { return problem.find(text) != std::string::npos; });
  };
  EXPECT_TRUE(has("robots.0.graph: given, and odometry, a bag"));
  EXPECT_TRUE(has("robots.1.graph.file: missing, but other robots are from a graph"));
  EXPECT_TRUE(has("odometry_hz: given, but the poses of a graph are its keyframes"));
}

}  // namespace graph_recording_test
}  // namespace tutti::mission
