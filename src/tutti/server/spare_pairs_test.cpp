// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/spare_pairs.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "support/server/world.hpp"

namespace tutti::server {
namespace spare_pairs_test {

struct Room {
  SubmapSet submaps;
  VerdictSet verdicts;
};

/// Two robots walk in circles for `submaps` of ten keyframes each and close every pair that is not a neighbour.
Room one_room(std::uint32_t submaps) {
  Room out;
  for (const std::uint32_t robot : {0U, 1U})
    for (Submap& submap : test::make_submaps(RobotId{robot}, {.keyframes = 10 * submaps + 1}, Rng(robot)))
      out.submaps[submap.id] = std::make_shared<const Submap>(std::move(submap));
  const test::TestVerifier verifier(1);
  for (auto a = out.submaps.begin(); a != out.submaps.end(); ++a)
    for (auto b = std::next(a); b != out.submaps.end(); ++b)
      if (a->first.chain != b->first.chain || b->first.index > a->first.index + 1)
        out.verdicts[{a->first, b->first}] = *verifier.verify(*a->second, *b->second, MemoryPayloadStore());
  return out;
}

PairLimits with_one_chain(std::size_t most) { return {.with_one_chain = most, .in_all = 1'000'000}; }

std::map<SubmapId, std::size_t> left_of(const Room& room, const std::set<SubmapPair>& spare) {
  std::map<SubmapId, std::size_t> out;
  for (const auto& [pair, verdict] : room.verdicts)
    if (!spare.contains(pair)) ++out[pair.first], ++out[pair.second];
  return out;
}

TEST(SparePairs, AreNoneWhereNobodyHasTooMany) {
  const Room room = one_room(8);
  EXPECT_TRUE(spare_pairs(room.verdicts, room.submaps, with_one_chain(16)).empty());
  EXPECT_FALSE(spare_pairs(room.verdicts, room.submaps, with_one_chain(4)).empty());
}

TEST(SparePairs, LeaveEverySubmapItsShareAndGrowWithTheMissionOnly) {
  for (const std::uint32_t submaps : {20U, 40U}) {
    const Room room = one_room(submaps);
    const auto left = left_of(room, spare_pairs(room.verdicts, room.submaps, with_one_chain(10)));
    std::size_t sum = 0;
    for (const auto& [submap, count] : left) {
      EXPECT_GE(count, 10U);
      sum += count;
    }
    EXPECT_EQ(left.size(), 2 * submaps);
    EXPECT_LE(sum, 2 * 2 * 10 * left.size());  // with either robot, drawn by either end
  }
}

TEST(SparePairs, ThoseWithoutAClosureOrASubmapDoNotCount) {
  Room room = one_room(20);
  const auto all = spare_pairs(room.verdicts, room.submaps, with_one_chain(10));
  Room more = room;
  for (auto& [pair, verdict] : more.verdicts)
    if (all.contains(pair)) verdict.closures.clear();
  EXPECT_TRUE(spare_pairs(more.verdicts, more.submaps, with_one_chain(20)).empty());
  more = room;
  std::erase_if(more.submaps, [](const auto& entry) { return entry.first.index >= 5; });
  EXPECT_TRUE(spare_pairs(more.verdicts, more.submaps, with_one_chain(10)).empty());
}

/// A third robot whose odometry diverged makes a submap all the time, and all of them close.
TEST(SparePairs, OneRobotCannotCrowdOutOthers) {
  Room room = one_room(6);
  const auto before = room.verdicts;
  for (Submap& submap : test::make_submaps(RobotId{2}, {.keyframes = 601}, Rng(2))) {
    for (const auto& [pair, verdict] : before)
      for (const SubmapId& id : {pair.first, pair.second}) {
        ClosureVerdict& made = room.verdicts[{id, submap.id}];
        made = verdict;
        made.pair = {id, submap.id};
      }
    room.submaps[submap.id] = std::make_shared<const Submap>(std::move(submap));
  }
  const auto spare = spare_pairs(room.verdicts, room.submaps, with_one_chain(10));
  for (const auto& [pair, verdict] : before) EXPECT_FALSE(spare.contains(pair));
}

TEST(SparePairs, AMapHasNoMorePairsInAllThanItsLimitUnlessSubmapsHadTooFew) {
  const Room room = one_room(30);
  const auto left = [&](std::size_t in_all) {
    const auto spare = spare_pairs(room.verdicts, room.submaps, {.with_one_chain = 40, .in_all = in_all});
    const auto counts = left_of(room, spare);
    EXPECT_EQ(counts.size(), room.submaps.size());
    for (const auto& [submap, count] : counts) EXPECT_GE(count, kLeastPairs);
    return room.verdicts.size() - spare.size();
  };
  const std::size_t all = left(1'000'000);
  EXPECT_EQ(left(all), all);
  for (const std::size_t in_all : {all - 1, all / 2, all / 3}) {
    EXPECT_LE(left(in_all), in_all);
    EXPECT_GT(left(in_all), in_all / 2);
  }
  const std::size_t least = left(1);
  EXPECT_LE(least, kLeastPairs * room.submaps.size());
  EXPECT_EQ(left(10), least);
}

/// Robots take turns where pairs are too many: one that makes many submaps in a place takes nobody's.
TEST(SparePairs, InAllTheyAreOfEveryRobotThatIsMet) {
  Room room = one_room(12);
  for (Submap& submap : test::make_submaps(RobotId{2}, {.keyframes = 1201}, Rng(2))) {
    for (const auto& [id, other] : room.submaps)
      if (id.chain.robot != RobotId{2}) {
        ClosureVerdict& made = room.verdicts[{id, submap.id}];
        made = room.verdicts.begin()->second;
        made.pair = {id, submap.id};
      }
    room.submaps[submap.id] = std::make_shared<const Submap>(std::move(submap));
  }
  const auto spare = spare_pairs(room.verdicts, room.submaps, {.with_one_chain = 40, .in_all = 100});
  std::map<std::pair<SubmapId, RobotId>, int> left;
  for (const auto& [pair, verdict] : room.verdicts)
    if (!spare.contains(pair))
      ++left[{pair.first, pair.second.chain.robot}], ++left[{pair.second, pair.first.chain.robot}];
  for (const auto& [id, submap] : room.submaps)
    EXPECT_TRUE(id.chain.robot != RobotId{0} || (left[{id, RobotId{1}}] > 0)) << to_string(id);
}

TEST(SparePairs, TheMapIsAsGoodWithoutThem) {
  const Room room = one_room(20);
  const auto error_m = [&](int most) {
    const MapEstimate map = estimate_map(room.submaps, room.verdicts, {.most_closed_pairs = most});
    EXPECT_TRUE(map.converged);
    EXPECT_EQ(map.components, 1U);
    EXPECT_EQ(map.closures.size() + map.spare_pairs, room.verdicts.size());
    double worst = 0.0;
    for (const MapNode& node : map.nodes) {
      const MapNode& start = map.nodes.front();
      const Pose3 T = start.T_world_body.inverse() * node.T_world_body;
      const Pose3 truth = test::true_pose(start.id.chain.robot, start.id.index).inverse() *
                          test::true_pose(node.id.chain.robot, node.id.index);
      worst = std::max(worst, (T.translation - truth.translation).norm());
    }
    return worst;
  };
  EXPECT_LT(error_m(10), 2.0 * error_m(1000) + 0.01);
}

}  // namespace spare_pairs_test
}  // namespace tutti::server
