// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/geometry/segment_covariance.hpp"

#include <utility>

#include "tutti/base/check.hpp"

namespace tutti {
namespace {

constexpr std::size_t kBlock = 16;  // places of one level that one place of the next stands for

Matrix6d moved(const Pose3& T_a_b, const Matrix6d& covariance_b) {
  const Matrix6d Ad = adjoint(T_a_b);
  const Matrix6d out = Ad * covariance_b * Ad.transpose();
  return 0.5 * (out + out.transpose());
}

}  // namespace

SegmentCovariance::Level::Level(std::vector<Matrix6d> steps) : step(std::move(steps)), upto(step), after(step) {
  const std::size_t n = step.size();
  for (std::size_t k = 0; k < n; ++k)
    if (k % kBlock == 0)
      upto[k].setZero();
    else
      upto[k] += upto[k - 1];
  after[n - 1].setZero();
  for (std::size_t k = n - 1; k-- > 0;) {
    after[k] = step[k + 1];
    if ((k + 1) % kBlock != 0) after[k] += after[k + 1];
  }
}

SegmentCovariance::SegmentCovariance(std::span<const Pose3> poses, std::span<const Matrix6d> steps) {
  TUTTI_CHECK(poses.size() == steps.size(), "{} poses, {} steps", poses.size(), steps.size());
  if (poses.empty()) return;
  const Pose3 T_first_w = poses.front().inverse();
  std::vector<Matrix6d> in_first;
  poses_.reserve(poses.size());
  in_first.reserve(poses.size());
  for (std::size_t k = 0; k < poses.size(); ++k) {
    poses_.push_back(T_first_w * poses[k]);
    in_first.push_back(k == 0 ? Matrix6d(Matrix6d::Zero()) : moved(poses_.back(), steps[k]));
  }
  for (;;) {
    const Level& level = levels_.emplace_back(std::move(in_first));
    if (level.step.size() <= kBlock) return;
    in_first = {Matrix6d::Zero()};
    for (std::size_t begin = 0; begin + kBlock < level.step.size(); begin += kBlock)
      in_first.push_back(level.after[begin]);
  }
}

Matrix6d SegmentCovariance::operator()(std::size_t a, std::size_t b) const {
  TUTTI_CHECK(a <= b && b < size(), "a = {}, b = {}, {} poses", a, b, size());
  Matrix6d sum = Matrix6d::Zero();
  if (a == b) return sum;
  const Pose3 T_b_first = poses_[b].inverse();
  auto level = levels_.begin();
  for (; b - a > kBlock; ++level) {
    sum += level->after[a] + level->upto[b];
    a = a / kBlock + 1;
    b /= kBlock;
  }
  for (std::size_t k = a + 1; k <= b; ++k) sum += level->step[k];
  return moved(T_b_first, sum);
}

std::size_t SegmentCovariance::bytes() const {
  std::size_t out = poses_.size() * sizeof(Pose3);
  for (const Level& level : levels_) out += 3 * level.step.size() * sizeof(Matrix6d);
  return out;
}

}  // namespace tutti
