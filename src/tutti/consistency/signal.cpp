// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/signal.hpp"

namespace tutti::consistency {

Eigen::MatrixXd DistanceSignal::evaluate(std::span<const Pose3> poses) const {
  Eigen::MatrixXd f(static_cast<Eigen::Index>(poses.size()), 1);
  for (std::size_t n = 0; n < poses.size(); ++n)
    f(static_cast<Eigen::Index>(n), 0) = (poses[n].translation - poses[0].translation).norm();
  return f;
}

Eigen::MatrixXd RelativeMotionSignal::evaluate(std::span<const Pose3> poses) const {
  Eigen::MatrixXd f = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(poses.size()), 6);
  for (std::size_t n = 1; n < poses.size(); ++n) {
    Vector6d motion = local(Pose3{}, poses[n - 1].inverse() * poses[n]);
    motion.tail<3>() *= kArm_m;
    f.row(static_cast<Eigen::Index>(n)) = motion.transpose();
  }
  return f;
}

Result<std::unique_ptr<Signal>> make_signal(const std::string& name) {
  if (name == "distance") return std::make_unique<DistanceSignal>();
  if (name == "relative_motion") return std::make_unique<RelativeMotionSignal>();
  return fail(ErrorCode::configuration, "signal '{}' is unknown, expected distance or relative_motion", name);
}

}  // namespace tutti::consistency
