// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/bundle/imu_trial.hpp"

#include <cmath>
#include <map>
#include <memory>
#include <optional>

#include "tutti/base/disjoint_sets.hpp"
#include "tutti/estimation/bundle/path_scale.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::bundle {
namespace {

/// Per IMU factor the number of its run; of the first one 0.
std::vector<std::size_t> runs_of(const BundleProblem& problem) {
  DisjointSets sets(problem.keyframes.size());
  for (const BundleImu& imu : problem.imu) sets.join(imu.from, imu.to);
  const std::vector<int> labels = sets.labels().first;
  std::map<int, std::size_t> number;
  std::vector<std::size_t> out;
  for (const BundleImu& imu : problem.imu)
    out.push_back(number.try_emplace(labels[imu.from], number.size()).first->second);
  return out;
}

constexpr double kRounding = 1e-9;  ///< A trajectory's between keyframes that all keep their poses.

BundleProblem started_at(BundleProblem problem, const BundleSolution& solution) {
  for (std::size_t k = 0; k < problem.keyframes.size(); ++k)
    problem.keyframes[k].T_world_body = solution.T_world_body[k];
  problem.landmarks = solution.landmarks;
  return problem;
}

/// Judges what the factors of every run are worth.
class Trial {
 public:
  Trial(const BundleProblem& problem, std::vector<std::size_t> run_of) : problem_(problem), run_of_(std::move(run_of)) {
    for (std::size_t i = 0; i < problem.imu.size(); ++i) {
      if (run_of_[i] == runs_.size()) runs_.push_back({.chain = problem.keyframes[problem.imu[i].from].id.chain});
      ++runs_[run_of_[i]].factors;
    }
  }

  void judge(const BundleSolution& without, const Posterior& posterior_without, const BundleSolution& with,
             const Posterior& posterior_with, const BundleConfig& config) {
    for (std::size_t r = 0; r < runs_.size(); ++r) {
      ImuRun& run = runs_[r];
      std::vector<ComparedStep> steps;
      for (std::size_t i = 0; i < problem_.imu.size(); ++i) {
        const auto& [from, to, measured] = problem_.imu[i];
        if (run_of_[i] != r) continue;
        const Pose3 T_from_to = with.T_world_body[from].inverse() * with.T_world_body[to];
        steps.push_back({from, to, T_from_to.translation});
      }
      const std::size_t middle = steps[steps.size() / 2].from;
      const Eigen::Matrix3d bias = posterior_with.accelerometer_bias(middle);
      run.bias_sigma_mps2 = largest_sigma(bias);
      const PathScale fit = path_scale(steps, without, posterior_without);
      run.scale = fit.scale > 0.0 ? 1.0 / fit.scale : 1.0;
      run.scale_sigma = std::sqrt(fit.variance);
      run.is_held_back = run.bias_sigma_mps2 > config.max_bias_sigma ||
                         std::abs(1.0 - fit.scale) > config.max_imu_scale_sigmas * run.scale_sigma + kRounding;
    }
  }
  void hold_all_back() {
    for (ImuRun& run : runs_) run.is_held_back = true;
  }
  [[nodiscard]] bool is_held_back(std::size_t imu) const { return runs_[run_of_[imu]].is_held_back; }
  std::vector<ImuRun> take() { return std::move(runs_); }

 private:
  const BundleProblem& problem_;
  std::vector<std::size_t> run_of_;
  std::vector<ImuRun> runs_;
};

}  // namespace

Result<BundleSolution> adjust_with_believed_imu(BundleProblem& problem, const BundleConfig& config,
                                                std::vector<ImuRun>& runs) {
  const auto adjuster = make_ceres_bundle_adjuster(config);
  if (problem.imu.empty()) return adjuster->adjust(problem);
  BundleProblem bare = problem;
  bare.imu.clear();
  auto without = adjuster->adjust(bare);
  if (!without) return without;
  auto with = adjuster->adjust(started_at(problem, *without));
  if (!with) return with;
  const auto posterior_without = Posterior::of(bare, *without, config);
  const auto posterior_with = Posterior::of(problem, *with, config);
  Trial trial(problem, runs_of(problem));
  if (posterior_without && posterior_with && estimation::is_usable(with->summary.termination))
    trial.judge(*without, *posterior_without, *with, *posterior_with, config);
  else
    trial.hold_all_back();
  std::vector<BundleImu> believed;
  for (std::size_t i = 0; i < problem.imu.size(); ++i)
    if (!trial.is_held_back(i)) believed.push_back(problem.imu[i]);
  runs = trial.take();
  if (believed.size() == problem.imu.size()) return with;
  problem.imu = std::move(believed);
  if (problem.imu.empty()) return without;
  return adjuster->adjust(started_at(problem, *without));
}

}  // namespace tutti::bundle
