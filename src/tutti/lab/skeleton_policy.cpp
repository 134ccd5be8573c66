// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <vector>

#include "tutti/consistency/links.hpp"
#include "tutti/consistency/time_chain.hpp"
#include "tutti/estimation/onboard_smoother.hpp"
#include "tutti/geometry/alignment.hpp"
#include "tutti/lab/policies.hpp"

namespace tutti::lab {
namespace {

using consistency::ConstraintKind;
using consistency::LinkCollector;
using consistency::PolicyInput;
using consistency::Selection;
using consistency::TimeChain;

/// The robot's raw chain as a smoother; each run of odometry is compounded once, however often the joints change.
estimation::OnboardSmoother make_smoother(const TimeChain& chain) {
  estimation::OnboardSmoother smoother({}, chain.server.front());
  for (std::size_t k = 1; k < chain.odometry.size(); ++k) smoother.append(chain.odometry[k]);
  return smoother;
}

/// The robot's own chain with every joint fixed where the server has it: between two joints the smoother spreads the
/// end error along the odometry by its covariance.
std::vector<Pose3> spread(estimation::OnboardSmoother& smoother, const TimeChain& chain,
                          const std::vector<std::size_t>& joints) {
  constexpr double kHeld = 1e-10;  // variance, m^2 and rad^2: as good as exact
  std::vector<estimation::ChainConstraint> links;
  for (std::size_t j = 1; j < joints.size(); ++j)
    links.push_back({joints[j - 1],
                     joints[j],
                     {chain.server[joints[j - 1]].inverse() * chain.server[joints[j]], Matrix6d::Identity() * kHeld}});
  smoother.set_constraints(std::move(links));
  smoother.solve();
  return smoother.poses();
}

/// Distance of every node from where the server has it. Without joints the frames are free: best rigid alignment.
std::vector<double> disagreements(const TimeChain& chain, const std::vector<Pose3>& predicted, bool aligned) {
  std::vector<Eigen::Vector3d> wanted;
  std::vector<Eigen::Vector3d> own;
  for (std::size_t k = 0; k < predicted.size(); ++k) {
    wanted.push_back(chain.server[k].translation);
    own.push_back(predicted[k].translation);
  }
  const Pose3 T = aligned ? Pose3{} : align_points(wanted, own);
  std::vector<double> out;
  for (std::size_t k = 0; k < own.size(); ++k) out.push_back((wanted[k] - T * own[k]).norm());
  return out;
}

/// The worst node strictly inside each run between two joints, those within tolerance left out.
std::vector<std::size_t> worst_nodes(const std::vector<double>& disagreement, const std::vector<std::size_t>& joints,
                                     double tolerance) {
  std::vector<std::size_t> worst;
  for (std::size_t j = 1; j < joints.size(); ++j) {
    if (joints[j] - joints[j - 1] < 2) continue;
    const auto begin = disagreement.begin() + static_cast<std::ptrdiff_t>(joints[j - 1]) + 1;
    const auto end = disagreement.begin() + static_cast<std::ptrdiff_t>(joints[j]);
    const auto most = std::max_element(begin, end);
    if (*most > tolerance) worst.push_back(static_cast<std::size_t>(most - disagreement.begin()));
  }
  return worst;
}

}  // namespace

Selection SkeletonPolicy::choose(const PolicyInput& input) const {
  LinkCollector collector(input, true);
  const std::size_t nodes = input.pairs.size();
  if (nodes < 2) return std::move(collector).take();
  const TimeChain chain = consistency::time_chain(input.graph, input.nodes, input.pairs);
  estimation::OnboardSmoother smoother = make_smoother(chain);
  std::vector<std::size_t> joints{0};
  const std::vector<double> raw = disagreements(chain, spread(smoother, chain, joints), false);
  if (*std::max_element(raw.begin(), raw.end()) <= tolerance_m_)
    return std::move(collector).take();  // the robot agrees as it is

  joints.push_back(nodes - 1);
  for (bool split = true; split;) {  // ends: every round adds a joint, and there are `nodes` of them
    const std::vector<double> disagreement = disagreements(chain, spread(smoother, chain, joints), true);
    split = false;
    for (const std::size_t node : worst_nodes(disagreement, joints, tolerance_m_)) {
      joints.push_back(node);
      split = true;
    }
    std::sort(joints.begin(), joints.end());
  }
  for (std::size_t j = 1; j < joints.size(); ++j) collector.add({joints[j - 1], joints[j]}, ConstraintKind::other);
  return std::move(collector).take();
}

}  // namespace tutti::lab
