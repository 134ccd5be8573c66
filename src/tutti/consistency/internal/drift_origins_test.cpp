// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/internal/drift_origins.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "support/consistency/uncertainty.hpp"

namespace tutti::consistency::internal {
namespace drift_origins_test {

constexpr std::size_t kNodes = 150;
constexpr int kSeeds = 40;
constexpr double kRate = 0.01;

/// A segment of odometry that slides: every step in (first, last] is `slide` short or long, seen from the body.
struct Failure {
  std::size_t first = 0, last = 0;
  Pose3 slide;
  double stated = 1.0;  ///< Standard deviation that odometry gives there, times the usual one.
};

struct Scene {
  TimeChain chain;
  ProxyGraph graph;
};

Scene scene(std::uint64_t seed, const std::vector<Failure>& failures) {
  const test::OdometryNoise noise;
  const test::ServerNoise map{.smooth_m = 0.03, .local_m = 0.003, .local_rad = 5e-4};
  const Rng rng(seed);
  const auto truth = test::corridor(kNodes);
  Scene out;
  out.chain.server = test::server_estimate(truth, map, rng.fork("server"));
  auto steps = test::odometry_increments(truth, noise, rng.fork("odometry"));
  out.chain.odometry.push_back({.covariance = Matrix6d::Zero()});
  for (std::size_t k = 1; k < kNodes; ++k) {
    RelativePose step{steps[k - 1], test::covariance_of(noise)};
    for (const Failure& failure : failures)
      if (k > failure.first && k <= failure.last) {
        step.T_a_b = step.T_a_b * failure.slide;
        step.covariance *= failure.stated * failure.stated;
      }
    out.chain.odometry.push_back(step);
  }
  out.chain.robot = out.chain.server;
  out.graph = build_proxy_graph(1, test::server_nodes(test::kAlpha, out.chain.server), {}, {});
  out.graph.uncertainties = {test::uncertainty_by(map, out.graph, test::kAlpha)};
  return out;
}

std::vector<DriftSegment> segments(const Scene& s) {
  std::vector<NodePair> pairs;
  for (std::size_t n = 0; n < kNodes; ++n) pairs.push_back({n, n});
  const DisagreementTest test(s.graph, test::kAlpha, pairs, {});
  std::vector<double> lengths_m;
  for (int scale = 0; scale < test.scales(); ++scale) lengths_m.push_back(test.scale_length_m(scale));
  return drift_segments(s.chain, lengths_m, &s.graph.uncertainties[0], kRate);
}

/// Sorted, apart from each other (they may touch), within the run, above their threshold.
void expect_in_order(const std::vector<DriftSegment>& found) {
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_LT(found[i].first, found[i].last);
    EXPECT_LT(found[i].last, kNodes);
    EXPECT_GT(found[i].significance, 1.0);
    EXPECT_LE(i > 0 ? found[i - 1].last : 0, found[i].first);
  }
}

/// In how many of the runs a segment found overlaps the failure, starts within `nodes` of it and is (not) an alert.
struct Hits {
  int overlap = 0, start = 0, alert = 0, others = 0;
};
Hits count(const std::vector<std::vector<DriftSegment>>& runs, const Failure& failure, std::size_t nodes) {
  Hits out;
  for (const auto& found : runs) {
    bool overlap = false, start = false, alert = false;
    for (const DriftSegment& s : found) {
      const bool meets = s.first < failure.last && failure.first < s.last;
      out.others += meets ? 0 : 1;
      overlap |= meets;
      alert |= meets && s.alert;
      start |= meets && s.first <= failure.first + nodes && failure.first <= s.first + nodes;
    }
    out.overlap += overlap;
    out.start += start;
    out.alert += alert;
  }
  return out;
}

std::vector<std::vector<DriftSegment>> runs_with(const std::vector<Failure>& failures) {
  std::vector<std::vector<DriftSegment>> out;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    out.push_back(segments(scene(seed, failures)));
    expect_in_order(out.back());
  }
  return out;
}

TEST(DriftSegments, NoneWhereOdometryIsAsGoodAsItSays) {
  int found = 0;
  for (const auto& run : runs_with({})) found += run.empty() ? 0 : 1;
  EXPECT_LE(found, 2);  // 0.4 asked for
}

TEST(DriftSegments, FindsAnUnflaggedSlideAndRaisesAnAlert) {
  const Failure slide{.first = 60, .last = 75, .slide = test::at(-0.15, 0, 0)};
  const Hits hits = count(runs_with({slide}), slide, 3);
  EXPECT_EQ(hits.overlap, kSeeds);
  EXPECT_EQ(hits.alert, kSeeds);
  EXPECT_GE(hits.start, kSeeds * 9 / 10);
  EXPECT_LE(hits.others, 2);
}

TEST(DriftSegments, FindsAFlaggedSlideAndRaisesNone) {
  const Failure slide{.first = 60, .last = 75, .slide = test::at(-0.15, 0, 0), .stated = 100.0};
  const Hits hits = count(runs_with({slide}), slide, 3);
  EXPECT_EQ(hits.overlap, kSeeds);
  EXPECT_EQ(hits.alert, 0);
  EXPECT_GE(hits.start, kSeeds * 9 / 10);
  EXPECT_LE(hits.others, 2);
}

TEST(DriftSegments, FindsASingleJumpToTheNode) {
  const Failure jump{.first = 89, .last = 90, .slide = {so3_exp(Eigen::Vector3d(0, 0, 0.1)), {0.5, 0.3, 0}}};
  std::size_t others = 0;
  for (const auto& found : runs_with({jump})) {
    EXPECT_TRUE(std::ranges::any_of(found, [](const DriftSegment& s) {
      return s.first == 89 && s.last == 90 && s.alert && s.significance > 10.0;
    }));
    others += found.empty() ? 0 : found.size() - 1;
  }
  EXPECT_LE(others, 2U);  // 0.4 asked for
}

TEST(DriftSegments, FindsTwoFailuresApart) {
  const Failure first{.first = 20, .last = 30, .slide = test::at(0, 0, 0.2)};
  const Failure second{.first = 110, .last = 125, .slide = test::at(-0.15, 0, 0)};
  const auto runs = runs_with({first, second});
  EXPECT_GE(count(runs, first, 4).start, kSeeds * 9 / 10);
  EXPECT_GE(count(runs, second, 4).start, kSeeds * 9 / 10);
}

// A slide stands out by its size against the covariance that odometry stated.
TEST(DriftSegments, AStrongerSlideStandsOutMore) {
  double before = 1.0;
  for (const double slide : {0.1, 0.2, 0.4}) {
    const auto found = segments(scene(1, {{.first = 60, .last = 75, .slide = test::at(-slide, 0, 0)}}));
    ASSERT_FALSE(found.empty());
    EXPECT_GT(found[0].significance, 1.5 * before);
    before = found[0].significance;
  }
}

TEST(DriftSegments, TooShortRunsHaveNone) {
  Scene s = scene(1, {{.first = 0, .last = 2, .slide = test::at(5, 0, 0)}});
  s.chain.server.resize(3);
  s.chain.odometry.resize(3);
  EXPECT_TRUE(segments(s).empty());
}

}  // namespace drift_origins_test
}  // namespace tutti::consistency::internal
