// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/lab/recorded_closures.hpp"

#include <gtest/gtest.h>

#include "tutti/lab/mission_config.hpp"

namespace tutti::lab {
namespace recorded_closures_test {

constexpr std::int64_t kEpoch = 1'670'403'892'357'527'971;

Timestamp at(std::int64_t s) { return {kEpoch + 1'000'000'000 * s}; }

/// There is a keyframe a second: submap n has those of 4 n to 4 n + 4.
Submap submap(std::uint32_t robot, std::uint32_t index) {
  Submap out{.id = {RobotId{robot}, index}};
  for (std::uint32_t k = 4 * index; k <= 4 * index + 4; ++k) out.keyframes.push_back({k, at(k), {}, false});
  out.odometry.resize(4);
  return out;
}

mission::RecordedClosure closure(const std::string& from, std::int64_t from_s, std::int64_t to_s,
                                 std::int64_t arrived_s) {
  return {.from = from,
          .from_stamp = at(from_s),
          .to_stamp = at(to_s),
          .measurement = {{Eigen::Quaterniond::Identity(), {1.0 * static_cast<double>(arrived_s), 0.0, 0.0}}},
          .arrived = at(arrived_s)};
}

/// Robots "a" and "b" of one graph, as 1 and 0.
RecordedClosureVerifier verifier_of(std::vector<mission::RecordedClosure> of_a,
                                    std::vector<mission::RecordedClosure> of_b) {
  std::vector<mission::MissionRecording> recordings(2);
  recordings[0].recording.robot = RobotId{1};
  recordings[1].recording.robot = RobotId{0};
  recordings[0].graph_robot = "a";
  recordings[1].graph_robot = "b";
  recordings[0].graph = recordings[1].graph = "g.pyfg";
  recordings[0].closures = std::move(of_a);
  recordings[1].closures = std::move(of_b);
  return RecordedClosureVerifier(recordings);
}

ClosureVerdict verdict_of(const RecordedClosureVerifier& verifier, const Submap& first, const Submap& second) {
  return *verifier.verify(first, second, server::MemoryPayloadStore());
}

TEST(RecordedClosures, JoinTheSubmapsOfTheirKeyframesInTheOrderOfArrival) {
  const auto verifier = verifier_of({}, {closure("a", 1, 6, 300), closure("a", 2, 6, 90), closure("a", 2, 30, 90)});
  ASSERT_TRUE(verifier.is_candidate(submap(0, 1), submap(1, 0)));
  const ClosureVerdict verdict = verdict_of(verifier, submap(0, 1), submap(1, 0));
  ASSERT_EQ(verdict.closures.size(), 2U);
  EXPECT_EQ(verdict.closures[0].from, (KeyframeId{RobotId{0}, 6}));
  EXPECT_EQ(verdict.closures[0].to, (KeyframeId{RobotId{1}, 2}));
  EXPECT_EQ(verdict.closures[0].measurement.T_a_b.translation.x(), -90.0);  // it leads in the opposite direction
  EXPECT_EQ(verifier.known_at(submap(0, 1), submap(1, 0)), (std::vector{at(90), at(300)}));
  for (const auto& [first, second] : {std::pair(submap(0, 0), submap(1, 0)), {submap(0, 1), submap(1, 1)}}) {
    EXPECT_FALSE(verifier.is_candidate(first, second));
    EXPECT_TRUE(verdict_of(verifier, first, second).refusal.has_value());
  }
}

TEST(RecordedClosures, AKeyframeThatTwoSubmapsShareCountsOnce) {
  const auto verifier = verifier_of({closure("a", 0, 8, 8), closure("a", 4, 12, 12)}, {});
  std::size_t found = 0;
  for (std::uint32_t first = 0; first < 4; ++first)
    for (std::uint32_t second = first + 1; second < 4; ++second)
      found += verdict_of(verifier, submap(1, first), submap(1, second)).closures.size();
  EXPECT_EQ(found, 2U);
  EXPECT_TRUE(verifier.is_candidate(submap(1, 0), submap(1, 1)));  // 0 and 8, a robot's very first keyframe,
  EXPECT_TRUE(verifier.is_candidate(submap(1, 0), submap(1, 2)));  // 4 and 12, perhaps its last
}

TEST(RecordedClosures, AreKnownWhenBothKeyframesAre) {
  const auto verifier = verifier_of({closure("a", 1, 6, 0)}, {});
  EXPECT_EQ(verifier.known_at(submap(1, 0), submap(1, 1)), std::vector{at(6)});
}

TEST(RecordedClosures, OfRobotsThatTheMissionLeavesOutAreLeftOut) {
  const auto verifier = verifier_of({closure("c", 1, 6, 6)}, {});
  for (std::uint32_t robot = 0; robot < 2; ++robot) EXPECT_FALSE(verifier.is_candidate(submap(robot, 0), submap(1, 1)));
}

std::string problem_of(const std::string& text) {
  const auto config = parse_mission(text, "mission", {});
  return config ? "none" : config.error().message;
}

TEST(RecordedClosures, NeedAGraphWhosePosesAreAllKeyframes) {
  const std::string graph = "robots: [{name: a, graph: {file: g.pyfg}}, {name: b, graph: {file: g.pyfg}}]\n";
  const auto config = parse_mission(graph + "closures: {verifier: recorded}\n", "mission", {});
  ASSERT_TRUE(config) << config.error().message;
  EXPECT_LT(config->agent.submap.keyframe_time_s, 1e-3);
  EXPECT_NE(problem_of("robots: [{name: a, odometry: {file: a.tum}}]\nclosures: {verifier: recorded}\n")
                .find("robots.0.graph.file: missing, but closures.verifier is 'recorded'"),
            std::string::npos);
  EXPECT_NE(problem_of("source: simulation\nclosures: {verifier: recorded}\n").find("source is 'simulation'"),
            std::string::npos);
  EXPECT_NE(problem_of(graph).find("closures.verifier is 'lidar'"), std::string::npos) << problem_of(graph);
  EXPECT_EQ(problem_of(graph + "closures: {verifier: reference}\n"), "none");
}

}  // namespace recorded_closures_test
}  // namespace tutti::lab
