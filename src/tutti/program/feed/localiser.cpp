// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/feed/localiser.hpp"

#include "tutti/robot/odometry_sample.hpp"

namespace tutti::program {

Status Localiser::add(const node::OdometrySample& sample) {
  const auto step = robot::usable_step(robot_, sample.stamp, sample.T_odom_body, sample.increment_covariance);
  if (!step) return tl::unexpected(step.error());
  const auto before = newest() ? std::optional(newest()->stamp) : std::nullopt;
  if (auto ok = robot::check_follows(robot_, sample.stamp, before); !ok) return ok;
  const Step next{{sample.stamp, step->T_odom_body}, step->covariance};
  if (!newest()) {
    watch_.take(next.fed);
    return {};
  }
  carry(next);
  steps_.push_back(next);
  if (steps_.size() > kMostSteps) {
    const Step &first = steps_[0], &second = steps_[1];
    const Matrix6d both =
        compound_covariance(first.fed.pose.inverse() * second.fed.pose, first.covariance, second.covariance);
    steps_[1].covariance = 0.5 * (both + both.transpose());
    steps_.pop_front();
  }
  return {};
}

void Localiser::carry(const Step& step) {
  const Pose3 before = watch_.T_odom_body();
  const auto [T_odom_body, jump] = watch_.take(step.fed);
  const Matrix6d moved =
      compound_covariance(before.inverse() * T_odom_body, covariance_, jump ? robot::unknown_step() : step.covariance);
  covariance_ = 0.5 * (moved + moved.transpose());
}

void Localiser::correct(const StampedPose& at, const Matrix6d& covariance, const robot::OdometryWatch& watch) {
  while (!steps_.empty() && steps_.front().fed.stamp <= at.stamp) steps_.pop_front();
  watch_ = watch.at(at);
  covariance_ = covariance;
  for (const Step& step : steps_) carry(step);
}

}  // namespace tutti::program
