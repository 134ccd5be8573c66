// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/judge/explain_closures.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tutti/base/random.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/geometry/symmetric.hpp"
#include "tutti/judge/closure_support.hpp"
#include "tutti/judge/hypothesis.hpp"
#include "tutti/judge/patience.hpp"

namespace tutti::judge {
namespace outlier_rejection_test {

constexpr std::size_t kLap = 100, kNodes = 2 * kLap + 1;
constexpr double kStep_m = 2.0;

Matrix6d information(double sigma_m, double sigma_rad) {
  Vector6d v;
  v << Eigen::Vector3d::Constant(1.0 / (sigma_m * sigma_m)), Eigen::Vector3d::Constant(1.0 / (sigma_rad * sigma_rad));
  return v.asDiagonal();
}

Vector6d noise(Rng& rng, double sigma_m, double sigma_rad) {
  Vector6d out;
  for (int i = 0; i < 6; ++i) out(i) = rng.normal(i < 3 ? sigma_m : sigma_rad);
  return out;
}

/// Two laps round a circle of 200 m, with a closure at every `every`-th node of the second one.
struct Laps {
  Rng rng{7};
  std::vector<Pose3> truth{Pose3{}};
  PoseGraph graph{.poses = {Pose3{}}, .edges = {}};
  std::size_t odometry_edges = kNodes - 1;

  /// Odometry misses `missed_rad` of yaw at the step from node `failed_at`.
  explicit Laps(std::size_t failed_at = 0, double missed_rad = 0.0) {
    const Pose3 step{so3_exp({0.0, 0.0, 2.0 * M_PI / kLap}), {kStep_m, 0.0, 0.0}};
    for (std::size_t k = 0; k + 1 < kNodes; ++k) {
      truth.push_back(truth.back() * step);
      Pose3 measured = retract(step, noise(rng, 0.01, 0.001));
      if (k == failed_at) measured = measured * Pose3{so3_exp({0.0, 0.0, missed_rad}), Eigen::Vector3d::Zero()};
      graph.poses.push_back(graph.poses.back() * measured);
      graph.edges.push_back({k, k + 1, measured, information(0.01, 0.001)});
    }
  }
  void close(std::size_t from, std::size_t to, const Pose3& wrong_by = {}) {
    const Pose3 T = retract(truth[from].inverse() * truth[to] * wrong_by, noise(rng, 0.03, 0.005));
    graph.edges.push_back({from, to, T, information(0.03, 0.005)});
  }
  void close_laps(std::size_t every) {
    for (std::size_t k = 1; k < kLap; k += every) close(k, k + kLap);
  }
  [[nodiscard]] OdometryTrajectories ways() const { return {seconds(), std::span(graph.edges).first(odometry_edges)}; }
  static std::vector<double> seconds() {  // a step takes two
    std::vector<double> out;
    for (std::size_t k = 0; k < kNodes; ++k) out.push_back(2.0 * static_cast<double>(k));
    return out;
  }
  [[nodiscard]] Judgement explain(const std::vector<std::vector<std::size_t>>& groups = {},
                                  const OutlierRejectionConfig& config = {}) const {
    return explain_closures(graph, ways(), odometry_edges, groups, config, {});
  }
};

/// Solves laps without a certain closure, and owns what it refers to.
struct Solver {
  explicit Solver(const Laps& laps)
      : ways(laps.ways()),
        solver(laps.graph, ways, laps.odometry_edges, config, gnc,
               std::vector<bool>(laps.graph.edges.size() - laps.odometry_edges, false)) {}
  OdometryTrajectories ways;
  OutlierRejectionConfig config;
  estimation::GncConfig gnc;
  HypothesisSolver solver;
};

Pose3 off(Rng& rng) { return retract(Pose3{}, noise(rng, 5.0, 0.5)); }

TEST(OdometryTrajectories, KnowsTheSegmentsAndWhatLiesBetween) {
  Laps laps;
  laps.graph.edges.erase(laps.graph.edges.begin() + 60);  // a gap after node 60
  const OdometryTrajectories ways(Laps::seconds(), laps.graph.edges);
  EXPECT_EQ(ways.segment(60), 0U);
  EXPECT_EQ(ways.segment(200), 61U);
  EXPECT_DOUBLE_EQ(ways.seconds(30), 60.0);
  EXPECT_NEAR(ways.usual_speed(), kStep_m / 2.0, 0.05);
  RelativePose sum{.T_a_b = {}, .covariance = Matrix6d::Zero()};
  for (std::size_t e = 10; e < 14; ++e)
    sum = compound(sum, {laps.graph.edges[e].T_from_to, inverse_of(laps.graph.edges[e].information)});
  const RelativePose forth = ways.between(10, 14), back = ways.between(14, 10);
  EXPECT_LT(local(sum.T_a_b, forth.T_a_b).norm(), 1e-9);
  EXPECT_LT((sum.covariance - forth.covariance).norm(), 1e-9);
  EXPECT_LT((inverse(forth).covariance - back.covariance).norm(), 1e-9);
  EXPECT_NEAR(ways.turn_variance(10, 14), 4 * 3 * 1e-6, 1e-9);
}

// Keyframes come by distance, so odometry that diverges has most of all steps. The usual speed follows from the time.
TEST(OdometryTrajectories, AFlightCountsAtItsLength) {
  Laps laps;
  for (std::size_t k = 60; k < 200; ++k) laps.graph.edges[k].T_from_to.translation *= 50.0;
  laps.graph.edges.erase(laps.graph.edges.begin() + 60);
  std::vector<double> seconds = Laps::seconds();  // the second segment has more steps, in a third of their time
  for (std::size_t k = 61; k < kNodes; ++k) seconds[k] = seconds[60] + (seconds[k] - seconds[60]) / 3.0;
  const OdometryTrajectories ways(seconds, laps.graph.edges);
  EXPECT_NEAR(ways.reach_m(180, 170), 10.0 * 50.0 * kStep_m, 5.0);
  // A robot that stands all day beside one that drives: both may miss what a body goes.
  Laps stands;
  for (std::size_t k = 0; k < 60; ++k) stands.graph.edges[k].T_from_to.translation.setZero();
  stands.graph.edges.erase(stands.graph.edges.begin() + 60);
  for (std::size_t k = 0; k < kNodes; ++k)
    seconds[k] = k <= 60 ? 1000.0 * static_cast<double>(k) : 60000.0 + 2.0 * static_cast<double>(k);
  EXPECT_NEAR(OdometryTrajectories(seconds, stands.graph.edges).reach_m(180, 170), 10.0 * kStep_m, 0.5);
}

TEST(ClosureSupport, RightClosuresHaveItAndWrongOnesDoNot) {
  Laps laps(40, 0.3);  // nor does odometry speak for the right ones
  laps.close_laps(5);
  for (std::size_t k = 0; k < 20; ++k) laps.close(k, k + 120, off(laps.rng));
  const auto supported = supported_closures(laps.ways(), std::span(laps.graph.edges).subspan(laps.odometry_edges), {});
  EXPECT_EQ(std::count(supported.begin(), supported.begin() + 20, true), 20);
  EXPECT_LE(std::count(supported.begin() + 20, supported.end(), true), 1);
}

TEST(OutlierRejection, WrongClosuresAreWrongAndHonestOdometryIsNot) {
  Laps laps;
  laps.close_laps(5);
  for (std::size_t k = 0; k < 20; ++k) laps.close(k, k + 120, off(laps.rng));
  const Judgement found = laps.explain();
  EXPECT_TRUE(found.solved);
  EXPECT_EQ(std::count(found.accepted.begin(), found.accepted.begin() + 20, true), 20);
  EXPECT_EQ(std::count(found.accepted.begin() + 20, found.accepted.end(), true), 0);
  EXPECT_TRUE(found.failed.empty());
}

TEST(OutlierRejection, ALoneClosureIsWrongItselfAndManyBlameTheOdometry) {
  Laps lone;
  lone.close(20, 120, Pose3{so3_exp({0.0, 0.0, 0.3}), Eigen::Vector3d::Zero()});
  EXPECT_FALSE(lone.explain().accepted[0]);
  EXPECT_TRUE(lone.explain().failed.empty());

  Laps laps(130, 0.3);
  laps.close_laps(5);
  for (std::size_t k = 0; k < 6; ++k) laps.close(k, k + 120, off(laps.rng));
  const Judgement found = laps.explain();
  ASSERT_EQ(found.failed.size(), 1U);
  EXPECT_LE(found.failed[0].from, 130U);
  EXPECT_GE(found.failed[0].to, 131U);
  EXPECT_LE(found.failed[0].to - found.failed[0].from, 10U);
  EXPECT_NEAR(found.failed[0].missed.tail<3>().norm(), 0.3, 0.02);
  EXPECT_GE(std::count(found.accepted.begin(), found.accepted.begin() + 20, true), 19);
  EXPECT_EQ(std::count(found.accepted.begin() + 20, found.accepted.end(), true), 0);
  EXPECT_TRUE(laps.explain({}, {.let_odometry_fail = false}).failed.empty());
}

TEST(OutlierRejection, SeveralFailuresAreFoundByASearchAndByOneCutShort) {
  const std::vector<std::size_t> failed_at{105, 130, 155, 180};
  Laps laps;
  for (const std::size_t k : failed_at) {
    Pose3& step = laps.graph.edges[k].T_from_to;
    step = step * Pose3{so3_exp({0.0, 0.0, 0.3}), Eigen::Vector3d::Zero()};
  }
  laps.close_laps(2);
  const OutlierRejectionConfig short_search{.least_hypotheses = 3, .tried_nodes = 0};
  const Judgement whole = laps.explain(), cut = laps.explain({}, short_search);
  {
    const Patience none([] { return true; });
    const Judgement stopped = laps.explain();
    EXPECT_TRUE(stopped.solved);
    EXPECT_EQ(stopped.work.hypotheses, 1U);
  }
  EXPECT_EQ(laps.explain().work.hypotheses, whole.work.hypotheses);
  EXPECT_GT(whole.work.hypotheses, 4U);
  EXPECT_LE(cut.work.hypotheses, 4U);
  for (const Judgement& found : {whole, cut}) {
    EXPECT_EQ(std::count(found.accepted.begin(), found.accepted.end(), true), std::ssize(found.accepted));
    for (const std::size_t k : failed_at)
      EXPECT_TRUE(std::ranges::any_of(found.failed, [&](const auto& f) { return f.from <= k && k < f.to; })) << k;
  }
}

/// A front end that repeats its last pose while the robot goes on.
TEST(OutlierRejection, OdometryThatStoodStillFailedThere) {
  constexpr std::size_t kFrom = 12, kTo = 15;
  Laps laps;
  for (std::size_t k = kFrom; k < kTo; ++k) laps.graph.edges[k].T_from_to = {};
  for (std::size_t k = 0; k + 1 < kNodes; ++k)
    laps.graph.poses[k + 1] = laps.graph.poses[k] * laps.graph.edges[k].T_from_to;
  laps.close_laps(1);
  const Solver solver(laps);
  const std::vector<Window> still = solver.solver.standstills();
  ASSERT_EQ(still.size(), 1U);
  EXPECT_LE(still[0].last - still[0].first, 2U);
  const Judgement judgement = laps.explain();
  EXPECT_LE(std::ranges::count(judgement.accepted, false), 3) << "those from the nodes in between";
  ASSERT_EQ(judgement.failed.size(), 1U);
  EXPECT_LE(judgement.failed[0].from, kFrom);
  EXPECT_GE(judgement.failed[0].to, kTo);
  EXPECT_TRUE(Solver(Laps()).solver.standstills().empty());
}

TEST(OutlierRejection, PlacesThatLookAlikeBlameNothing) {
  Laps laps;
  laps.close_laps(10);
  const std::size_t right = laps.graph.edges.size() - laps.odometry_edges;
  const Pose3 alike{so3_exp({0.0, 0.0, 0.5}), {6.0, 4.0, 0.0}};
  const Pose3 T_moved = laps.truth[30] * alike * laps.truth[150].inverse();
  std::vector<std::size_t> group;
  for (std::size_t i = 30; i < 38; i += 2)
    for (std::size_t j = 150; j < 158; j += 2) {
      group.push_back(laps.graph.edges.size() - laps.odometry_edges);
      laps.graph.edges.push_back({i, j, laps.truth[i].inverse() * T_moved * laps.truth[j], information(0.03, 0.005)});
    }
  const Judgement found = laps.explain({group});
  EXPECT_TRUE(found.failed.empty());
  for (std::size_t c = 0; c < found.accepted.size(); ++c) EXPECT_EQ(found.accepted[c], c < right) << c;
}

// Twenty closures that agree say that a robot at 1 m/s was aside by so much between nodes 40 and 60. Closures before
// and after leave it at most 10 s to get there: what it can have moved is believed, and the same from farther away is
// not.
TEST(OutlierRejection, OdometryMissesNoMoreThanTheRobotCanHaveMoved) {
  const auto accepted = [](double aside_m) {
    Laps laps;
    for (std::size_t k = 1; k < kLap; k += 5)
      if (k < 40 || k >= 60) laps.close(k, k + kLap);
    const std::size_t right = laps.graph.edges.size();
    const Pose3 aside{Eigen::Quaterniond::Identity(), {aside_m, 0.0, 0.0}};
    for (std::size_t k = 40; k < 60; ++k)
      laps.graph.edges.push_back(
          {k, k + kLap, laps.truth[k].inverse() * aside * laps.truth[k + kLap], information(0.03, 0.005)});
    const Judgement judged = laps.explain();
    return std::count(judged.accepted.begin() + static_cast<std::ptrdiff_t>(right - laps.odometry_edges),
                      judged.accepted.end(), true);
  };
  EXPECT_EQ(accepted(4.0), 20);
  EXPECT_EQ(accepted(14.0), 0);
}

// Visual-inertial odometry that diverges flies kilometres. Its error then is what it says, not what the robot did, and
// the closures of a healthy robot bring it home.
TEST(OutlierRejection, OdometryThatFliesMissesAsMuchAsItSays) {
  Laps laps;
  for (std::size_t k = 140; k < 160; ++k) laps.graph.edges[k].T_from_to.translation.x() *= 30.0;
  laps.graph.edges.erase(laps.graph.edges.begin() + kLap);  // two robots
  --laps.odometry_edges;
  laps.close_laps(2);
  const Judgement found = laps.explain();
  for (std::size_t c = 0; c < found.accepted.size(); ++c) {  // between nodes k and k + kLap
    const std::size_t k = 1 + 2 * c;
    EXPECT_TRUE(found.accepted[c] || (k >= 40 && k <= 60)) << k;
  }
  ASSERT_FALSE(found.failed.empty());
  for (const FailedSegment& failed : found.failed) {
    EXPECT_GE(failed.from, 136U);
    EXPECT_LE(failed.to, 164U);
  }
}

TEST(OutlierRejection, DoesNotDependOnTheOrderOfTheClosures) {
  Laps laps(130, 0.3);
  laps.close_laps(5);
  for (std::size_t k = 0; k < 6; ++k) laps.close(k, k + 120, off(laps.rng));
  const Judgement forth = laps.explain();
  std::reverse(laps.graph.edges.begin() + static_cast<std::ptrdiff_t>(laps.odometry_edges), laps.graph.edges.end());
  Judgement back = laps.explain();
  std::reverse(back.accepted.begin(), back.accepted.end());
  EXPECT_EQ(forth.accepted, back.accepted);
  ASSERT_EQ(forth.failed.size(), back.failed.size());
  EXPECT_EQ(forth.failed[0].from, back.failed[0].from);
  EXPECT_EQ(forth.failed[0].to, back.failed[0].to);
}

// Nothing in the judgement is a length: a place twenty times as large, with errors twenty times as large, is judged
// alike.
TEST(OutlierRejection, ScalingLengthsAndTheirErrorsChangesNothing) {
  Laps laps(130, 0.3);
  laps.close_laps(5);
  for (std::size_t k = 0; k < 6; ++k) laps.close(k, k + 120, off(laps.rng));
  const Judgement found = laps.explain();
  for (const double scale : {0.05, 20.0}) {
    Laps scaled = laps;
    for (Pose3& pose : scaled.graph.poses) pose.translation *= scale;
    Vector6d units = Vector6d::Ones();
    units.head<3>() /= scale;
    for (PoseGraphEdge& edge : scaled.graph.edges) {
      edge.T_from_to.translation *= scale;
      edge.information = units.asDiagonal() * edge.information * units.asDiagonal();
    }
    const Judgement other = scaled.explain();
    EXPECT_EQ(found.accepted, other.accepted) << scale;
    ASSERT_EQ(found.failed.size(), other.failed.size()) << scale;
    EXPECT_EQ(found.failed[0].from, other.failed[0].from) << scale;
    EXPECT_EQ(found.failed[0].to, other.failed[0].to) << scale;
    EXPECT_NEAR(found.failed[0].missed.head<3>().norm() * scale, other.failed[0].missed.head<3>().norm(), 0.01 * scale);
  }
}

// Two failures in one window cost about twice what one does.
TEST(HypothesisSolver, EverySegmentOfAWindowPaysForHowFarItIsFromItsErrors) {
  Laps one(50, 0.1), two(50, 0.1);
  for (Laps* laps : {&one, &two}) {
    if (laps == &two)
      laps->graph.edges[58].T_from_to =
          laps->graph.edges[58].T_from_to * Pose3{so3_exp({0, 0, 0.1}), Eigen::Vector3d::Zero()};
    laps->close_laps(2);
  }
  const auto price = [](const Laps& laps) {
    const Solver of(laps);
    const Solution all = of.solver.solve({{{0, of.solver.runs() - 1}}, {}});
    return all.prices.size() == 1 ? all.prices[0] - of.config.least_votes : 0.0;
  };
  EXPECT_GT(price(one), 1.0);
  EXPECT_GT(price(two), 1.8 * price(one));
}

// The optimum for which all odometry may be disregarded, judged for the window around what it disregards, has the same
// misfit as the optimum for that window alone.
TEST(HypothesisSolver, AnOptimumHoldsUnderLessThatMayBeDisregarded) {
  for (const double missed_rad : {0.1, 0.4}) {
    Laps laps(50, missed_rad);
    laps.close_laps(5);
    const Solver of(laps);
    const HypothesisSolver& solver = of.solver;
    const Solution all = solver.solve({{{0, solver.runs() - 1}}, {}});
    const auto run = static_cast<std::size_t>(std::ranges::find(all.disregarded, 1) - all.disregarded.begin());
    ASSERT_LT(run, solver.runs());
    const Solution judged = solver.judge({{solver.around(run)}, {}}, all.optimum);
    const Solution solved = solver.solve({{solver.around(run)}, {}});
    EXPECT_NEAR(judged.misfit, solved.misfit, 0.01);
    EXPECT_EQ(judged.disregarded, solved.disregarded);
    EXPECT_EQ(judged.accepted, solved.accepted);
    ASSERT_EQ(judged.prices.size(), 1U);
    EXPECT_GT(judged.prices[0], of.config.least_votes);
    EXPECT_LT(judged.misfit, solver.solve({}).misfit);
  }
}

}  // namespace outlier_rejection_test
}  // namespace tutti::judge
