// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/feed/localiser.hpp"

#include "tutti/robot/odometry_sample.hpp"

namespace tutti::program {

Status Localiser::add(const node::OdometrySample& sample) {
  const auto step = robot::usable_step(robot_, sample.stamp, sample.T_odom_body, sample.increment_covariance);
  if (!step) return tl::unexpected(step.error());
  const auto before = newest_ ? std::optional(newest_->stamp) : std::nullopt;
  if (auto ok = robot::check_follows(robot_, sample.stamp, before); !ok) return ok;
  if (newest_) {
    const RelativePose motion{newest_->pose.inverse() * step->T_odom_body, step->covariance};
    carry(motion);
    steps_.push_back({sample.stamp, motion});
    if (steps_.size() > kMostSteps) {
      steps_[1].motion = compound(steps_[0].motion, steps_[1].motion);
      steps_.pop_front();
    }
  }
  newest_ = {sample.stamp, step->T_odom_body};
  return {};
}

void Localiser::carry(const RelativePose& motion) {
  const Matrix6d moved = compound_covariance(motion.T_a_b, covariance_, motion.covariance);
  covariance_ = 0.5 * (moved + moved.transpose());
}

void Localiser::correct(const StampedPose& at, const Matrix6d& covariance) {
  while (!steps_.empty() && steps_.front().end <= at.stamp) steps_.pop_front();
  if (!newest_ || newest_->stamp < at.stamp) newest_ = at;
  covariance_ = covariance;
  for (const Step& step : steps_) carry(step.motion);
}

}  // namespace tutti::program
