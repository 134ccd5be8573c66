// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/odometry_trial.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
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
               .chain = {.id = robot, .first_index = 10, .T_odom_body = {random_pose(rng)}, .step_covariance = {}}};
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
  return {.from = {a.chain.id, static_cast<std::uint32_t>(10 + i)},
          .to = {b.chain.id, static_cast<std::uint32_t>(10 + j)},
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

TEST(OdometryTrial, FindsThePlantedClosuresAmongFiftyPercentWrongOnes) {
  for (const bool intra : {false, true}) {
    for (std::uint64_t seed = 0; seed < 5; ++seed) {
      const Scene s = scene(seed, 40, 40, 0.01, 0.002, intra);
      const auto result = try_odometry(s.chains, s.closures, {});
      const Score score_ = score(s, result.accepted);
      EXPECT_EQ(score_.wrong_kept, 0U) << seed;
      EXPECT_GE(10 * score_.kept, 9 * score_.right) << seed << ": " << score_.kept << " of " << score_.right;
      EXPECT_TRUE(result.failed.empty()) << seed;
    }
  }
}

TEST(OdometryTrial, KeepsTrueClosuresUnderDriftThatNoRigidTransformFits) {
  Scene s = scene(3, 60, 20, 0.03, 0.01, false);
  const auto result = try_odometry(s.chains, s.closures, {});
  const Score path_dependent = score(s, result.accepted);
  EXPECT_GE(10 * path_dependent.kept, 9 * path_dependent.right)
      << path_dependent.kept << " of " << path_dependent.right;
  // The same with odometry believed perfect, which asks for one rigid transform, loses most of them.
  for (auto& chain : s.chains)
    for (auto& covariance : chain.step_covariance) covariance *= 1e-9;
  const Score rigid = score(s, try_odometry(s.chains, s.closures, {}).accepted);
  EXPECT_LT(2 * rigid.kept, path_dependent.kept);
}

TEST(OdometryTrial, DoesNotDependOnTheOrderOfTheInput) {
  const Scene s = scene(4, 30, 30, 0.01, 0.005, false);
  const auto before = try_odometry(s.chains, s.closures, {});
  Rng rng(9);
  for (int repetition = 0; repetition < 5; ++repetition) {
    std::vector<std::size_t> order(s.closures.size());
    for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
    for (std::size_t k = order.size() - 1; k > 0; --k) std::swap(order[k], order[rng.index(k + 1)]);
    std::vector<LoopClosure> permuted;
    for (const std::size_t k : order) permuted.push_back(s.closures[k]);
    std::vector<OdometryChain> chains(s.chains.rbegin(), s.chains.rend());
    const auto after = try_odometry(chains, permuted, {});
    for (std::size_t k = 0; k < order.size(); ++k) EXPECT_EQ(after.accepted[k], before.accepted[order[k]]);
  }
}

TEST(OdometryTrial, AgreementOfTrueClosuresHasTheChosenConfidence) {
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
    const auto result = try_odometry(chains, pair, {.confidence = 0.9, .min_joining_closures = 1});
    agreed += result.accepted[0] && result.accepted[1] ? 1 : 0;
  }
  EXPECT_NEAR(static_cast<double>(agreed) / kPairs, 0.9, 0.025);
}

TEST(OdometryTrial, LeavesOutWhatItCannotUse) {
  Rng rng(12);
  const RobotRun a = drifting_run(rng, kAlpha, 20, 0.01, 0.001);
  const RobotRun b = drifting_run(rng, kBravo, 20, 0.01, 0.001);
  std::vector<LoopClosure> closures(6, closure(rng, a, 3, b, 4));
  closures[1].to.chain = RobotId{77};
  closures[2].to.index = 500;
  closures[3].measurement.T_a_b.translation.x() = std::numeric_limits<double>::quiet_NaN();
  closures[4].measurement.covariance(2, 2) = -1.0;
  closures[5].from.index = 2;  // below first_index
  const std::vector<OdometryChain> chains{a.chain, b.chain};
  const auto result = try_odometry(chains, closures, {.min_joining_closures = 1});
  EXPECT_EQ(result.accepted, (std::vector<bool>{true, false, false, false, false, false}));
  EXPECT_TRUE(try_odometry({}, {}, {}).accepted.empty());
}

/// One robot walks 20 m squares; from step 100 on its odometry is off by 2 m and 20 degrees and does not know.
RobotRun failing_run(Rng& rng) {
  RobotRun run{.truth = {}, .chain = {.id = kAlpha, .first_index = 10}};
  const Matrix6d covariance = random_covariance(rng, 0.01, 0.001);
  for (int k = 0; k <= 200; ++k) {
    const double s = std::fmod(k, 80.0);
    const int side = static_cast<int>(s) / 20;
    const double along = s - 20.0 * side;
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(side * M_PI / 2, Eigen::Vector3d::UnitZ()));
    const Pose3 corner[] = {{turn, {0, 0, 0}}, {turn, {20, 0, 0}}, {turn, {20, 20, 0}}, {turn, {0, 20, 0}}};
    run.truth.push_back(corner[side] * Pose3{Eigen::Quaterniond::Identity(), {along, 0, 0}});
  }
  run.chain.T_odom_body.push_back(random_pose(rng));
  for (int k = 0; k < 200; ++k) {
    Pose3 step = retract(run.truth[k].inverse() * run.truth[k + 1], sample(rng, covariance));
    if (k == 100) step = step * Pose3{Eigen::Quaterniond(Eigen::AngleAxisd(0.35, Eigen::Vector3d::UnitZ())), {2, 0, 0}};
    run.chain.T_odom_body.push_back(run.chain.T_odom_body.back() * step);
    run.chain.step_covariance.push_back(covariance);
  }
  return run;
}

/// Closures over the failure, one every 5 m of way from step 105 on, with where the robot was 80 steps before.
std::vector<LoopClosure> closures_over(Rng& rng, const RobotRun& run, std::size_t count) {
  std::vector<LoopClosure> out;
  for (std::size_t k = 0; k < count; ++k) out.push_back(closure(rng, run, 25 + 5 * k, run, 105 + 5 * k));
  return out;
}

TEST(OdometryTrial, ALoneClosureConvictsItselfManyConvictTheOdometry) {
  Rng rng(21);
  const RobotRun run = failing_run(rng);
  const std::vector<OdometryChain> chains{run.chain};
  const auto few = try_odometry(chains, closures_over(rng, run, 3), {});
  EXPECT_TRUE(few.failed.empty());
  EXPECT_EQ(few.accepted, std::vector<bool>(3, false));

  const auto many = try_odometry(chains, closures_over(rng, run, 12), {});
  ASSERT_EQ(many.failed.size(), 1U);
  EXPECT_EQ(many.failed[0].chain, ChainId(kAlpha));
  EXPECT_LE(many.failed[0].from, 10U + 100U);
  EXPECT_GE(many.failed[0].to, 10U + 101U);
  EXPECT_LE(many.failed[0].to - many.failed[0].from, 30U);
  EXPECT_EQ(many.accepted, std::vector<bool>(12, true));
}

TEST(OdometryTrial, ManyClosuresAtOnePairOfPlacesConvictNothing) {
  Rng rng(22);
  const RobotRun run = failing_run(rng);
  std::vector<LoopClosure> closures;
  for (std::size_t i = 0; i < 5; ++i)
    for (std::size_t j = 0; j < 5; ++j) closures.push_back(closure(rng, run, 25 + i, run, 105 + j));
  EXPECT_TRUE(try_odometry(std::vector{run.chain}, closures, {}).failed.empty());
}

TEST(OdometryTrial, WitnessesAcquit) {
  // The same look-alikes over a stretch that did not fail, and what was seen before and after it.
  Rng rng(23);
  RobotRun run = failing_run(rng);
  for (int k = 0; k < 200; ++k)
    run.chain.T_odom_body[k + 1] = run.chain.T_odom_body[k] * (run.truth[k].inverse() * run.truth[k + 1]);
  std::vector<LoopClosure> wrong;
  const Pose3 off{Eigen::Quaterniond::Identity(), {1.5, 0.0, 0.0}};
  for (std::size_t k = 0; k < 8; ++k) {
    const Pose3& at = run.truth[85 + 5 * k];
    wrong.push_back(closure(rng, run, 5 + 5 * k, run, 85 + 5 * k, at.inverse() * off * at));
  }
  const std::vector<OdometryChain> chains{run.chain};
  EXPECT_EQ(try_odometry(chains, wrong, {}).failed.size(), 1U);  // nothing speaks for the odometry
  std::vector<LoopClosure> all = wrong;
  for (std::size_t k = 0; k < 8; ++k) all.push_back(closure(rng, run, 2 + 4 * k, run, 162 + 4 * k));
  const auto verdict = try_odometry(chains, all, {});
  EXPECT_TRUE(verdict.failed.empty());
  for (std::size_t k = 0; k < all.size(); ++k) EXPECT_EQ(verdict.accepted[k], k >= wrong.size());
}

}  // namespace
}  // namespace tutti::estimation
