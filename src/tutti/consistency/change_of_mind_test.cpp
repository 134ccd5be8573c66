// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/change_of_mind.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "support/consistency/uncertainty.hpp"
#include "support/sanitized.hpp"

namespace tutti::consistency {
namespace change_of_mind_test {

using test::kAlpha, test::kBravo;

constexpr std::size_t kNodes = 120;

const test::WalkWithClosures& errors() {
  static const test::WalkWithClosures out{kNodes, 30, {0.01, 5e-4}, {0.02, 2e-3}};
  return out;
}

/// A map with these poses of one robot, as sure as errors() are large.
ProxyGraph map_with(const std::vector<Pose3>& poses) {
  ProxyGraph graph = build_proxy_graph(1, test::server_nodes(kBravo, poses), {}, {});
  if (poses.size() == kNodes) graph.uncertainties = {errors().uncertainty(graph, kBravo)};
  return graph;
}

TEST(MapChange, AMapThatMovesWithinItsOwnErrorsDoesNotChangeItsMind) {
  const std::vector<Pose3> truth = test::corridor(kNodes);
  const ProxyGraph older = map_with(truth);
  int changes = 0;
  const int draws = static_cast<int>(tutti::seeds(100U));
  for (int draw = 0; draw < draws; ++draw) {
    const ProxyGraph newer = map_with(errors().displace(truth, Rng(9).fork(static_cast<std::uint64_t>(draw))));
    changes += map_change(older, newer, kBravo).is_change_of_mind() ? 1 : 0;
  }
  std::printf("[ MEASURED ] %d of %d draws of a map's own errors count as a change of mind (three sigma: 0.3 %%)\n",
              changes, draws);
  EXPECT_LE(changes, 1 + draws / 50);
}

TEST(MapChange, SaysWhereAndByHowMuch) {
  const std::vector<Pose3> before = test::corridor(kNodes);
  std::vector<Pose3> after = before;
  for (std::size_t n = 60; n < 70; ++n) after[n].translation.y() += 1.0;
  const MapChange change = map_change(map_with(before), map_with(after), kBravo);
  EXPECT_TRUE(change.is_change_of_mind());
  EXPECT_NEAR(change.translation_m, 1.0, 0.15);
  EXPECT_EQ(change.from, test::stamp_of(60));
  EXPECT_EQ(change.until, test::stamp_of(69));
}

// Frames are unrelated, and a map grows: neither is a change of mind.
TEST(MapChange, NeitherAnotherFrameNorNewNodesCount) {
  const std::vector<Pose3> before = test::corridor(kNodes);
  Rng rng(4);
  EXPECT_LT(
      map_change(map_with(before), map_with(test::moved(test::random_pose(rng, 50.0), before)), kBravo).significance,
      1e-6);
  EXPECT_LT(map_change(map_with(before), map_with(test::corridor(2 * kNodes)), kBravo).significance, 0.5);
}

TEST(MapChange, NothingIsReportedWhereTheOlderMapHasNoUncertainty) {
  const std::vector<Pose3> before = test::corridor(kNodes);
  std::vector<Pose3> after = before;
  after[60].translation.y() += 100.0;
  ProxyGraph silent = map_with(before);
  silent.uncertainties.clear();
  EXPECT_EQ(map_change(silent, map_with(after), kBravo), MapChange{});
  EXPECT_EQ(map_change(map_with(before), map_with(after), kAlpha), MapChange{});  // a chain that neither has
  EXPECT_EQ(map_change({}, map_with(after), kBravo), MapChange{});
}

// Ten times the place and ten times its errors: the same answer.
TEST(MapChange, HasNoLengthInIt) {
  const auto significance = [](double scale) {
    const test::WalkWithClosures own{kNodes, 30, {0.01 * scale, 5e-4}, {0.02 * scale, 2e-3}};
    std::vector<Pose3> before = test::corridor(kNodes);
    for (Pose3& pose : before) pose.translation *= scale;
    std::vector<Pose3> after = before;
    after[60].translation.y() += 0.2 * scale;
    // Weights are exp(-d / (2 sigma^2)), eq. (1).
    const ProxyGraphConfig config{.radius_m = 7.0 * scale, .sigma_m = std::sqrt(scale)};
    ProxyGraph older = build_proxy_graph(1, test::server_nodes(kBravo, before), {}, config);
    older.uncertainties = {own.uncertainty(older, kBravo)};
    return map_change(older, build_proxy_graph(2, test::server_nodes(kBravo, after), {}, config), kBravo).significance;
  };
  EXPECT_NEAR(significance(1.0), significance(10.0), 0.02 * significance(1.0));
  EXPECT_NEAR(significance(1.0), significance(0.1),
              0.2 * significance(1.0));  // no map states an uncertainty of a millimetre
}

}  // namespace change_of_mind_test
}  // namespace tutti::consistency
