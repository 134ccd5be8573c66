// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/pairwise_consistency.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "tutti/estimation/testing/random_graphs.hpp"

namespace tutti::estimation {
namespace {

using namespace testing;

constexpr RobotId kAlpha{1};
constexpr RobotId kBravo{2};

struct RobotRun {
  std::vector<Pose3> truth;
  OdometryChain chain;
};

/// A robot on a circle of 8 m, twice round, with random-walk odometry; its odom frame is anywhere.
RobotRun drifting_run(Rng& rng, RobotId robot, std::size_t steps, double sigma_m, double sigma_rad) {
  RobotRun run{.truth = {},
               .chain = {.robot = robot, .first_index = 10, .T_odom_body = {random_pose(rng)}, .step_covariance = {}}};
  const double phase = rng.uniform(0.0, 6.0);
  for (std::size_t k = 0; k <= steps; ++k) {
    const double angle = phase + 4.0 * 3.14159265358979 * static_cast<double>(k) / static_cast<double>(steps);
    run.truth.push_back({Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ())),
                         {8.0 * std::cos(angle), 8.0 * std::sin(angle), 0.2 * std::sin(3.0 * angle)}});
  }
  const Matrix6d covariance = random_covariance(rng, sigma_m, sigma_rad);
  for (std::size_t k = 0; k < steps; ++k) {
    const Pose3 step = retract(run.truth[k].inverse() * run.truth[k + 1], sample(rng, covariance));
    run.chain.T_odom_body.push_back(run.chain.T_odom_body.back() * step);
    run.chain.step_covariance.push_back(covariance);
  }
  return run;
}

LoopClosure closure(Rng& rng, const RobotRun& a, std::size_t i, const RobotRun& b, std::size_t j,
                    const Pose3& wrong_by = {}) {
  const Matrix6d covariance = random_covariance(rng, 0.03, 0.01);
  const Pose3 exact = a.truth[i].inverse() * b.truth[j] * wrong_by;
  return {.from = {a.chain.robot, static_cast<std::uint32_t>(10 + i)},
          .to = {b.chain.robot, static_cast<std::uint32_t>(10 + j)},
          .measurement = {retract(exact, sample(rng, covariance)), covariance}};
}

struct Scene {
  std::vector<OdometryChain> chains;
  std::vector<LoopClosure> closures;
  std::vector<bool> is_true;
};

Scene scene(std::uint64_t seed, std::size_t right, std::size_t wrong, double sigma_m, double sigma_rad, bool intra) {
  Rng rng(seed);
  const RobotRun a = drifting_run(rng, kAlpha, 300, sigma_m, sigma_rad);
  const RobotRun b = intra ? a : drifting_run(rng, kBravo, 280, sigma_m, sigma_rad);
  Scene out{.chains = {a.chain}, .closures = {}, .is_true = {}};
  if (!intra) out.chains.push_back(b.chain);
  for (std::size_t k = 0; k < right + wrong; ++k) {
    const bool is_true = rng.index(right + wrong) < right;
    const auto i = static_cast<std::size_t>(rng.index(intra ? 120 : 280));
    const auto j = intra ? 150 + static_cast<std::size_t>(rng.index(120)) : static_cast<std::size_t>(rng.index(280));
    const Pose3 wrong_by = is_true ? Pose3{} : random_pose(rng, 4.0, 0.8);
    out.closures.push_back(rng.bernoulli(0.5) ? closure(rng, a, i, b, j, wrong_by)
                                              : closure(rng, b, j, a, i, wrong_by.inverse()));
    out.is_true.push_back(is_true);
  }
  return out;
}

struct Score {
  std::size_t right = 0, kept = 0, wrong_kept = 0;
};
Score score(const Scene& scene, const std::vector<bool>& accepted) {
  Score s;
  for (std::size_t k = 0; k < accepted.size(); ++k) {
    s.right += scene.is_true[k] ? 1 : 0;
    s.kept += scene.is_true[k] && accepted[k] ? 1 : 0;
    s.wrong_kept += !scene.is_true[k] && accepted[k] ? 1 : 0;
  }
  return s;
}

TEST(PairwiseConsistency, FindsThePlantedClosuresAmongFiftyPercentWrongOnes) {
  for (const bool intra : {false, true}) {
    for (std::uint64_t seed = 0; seed < 5; ++seed) {
      const Scene s = scene(seed, 40, 40, 0.01, 0.002, intra);
      const auto result = pairwise_consistency(s.chains, s.closures);
      const Score score_ = score(s, result.accepted);
      EXPECT_EQ(score_.wrong_kept, 0U) << seed;
      EXPECT_GE(10 * score_.kept, 9 * score_.right) << seed << ": " << score_.kept << " of " << score_.right;
      ASSERT_EQ(result.groups.size(), 1U);
      EXPECT_EQ(result.groups[0].first, kAlpha);
      EXPECT_EQ(result.groups[0].second, intra ? kAlpha : kBravo);
    }
  }
}

TEST(PairwiseConsistency, KeepsTrueClosuresUnderDriftThatNoRigidTransformFits) {
  Scene s = scene(3, 60, 20, 0.03, 0.01, false);
  const auto result = pairwise_consistency(s.chains, s.closures);
  const Score path_dependent = score(s, result.accepted);
  EXPECT_GE(10 * path_dependent.kept, 9 * path_dependent.right)
      << path_dependent.kept << " of " << path_dependent.right;
  // The same with odometry believed perfect, which asks for one rigid transform, loses most of them.
  for (auto& chain : s.chains)
    for (auto& covariance : chain.step_covariance) covariance *= 1e-9;
  const Score rigid = score(s, pairwise_consistency(s.chains, s.closures).accepted);
  EXPECT_LT(2 * rigid.kept, path_dependent.kept);
}

TEST(PairwiseConsistency, DoesNotDependOnTheOrderOfTheInput) {
  const Scene s = scene(4, 30, 30, 0.01, 0.005, false);
  const auto before = pairwise_consistency(s.chains, s.closures);
  Rng rng(9);
  for (int repetition = 0; repetition < 5; ++repetition) {
    std::vector<std::size_t> order(s.closures.size());
    for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
    for (std::size_t k = order.size() - 1; k > 0; --k) std::swap(order[k], order[rng.index(k + 1)]);
    std::vector<LoopClosure> permuted;
    for (const std::size_t k : order) permuted.push_back(s.closures[k]);
    std::vector<OdometryChain> chains(s.chains.rbegin(), s.chains.rend());
    const auto after = pairwise_consistency(chains, permuted);
    for (std::size_t k = 0; k < order.size(); ++k) EXPECT_EQ(after.accepted[k], before.accepted[order[k]]);
  }
}

TEST(PairwiseConsistency, AgreementOfTrueClosuresHasTheChosenConfidence) {
  // Pairs of two: both accepted when they agree, one when not.
  int agreed = 0;
  constexpr int kPairs = 2000;
  Rng rng(11);
  for (int k = 0; k < kPairs; ++k) {
    const RobotRun a = drifting_run(rng, kAlpha, 12, 0.02, 0.005);
    const RobotRun b = drifting_run(rng, kBravo, 12, 0.02, 0.005);
    const std::vector<OdometryChain> chains{a.chain, b.chain};
    const std::vector<LoopClosure> pair{closure(rng, a, rng.index(12), b, rng.index(12)),
                                        closure(rng, b, rng.index(12), a, rng.index(12))};
    const auto result = pairwise_consistency(chains, pair, {.confidence = 0.9});
    agreed += result.accepted[0] && result.accepted[1] ? 1 : 0;
  }
  EXPECT_NEAR(static_cast<double>(agreed) / kPairs, 0.9, 0.025);
}

TEST(PairwiseConsistency, LeavesOutWhatItCannotUse) {
  Rng rng(12);
  const RobotRun a = drifting_run(rng, kAlpha, 20, 0.01, 0.001);
  const RobotRun b = drifting_run(rng, kBravo, 20, 0.01, 0.001);
  std::vector<LoopClosure> closures(6, closure(rng, a, 3, b, 4));
  closures[1].to.robot = RobotId{77};
  closures[2].to.index = 500;
  closures[3].measurement.T_a_b.translation.x() = std::numeric_limits<double>::quiet_NaN();
  closures[4].measurement.covariance(2, 2) = -1.0;
  closures[5].from.index = 2;  // below first_index
  const std::vector<OdometryChain> chains{a.chain, b.chain};
  const auto result = pairwise_consistency(chains, closures);
  EXPECT_EQ(result.accepted, (std::vector<bool>{true, false, false, false, false, false}));
  ASSERT_EQ(result.groups.size(), 1U);
  EXPECT_EQ(result.groups[0].closures, std::vector<std::size_t>{0});
  EXPECT_TRUE(pairwise_consistency({}, {}).groups.empty());
}

}  // namespace
}  // namespace tutti::estimation
