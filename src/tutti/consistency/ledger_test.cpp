// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/ledger.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>

#include "support/consistency/runs.hpp"

namespace tutti::consistency {
namespace ledger_test {

Constraint link(std::size_t from, std::size_t to, double x = 1.0, double yaw_deg = 0.0, std::uint64_t revision = 1) {
  Constraint out{test::stamp_of(from), test::stamp_of(to), from, to};
  out.measurement.T_a_b = {so3_exp(Eigen::Vector3d(0, 0, yaw_deg * std::numbers::pi / 180)), {x, 0.2, 0.0}};
  out.revision = revision;
  return out;
}

TEST(Ledger, AddsSortedAndCounts) {
  Ledger ledger;
  const auto update = ledger.update({link(3, 4), link(0, 1), link(0, 5)}, false);
  EXPECT_EQ(update.added, 3U);
  ASSERT_EQ(ledger.size(), 3U);
  EXPECT_EQ(ledger.constraints()[0], link(0, 1));
  EXPECT_EQ(ledger.constraints()[1], link(0, 5));
  EXPECT_EQ(ledger.constraints()[2], link(3, 4));
}

TEST(Ledger, KeepsAConstraintUntilItDiffersReasonably) {
  Ledger ledger({link(0, 1)});
  EXPECT_EQ(ledger.update({link(0, 1, 1.0004, 0.004, 2)}, false).unchanged, 1U);
  EXPECT_EQ(ledger.constraints()[0].revision, 1U);
  EXPECT_EQ(ledger.update({link(0, 1, 1.0006, 0.0, 3)}, false).replaced, 1U);
  EXPECT_EQ(ledger.constraints()[0].revision, 3U);
  EXPECT_EQ(ledger.update({link(0, 1, 1.0006, 0.006, 4)}, false).replaced, 1U);
  EXPECT_EQ(ledger.constraints()[0].revision, 4U);
}

/// The weight of a constraint follows the server.
TEST(Ledger, ReplacesAConstraintThatCountsOtherwise) {
  const auto weighing = [](double sigma, std::uint64_t revision) {
    Constraint out = link(0, 1, 1.0, 0.0, revision);
    out.measurement.covariance = sigma * sigma * Matrix6d::Identity();
    return out;
  };
  Ledger ledger({weighing(0.01, 1)});
  EXPECT_EQ(ledger.update({weighing(0.0105, 2)}, false).unchanged, 1U);
  EXPECT_EQ(ledger.update({weighing(0.012, 3)}, false).replaced, 1U);
  EXPECT_EQ(ledger.constraints()[0].revision, 3U);
  EXPECT_EQ(ledger.update({weighing(0.0105, 4)}, false).replaced, 1U);
}

// Small steps each below the threshold must not add up unseen: the comparison is with what is kept.
TEST(Ledger, SmallStepsAddUpToAReplacement) {
  Ledger ledger({link(0, 1)});
  std::size_t replaced = 0;
  for (int step = 1; step <= 10; ++step) replaced += ledger.update({link(0, 1, 1.0 + 0.0002 * step)}, false).replaced;
  EXPECT_EQ(replaced, 3U);
}

TEST(Ledger, EitherDirectionIsTheSameConstraint) {
  Constraint backward = link(0, 1, 1.0, 30.0);
  std::swap(backward.from, backward.to);
  std::swap(backward.from_stamp, backward.to_stamp);
  backward.measurement = inverse(backward.measurement);
  Ledger ledger({link(0, 1, 1.0, 30.0)});
  const auto update = ledger.update({backward}, false);
  EXPECT_EQ(update.unchanged, 1U);
  EXPECT_EQ(ledger.size(), 1U);
}

TEST(Ledger, TurningAConstraintRoundTwiceChangesNothing) {
  Constraint backward = link(5, 2, 2.0, 40.0);
  backward.measurement.covariance = test::covariance_of({}) + 1e-6 * Matrix6d::Ones();
  const Constraint forward = in_time_order(backward);
  EXPECT_EQ(forward.from, 2U);
  EXPECT_LT(forward.from_stamp, forward.to_stamp);
  Constraint again = forward;
  std::swap(again.from, again.to);
  std::swap(again.from_stamp, again.to_stamp);
  // in_time_order(again) treats T as running backward: it must undo the first turn.
  again = in_time_order(again);
  EXPECT_LT(local(again.measurement.T_a_b, backward.measurement.T_a_b).norm(), 1e-12);
  EXPECT_LT((again.measurement.covariance - backward.measurement.covariance).norm(), 1e-15);
}

TEST(Ledger, ReplacingAllRemovesWhatIsNotChosenAndKeepsWhatIs) {
  Ledger ledger({link(0, 1), link(1, 2), link(2, 3)});
  const auto update = ledger.update({link(1, 2, 1.0001, 0.0, 9), link(4, 5)}, true);
  EXPECT_EQ(update.removed, 2U);
  EXPECT_EQ(update.unchanged, 1U);
  EXPECT_EQ(update.added, 1U);
  EXPECT_EQ(ledger.constraints()[0].revision, 1U);
}

/// A graph of this robot's nodes, these stamps only, some of them eliminated by the reduction.
ProxyGraph graph_of(const std::vector<std::size_t>& kept, const std::vector<std::size_t>& eliminated,
                    RobotId robot = test::kAlpha) {
  ProxyGraph graph;
  for (const std::size_t n : kept) graph.nodes.push_back({.chain = robot, .stamp = test::stamp_of(n)});
  for (const std::size_t n : eliminated) graph.eliminated.push_back({robot, test::stamp_of(n)});
  return graph;
}

TEST(Withdraw, OnlyWhatTheGraphDoesNotKnowOfAnyMore) {
  const Ledger all({link(0, 1), link(0, 5), link(1, 2), link(4, 5)});
  Ledger ledger = all;
  EXPECT_EQ(ledger.withdraw_unknown(graph_of({0, 1, 2, 4, 5}, {}), test::kAlpha), 0U);
  EXPECT_EQ(ledger, all);
  EXPECT_EQ(ledger.withdraw_unknown(graph_of({0, 5}, {1, 2, 4}), test::kAlpha), 0U);  // reduced away, still known
  EXPECT_EQ(ledger, all);
  EXPECT_EQ(ledger.withdraw_unknown(graph_of({0, 2, 5}, {4}), test::kAlpha), 2U);  // node 1 is gone
  EXPECT_EQ(ledger, Ledger({link(0, 5), link(4, 5)}));
}

TEST(Withdraw, AnotherRobotsNodesDoNotCount) {
  Ledger ledger({link(0, 1)});
  EXPECT_EQ(ledger.withdraw_unknown(graph_of({0, 1}, {}, test::kBravo), test::kAlpha), 1U);
  EXPECT_EQ(ledger.size(), 0U);
}

RC_GTEST_PROP(Ledger, NeverHoldsAPairTwiceAndCountsAddUp, ()) {
  Ledger ledger;
  for (int round = 0; round < 4; ++round) {
    std::vector<Constraint> chosen;
    for (int i = *rc::gen::inRange(0, 20); i > 0; --i) {
      const auto from = *rc::gen::inRange<std::size_t>(0, 6);
      const auto to = from + *rc::gen::inRange<std::size_t>(1, 4);
      chosen.push_back(link(from, to, *rc::gen::inRange(0, 5) * 0.0004));
      if (*rc::gen::arbitrary<bool>()) {
        std::swap(chosen.back().from, chosen.back().to);
        std::swap(chosen.back().from_stamp, chosen.back().to_stamp);
      }
    }
    const std::size_t before = ledger.size();
    const bool replaces_all = *rc::gen::arbitrary<bool>();
    const auto update = ledger.update(chosen, replaces_all);
    RC_ASSERT(ledger.size() == before + update.added - update.removed - update.withdrawn);
    RC_ASSERT(before == update.replaced + update.unchanged + update.removed + update.withdrawn || !replaces_all);
    RC_ASSERT(replaces_all || update.removed == 0U);
    const auto& kept = ledger.constraints();
    for (std::size_t i = 0; i < kept.size(); ++i) {
      RC_ASSERT(kept[i].from_stamp < kept[i].to_stamp);
      RC_ASSERT(kept[i].from < kept[i].to);
      if (i > 0)
        RC_ASSERT(std::pair(kept[i - 1].from_stamp, kept[i - 1].to_stamp) <
                  std::pair(kept[i].from_stamp, kept[i].to_stamp));
    }
    RC_ASSERT(Ledger(kept) == ledger);  // saved and loaded
    Ledger again = ledger;
    RC_ASSERT(again.update(kept, true).unchanged == kept.size());
    RC_ASSERT(again == ledger);
    std::vector<std::size_t> known;
    for (std::size_t n = 0; n < 10; ++n)
      if (*rc::gen::arbitrary<bool>()) known.push_back(n);
    const std::size_t all = ledger.size();
    const std::size_t gone = ledger.withdraw_unknown(graph_of(known, {}), test::kAlpha);
    RC_ASSERT(ledger.size() + gone == all);
    for (const Constraint& c : ledger.constraints())
      RC_ASSERT(std::ranges::count(known, c.from) == 1 && std::ranges::count(known, c.to) == 1);
  }
}

}  // namespace ledger_test
}  // namespace tutti::consistency
