// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/judge/weak_joints.hpp"

#include <gtest/gtest.h>

#include <numeric>

namespace tutti::judge {
namespace weak_joints_test {

Pose3 at(double x, double y = 0.0) { return {Eigen::Quaterniond::Identity(), {x, y, 0.0}}; }

PoseGraphEdge edge(std::size_t from, std::size_t to, const Pose3& T_from_to = {}) {
  return {.from = from, .to = to, .T_from_to = T_from_to, .information = 100.0 * Matrix6d::Identity()};
}

/// A line of nodes with odometry between each two, one metre long.
PoseGraph line(std::size_t nodes) {
  PoseGraph out;
  for (std::size_t k = 0; k < nodes; ++k) out.poses.push_back(at(static_cast<double>(k)));
  for (std::size_t k = 0; k + 1 < nodes; ++k) out.edges.push_back(edge(k, k + 1, at(1.0)));
  return out;
}

std::vector<std::size_t> all_of(const std::vector<PoseGraphEdge>& closures) {
  std::vector<std::size_t> out(closures.size());
  std::iota(out.begin(), out.end(), 0U);
  return out;
}

TEST(WeakJoints, OdometryThatAcceptedClosuresSpanIsNone) {
  PoseGraph map = line(10);
  map.edges.push_back(edge(1, 4));
  map.edges.push_back(edge(6, 9));
  const std::vector<PoseGraphEdge> closures{edge(8, 2), edge(2, 7)};
  const auto joints = weak_joints(map, 9, closures, all_of(closures), 2);
  ASSERT_EQ(joints.size(), 1U);  // from 4 to 6 in one, as nothing ends at 5
  EXPECT_EQ(joints[0].odometry, std::pair(std::size_t{4}, std::size_t{6}));
  const std::vector<WeakJoint::Across> across{{0, false}, {1, true}};
  EXPECT_EQ(joints[0].across, across);
  map.edges.push_back(edge(0, 8));  // over both
  EXPECT_TRUE(weak_joints(map, 9, closures, all_of(closures), 2).empty());
  EXPECT_TRUE(weak_joints(line(10), 9, closures, all_of(closures), 3).empty());
}

TEST(WeakJoints, ASegmentEndsWhereARefusedClosureDoes) {
  const PoseGraph map = line(8);
  const std::vector<PoseGraphEdge> closures{edge(1, 6), edge(1, 5), edge(0, 5)};
  const auto joints = weak_joints(map, 7, closures, all_of(closures), 1);
  std::vector<std::pair<std::size_t, std::size_t>> segments;
  for (const WeakJoint& joint : joints) segments.push_back(*joint.odometry);
  const std::vector<std::pair<std::size_t, std::size_t>> expected{{0, 1}, {1, 5}, {5, 6}};
  EXPECT_EQ(segments, expected);
}

TEST(WeakJoints, TwoPartsHaveOneWithoutOdometry) {
  PoseGraph map = line(8);
  map.edges.erase(map.edges.begin() + 3);  // 0..3 and 4..7
  map.edges.push_back(edge(0, 3));
  map.edges.push_back(edge(4, 7));
  const std::vector<PoseGraphEdge> closures{edge(5, 2), edge(1, 6)};
  const auto joints = weak_joints(map, 6, closures, all_of(closures), 2);
  ASSERT_EQ(joints.size(), 1U);
  EXPECT_FALSE(joints[0].odometry.has_value());
  const std::vector<WeakJoint::Across> across{{0, false}, {1, true}};
  EXPECT_EQ(joints[0].across, across);
}

TEST(WeakJoints, AreThoseThatFallApartWithoutTheEdge) {  // against its definition, on random maps
  std::uint32_t state = 1;
  const auto random = [&](std::size_t below) { return (state = state * 1664525U + 1013904223U) / 65536U % below; };
  for (int round = 0; round < 200; ++round) {
    PoseGraph map = line(12);
    for (std::size_t k = 0, more = random(6); k < more; ++k) map.edges.push_back(edge(random(12), random(12)));
    std::erase_if(map.edges, [](const PoseGraphEdge& e) { return e.from == e.to; });
    std::vector<PoseGraphEdge> closures;
    for (int k = 0; k < 8; ++k)
      if (const std::size_t a = random(12), b = random(12); a != b) closures.push_back(edge(a, b));
    const auto joints = weak_joints(map, 11, closures, all_of(closures), 1);
    for (std::size_t e = 0; e < 11; ++e) {
      std::vector<int> side(12, 0);  // 1: reached from the edge's first node without it
      side[e] = 1;
      for (int again = 0; again < 12; ++again)
        for (std::size_t other = 0; other < map.edges.size(); ++other)
          if (other != e && side[map.edges[other].from] != side[map.edges[other].to])
            side[map.edges[other].from] = side[map.edges[other].to] = 1;
      std::vector<WeakJoint::Across> expected;
      for (std::size_t c = 0; c < closures.size() && side[e + 1] == 0; ++c)
        if (side[closures[c].from] != side[closures[c].to]) expected.push_back({c, side[closures[c].from] == 1});
      std::vector<WeakJoint::Across> found;
      for (const WeakJoint& joint : joints)
        if (joint.odometry->first <= e && e + 1 <= joint.odometry->second) found = joint.across;
      EXPECT_EQ(found, expected);
    }
  }
}

/// Four places agree that the second side lies 5 m to the side; a larger one of closures that look alike does not.
TEST(WeakJoints, ManyAlikeClosuresAreOneWitness) {
  std::vector<Pose3> poses;
  for (int k = 0; k < 40; ++k) poses.push_back(at(k % 20, k < 20 ? 0.0 : 100.0));  // 0..19, 20..39
  std::vector<PoseGraphEdge> closures;
  std::vector<std::vector<std::size_t>> places;
  WeakJoint joint;
  const auto add = [&](std::size_t first, std::size_t second, const Pose3& T_first_second, bool leads_to_second) {
    const Pose3 T = poses[first].inverse() * T_first_second * poses[second];
    places.back().push_back(closures.size());
    joint.across.push_back({closures.size(), leads_to_second});
    closures.push_back(leads_to_second ? edge(first, second, T) : edge(second, first, T.inverse()));
  };
  for (std::size_t place = 0; place < 4; ++place) {
    places.emplace_back();
    for (std::size_t k = 0; k < 3; ++k)
      add(4 * place + k, 20 + 3 * place + k, at(1e-3 * static_cast<double>(place), 5.0), k % 2 == 0);
  }
  places.emplace_back();
  for (std::size_t k = 0; k < 18; ++k) add(k, 39 - k, at(30.0, -40.0), true);
  const JointAgreement agreed = most_agreed(poses, closures, joint, places, 2);
  EXPECT_LT(agreed.closure, 12U);
  EXPECT_NEAR((agreed.T_first_second.translation - Eigen::Vector3d(0.0, 5.0, 0.0)).norm(), 0.0, 0.01);
  EXPECT_LT(agreed.error, 1.0);
  const std::vector<std::vector<std::size_t>> two{places[0], places[4]};
  EXPECT_GT(most_agreed(poses, closures, joint, two, 2).error, 1e4);  // no two of these agree
}

}  // namespace weak_joints_test
}  // namespace tutti::judge
