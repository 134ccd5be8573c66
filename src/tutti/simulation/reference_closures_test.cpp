// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/reference_closures.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <thread>

#include "tutti/geometry/symmetric.hpp"
#include "tutti/simulation/recordings.hpp"

namespace tutti::simulation {
namespace reference_closures_test {

/// Submaps of 10 s cut from the reference: keyframes every second, one shared with the previous submap.
std::vector<Submap> cut_submaps(const Recording& recording) {
  std::vector<Submap> submaps;
  Submap submap{.id = {recording.robot, 0}};
  std::uint32_t index = 0;
  for (std::size_t k = 0; k < recording.odometry.size(); k += 8) {
    submap.keyframes.push_back({index++, recording.odometry[k].stamp, recording.odometry[k].pose, true});
    if (submap.keyframes.size() < 11) continue;
    const Keyframe last = submap.keyframes.back();
    submaps.push_back(submap);
    submap = {.id = {recording.robot, submap.id.index + 1}, .keyframes = {last}};
  }
  return submaps;
}

struct Mission {
  std::map<RobotId, Trajectory> reference;
  std::vector<Submap> submaps;
};

Mission make_mission(std::uint64_t seed, double duration_s) {
  SimulationConfig config;
  for (SimulatedRobotConfig& robot : config.robots) robot.walk.duration_s = duration_s;
  Mission mission;
  const auto world = simulate_recordings(config, {1'000'000'000}, seed);
  for (const Recording& recording : world->recordings) {
    mission.reference[recording.robot] = recording.reference;
    const auto submaps = cut_submaps(recording);
    mission.submaps.insert(mission.submaps.end(), submaps.begin(), submaps.end());
  }
  return mission;
}

const Mission& shared_mission() {
  static const Mission mission = make_mission(3, 900.0);
  return mission;
}

std::vector<ClosureVerdict> all_verdicts(const ReferenceClosures& verifier, const std::vector<Submap>& submaps) {
  std::vector<ClosureVerdict> verdicts;
  for (std::size_t i = 0; i < submaps.size(); ++i)
    for (std::size_t j = i + 1; j < submaps.size(); ++j) verdicts.push_back(verifier.verify(submaps[i], submaps[j]));
  return verdicts;
}

Timestamp stamp_of(const Mission& mission, KeyframeId id) {
  for (const Submap& submap : mission.submaps)
    for (const Keyframe& keyframe : submap.keyframes)
      if (submap.id.chain == id.chain && keyframe.index == id.index) return keyframe.stamp;
  ADD_FAILURE() << "no keyframe " << id.chain.robot.value << "/" << id.index;
  return {};
}

/// measured = true * error
Pose3 error_of(const ReferenceClosures& verifier, const Mission& mission, const LoopClosure& closure) {
  const auto truth = verifier.true_relative_pose(closure.from.chain.robot, stamp_of(mission, closure.from),
                                                 closure.to.chain.robot, stamp_of(mission, closure.to));
  return truth->inverse() * closure.measurement.T_a_b;
}

bool is_wrong(const Pose3& error) { return error.translation.norm() > 0.5 || rotation_angle(error) > 0.05; }

TEST(ReferenceClosures, EachSubmapIsPlacedOnceHoweverManyPairsItIsIn) {
  const Mission mission = make_mission(5, 120.0);
  const ReferenceClosures verifier(mission.reference, {}, 1);
  const auto verdicts = all_verdicts(verifier, mission.submaps);
  EXPECT_EQ(verifier.submaps_placed(), mission.submaps.size());
  for (std::size_t i = 0; i + 1 < mission.submaps.size(); ++i)
    EXPECT_EQ(verifier.verify(mission.submaps[i], mission.submaps[i + 1]),
              ReferenceClosures(mission.reference, {}, 1).verify(mission.submaps[i], mission.submaps[i + 1]));
  EXPECT_EQ(verifier.submaps_placed(), mission.submaps.size());
  Submap other = mission.submaps[1];  // under an id that is known
  other.id = mission.submaps[0].id;
  EXPECT_EQ(verifier.verify(other, mission.submaps.back()),
            ReferenceClosures(mission.reference, {}, 1).verify(other, mission.submaps.back()));
}

TEST(ReferenceClosures, TheAskedShareIsWrongAndTheRestIsAsGoodAsItsCovariance) {
  const Mission& mission = shared_mission();
  ReferenceClosureConfig config;
  config.wrong_share = 0.2;
  double reports = 0.0, wrong = 0.0, wrong_distant = 0.0, squared = 0.0;
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    const ReferenceClosures verifier(mission.reference, config, seed);
    for (const ClosureVerdict& verdict : all_verdicts(verifier, mission.submaps)) {
      ASSERT_EQ(verdict.closures.empty(), verdict.refusal.has_value());
      if (verdict.closures.empty()) continue;
      ASSERT_EQ(verdict.closures.size(), 1U);
      const LoopClosure& closure = verdict.closures.front();
      const Pose3 error = error_of(verifier, mission, closure);
      reports += 1.0;
      if (is_wrong(error)) {
        wrong += 1.0;
        if (error.translation.norm() > config.radius_m + kWrongMost_m) wrong_distant += 1.0;
        continue;
      }
      const Vector6d e = local(Pose3{}, error);
      squared += squared_distance(e, closure.measurement.covariance) / 6.0;
    }
  }
  ASSERT_GT(reports, 500.0);
  EXPECT_NEAR(wrong / reports, 0.2, 0.04);
  EXPECT_NEAR(wrong_distant / wrong, 0.5, 0.15);
  EXPECT_NEAR(squared / (reports - wrong), 1.0, 0.1);
}

TEST(ReferenceClosures, WithoutWrongOnesAllOverlapsAndOnlyTheseAreReported) {
  const Mission& mission = shared_mission();
  ReferenceClosureConfig config;
  config.wrong_share = 0.0;
  config.per_pair = 3;
  const ReferenceClosures verifier(mission.reference, config, 1);
  std::size_t several = 0, between_robots = 0, of_one_robot = 0;
  for (const ClosureVerdict& verdict : all_verdicts(verifier, mission.submaps)) {
    EXPECT_LE(verdict.closures.size(), 3U);
    if (verdict.closures.size() > 1) ++several;
    std::set<std::uint32_t> from, to;
    for (const LoopClosure& closure : verdict.closures) {
      EXPECT_FALSE(is_wrong(error_of(verifier, mission, closure)));
      EXPECT_LT(closure.measurement.T_a_b.translation.norm(), config.radius_m + 5.0 * config.sigma_m);
      EXPECT_TRUE(from.insert(closure.from.index).second);
      EXPECT_TRUE(to.insert(closure.to.index).second);
      EXPECT_EQ(closure.from.chain.robot, verdict.pair.first.chain.robot);
      EXPECT_EQ(closure.to.chain.robot, verdict.pair.second.chain.robot);
    }
    if (verdict.closures.empty()) continue;
    ++(verdict.pair.first.chain.robot == verdict.pair.second.chain.robot ? of_one_robot : between_robots);
  }
  EXPECT_GT(several, 20U);
  EXPECT_GT(between_robots, 20U);
  EXPECT_GT(of_one_robot, 20U);
}

TEST(ReferenceClosures, SomeWrongClosuresAgree) {
  const Mission& mission = shared_mission();
  ReferenceClosureConfig config;
  config.wrong_share = 0.3;
  config.distant_share = 1.0;
  config.agreeing_share = 1.0;
  const ReferenceClosures verifier(mission.reference, config, 1);
  // Wrong closures of one look-alike claim one and the same displacement between the two places.
  std::map<std::pair<SubmapId, SubmapId>, std::vector<Pose3>> claims;
  for (const ClosureVerdict& verdict : all_verdicts(verifier, mission.submaps)) {
    if (verdict.closures.empty()) continue;
    const LoopClosure& closure = verdict.closures.front();
    if (!is_wrong(error_of(verifier, mission, closure))) continue;
    const Pose3 from = *verifier.true_relative_pose(RobotId{0}, mission.submaps.front().keyframes.front().stamp,
                                                    closure.from.chain.robot, stamp_of(mission, closure.from));
    const Pose3 to = *verifier.true_relative_pose(RobotId{0}, mission.submaps.front().keyframes.front().stamp,
                                                  closure.to.chain.robot, stamp_of(mission, closure.to));
    const SubmapId first{verdict.pair.first.chain.robot, verdict.pair.first.index / 2};
    const SubmapId second{verdict.pair.second.chain.robot, verdict.pair.second.index / 2};
    claims[{first, second}].push_back(from * closure.measurement.T_a_b * to.inverse());
  }
  std::size_t groups = 0;
  for (const auto& [block, group] : claims) {
    if (group.size() > 1) ++groups;
    for (const Pose3& claim : group) {
      EXPECT_LT(rotation_angle(group.front().inverse() * claim), 0.08);
    }
  }
  EXPECT_GT(groups, 5U);
}

RC_GTEST_PROP(ReferenceClosures, DependOnThePairOnly, ()) {
  const Mission& mission = shared_mission();
  const auto seed = *rc::gen::arbitrary<std::uint64_t>();
  const ReferenceClosures one(mission.reference, {}, seed);
  const ReferenceClosures other(mission.reference, {}, seed);
  for (int i = 0; i < 50; ++i) {
    const Submap& a = mission.submaps[*rc::gen::inRange<std::size_t>(0, mission.submaps.size())];
    const Submap& b = mission.submaps[*rc::gen::inRange<std::size_t>(0, mission.submaps.size())];
    const ClosureVerdict verdict = one.verify(a, b);
    RC_ASSERT(verdict == other.verify(b, a));
    RC_ASSERT(!(verdict.pair.second < verdict.pair.first));
    RC_ASSERT(one.is_candidate(a, b) == !verdict.closures.empty());
  }
}

TEST(ReferenceClosures, GateHeadingAndTime) {
  // There and back again on one line: 50 s out, 50 s back, facing the opposite direction.
  Trajectory line;
  for (int k = 0; k <= 100; ++k) {
    const double x = k <= 50 ? k : 100 - k;
    const Eigen::Quaterniond facing(Eigen::AngleAxisd(k <= 50 ? 0.0 : 3.1, Eigen::Vector3d::UnitZ()));
    line.push_back({Timestamp{} + static_cast<double>(k), {facing, {x, 0.0, 0.0}}});
  }
  Recording recording{.odometry = line};
  std::vector<Submap> submaps(2);
  submaps[0] = {.id = {RobotId{0}, 0}, .keyframes = {{0, line[10].stamp, {}, true}}};
  submaps[1] = {.id = {RobotId{0}, 8}, .keyframes = {{80, line[90].stamp, {}, true}}};
  ReferenceClosureConfig config;
  config.wrong_share = 0.0;
  const std::map<RobotId, Trajectory> reference{{RobotId{0}, line}};
  EXPECT_TRUE(ReferenceClosures(reference, config, 1).is_candidate(submaps[0], submaps[1]));
  config.max_heading_deg = 90.0;
  EXPECT_FALSE(ReferenceClosures(reference, config, 1).is_candidate(submaps[0], submaps[1]));
  config.max_heading_deg = 180.0;
  config.min_time_gap_s = 81.0;
  EXPECT_FALSE(ReferenceClosures(reference, config, 1).is_candidate(submaps[0], submaps[1]));
  config.min_time_gap_s = 80.0;
  config.min_submap_gap = 9;
  EXPECT_EQ(ReferenceClosures(reference, config, 1).verify(submaps[0], submaps[1]).refusal,
            (Refusal{RefusalReason::neighbours, 8.0, 9.0}));
}

TEST(ReferenceClosures, MissingReferenceRefusesInsteadOfGuessing) {
  Mission mission = make_mission(4, 60.0);
  const RobotId bravo{1};
  Trajectory& reference = mission.reference[bravo];
  const Timestamp hole_begin = reference.front().stamp + 12.0;
  const Timestamp hole_end = reference.front().stamp + 38.0;
  std::erase_if(reference, [&](const StampedPose& p) { return p.stamp > hole_begin && p.stamp < hole_end; });
  const ReferenceClosures verifier(mission.reference, {}, 1);
  const Submap& alpha = mission.submaps.front();
  for (const Submap& submap : mission.submaps) {
    if (submap.id.chain.robot != bravo || submap.id.index != 2) continue;  // 20 .. 30 s
    const ClosureVerdict verdict = verifier.verify(alpha, submap);
    EXPECT_TRUE(verdict.closures.empty());
    EXPECT_EQ(verdict.refusal, Refusal{RefusalReason::no_reference});
  }
  EXPECT_FALSE(verifier.true_relative_pose(RobotId{0}, {1'000'000'000}, RobotId{7}, {1'000'000'000}).has_value());
  EXPECT_EQ(verifier.verify(alpha, alpha).refusal, Refusal{RefusalReason::same_submap});
  EXPECT_EQ(verifier.verify(alpha, Submap{.id = {RobotId{9}, 5}}).refusal, Refusal{RefusalReason::no_reference});
}

TEST(ReferenceClosures, InterpolatesBetweenReferenceStamps) {
  const Trajectory line{{{0}, {}}, {{1'000'000'000}, {Eigen::Quaterniond::Identity(), {2.0, 0.0, 0.0}}}};
  const ReferenceClosures verifier({{RobotId{0}, line}}, {}, 1);
  const auto T = verifier.true_relative_pose(RobotId{0}, {0}, RobotId{0}, {250'000'000});
  ASSERT_TRUE(T.has_value());
  EXPECT_NEAR(T->translation.x(), 0.5, 1e-12);
  EXPECT_FALSE(verifier.true_relative_pose(RobotId{0}, {0}, RobotId{0}, {1'250'000'000}).has_value());
}

TEST(ReferenceClosures, AnswerTheSameFromSeveralThreads) {
  const Mission& mission = shared_mission();
  const ReferenceClosures verifier(mission.reference, {}, 5);
  const std::vector<Submap> some(mission.submaps.begin(), mission.submaps.begin() + 40);
  const auto expected = all_verdicts(verifier, some);
  std::vector<std::vector<ClosureVerdict>> results(3);
  {
    std::vector<std::jthread> threads;
    for (auto& result : results) threads.emplace_back([&] { result = all_verdicts(verifier, some); });
  }
  for (const auto& result : results) EXPECT_EQ(result, expected);
}

}  // namespace reference_closures_test
}  // namespace tutti::simulation
