// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/feed/carried_pose.hpp"

#include "tutti/robot/odometry_sample.hpp"

namespace tutti::program {

Result<bool> CarriedPose::add(const OdometrySample& sample) {
  const auto fed = robot::usable_step(robot_, sample);
  if (!fed) return tl::unexpected(fed.error());
  const auto before = newest() ? std::optional(newest()->stamp) : std::nullopt;
  if (auto ok = robot::check_follows(robot_, sample.stamp, before); !ok) return tl::unexpected(ok.error());
  const Pose3 T_odom_before = watch_.T_odom_body();
  const auto [T_odom_body, jump] = watch_.take({sample.stamp, fed->T_odom_body});
  if (!before) return false;
  const RelativePose motion{T_odom_before.inverse() * T_odom_body, jump ? robot::unknown_step() : fed->covariance};
  carry(motion);
  steps_.push_back({sample.stamp, motion});
  if (steps_.size() > kMostSteps) {
    steps_[1].motion = compound(steps_[0].motion, steps_[1].motion);
    steps_.pop_front();
  }
  return jump.has_value();
}

void CarriedPose::carry(const RelativePose& motion) {
  const Matrix6d moved = compound_covariance(motion.T_a_b, covariance_, motion.covariance);
  covariance_ = 0.5 * (moved + moved.transpose());
}

void CarriedPose::correct(const robot::OdometryWatch& watch, const Matrix6d& covariance) {
  const auto& heard = watch.state().newest;
  while (!steps_.empty() && heard && steps_.front().end <= heard->stamp) steps_.pop_front();
  // The agent may make something else of samples that were taken together.
  if (!newest() || (heard && heard->stamp >= newest()->stamp)) watch_ = watch;
  covariance_ = covariance;
  for (const Step& step : steps_) carry(step.motion);
}

}  // namespace tutti::program
