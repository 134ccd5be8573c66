// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/shape_ties.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "tutti/base/check.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/server/displacements.hpp"
#include "tutti/server/worst_sigma.hpp"

namespace tutti::server {
namespace {

constexpr std::size_t kMostLookedAt = 200;
constexpr Eigen::Index kFewestSamples = 8;
constexpr double kTwiceAsWell = 4.0;  ///< Ratio of variances.
constexpr std::size_t kShare = 8;     ///< Of the way between two tied nodes: nothing else is tied so close to both.

/// What T_a_b is off by for each sample, in position, turned into the axes of `world`: 3 x samples.
Eigen::Matrix3Xd position_error(const Displacements& x, std::span<const Pose3> poses, std::size_t a, std::size_t b) {
  const auto from = 3 * static_cast<Eigen::Index>(a), to = 3 * static_cast<Eigen::Index>(b);
  const Eigen::Vector3d arm = poses[b].translation - poses[a].translation;
  return x.position_m.middleRows<3>(to) - x.position_m.middleRows<3>(from) +
         skew(arm) * x.rotation_rad.middleRows<3>(from);
}

/// The same in rotation.
Eigen::Matrix3Xd rotation_error(const Displacements& x, std::size_t a, std::size_t b) {
  const auto from = 3 * static_cast<Eigen::Index>(a), to = 3 * static_cast<Eigen::Index>(b);
  return x.rotation_rad.middleRows<3>(to) - x.rotation_rad.middleRows<3>(from);
}

/// Position variance of T_a_b, all directions together, when nothing but the steps between is known.
class Way {
 public:
  Way(std::span<const Pose3> poses, std::span<const Matrix6d> steps) : poses_(poses) {
    Matrix6d sum = Matrix6d::Zero();
    for (std::size_t k = 0; k < poses.size(); ++k) {
      const Matrix6d Ad = adjoint(poses[0].inverse() * poses[k]);
      if (k > 0) sum += Ad * steps[k] * Ad.transpose();
      until_.push_back(sum);
    }
  }
  [[nodiscard]] double variance_m2(std::size_t a, std::size_t b) const {
    Eigen::Matrix<double, 3, 6> J;
    J << Eigen::Matrix3d::Identity(), -skew((poses_[0].inverse() * poses_[b]).translation);
    return (J * (until_[b] - until_[a]) * J.transpose()).trace();
  }

 private:
  std::span<const Pose3> poses_;
  std::vector<Matrix6d> until_;  ///< Left tangents, seen from the first pose.
};

struct Candidate {
  std::size_t a = 0;
  std::size_t b = 0;
  double ratio = 0.0;  ///< Of the way's variance to the map's.
};

double largest_norm(const Eigen::Matrix3Xd& x) { return x.cols() == 0 ? 0.0 : x.colwise().norm().maxCoeff(); }

bool close_to(const Candidate& one, const Candidate& other) {
  const std::size_t radius = (one.b - one.a) / kShare;
  const auto apart = [](std::size_t x, std::size_t y) { return x < y ? y - x : x - y; };
  return apart(one.a, other.a) <= radius && apart(one.b, other.b) <= radius;
}

}  // namespace

std::vector<ShapeTie> shape_ties(std::span<const Pose3> poses, std::span<const Matrix6d> steps,
                                 const Eigen::MatrixXd& samples, const Eigen::MatrixXd& shifts, std::size_t most) {
  const auto rows = static_cast<Eigen::Index>(6 * poses.size());
  TUTTI_CHECK(steps.size() == poses.size(), "{} steps of {} poses", steps.size(), poses.size());
  TUTTI_CHECK(samples.rows() == rows && (shifts.cols() == 0 || shifts.rows() == rows),
              "{} rows of samples, {} of shifts, {} poses", samples.rows(), shifts.rows(), poses.size());
  if (most == 0 || samples.cols() < kFewestSamples) return {};
  const Eigen::Index half = samples.cols() / 2;
  const Displacements choosing(poses, samples.leftCols(half)), stating(poses, samples.rightCols(half)),
      moved(poses, shifts);
  const Way way(poses, steps);

  std::vector<Candidate> candidates;
  const std::size_t stride = (poses.size() + kMostLookedAt - 1) / kMostLookedAt;
  for (std::size_t a = 0; a < poses.size(); a += stride)
    for (std::size_t b = a + std::max(stride, 2 * ShapeUncertainty::kShortest); b < poses.size(); b += stride) {
      const double known = position_error(choosing, poses, a, b).squaredNorm() / static_cast<double>(half) +
                           std::pow(largest_norm(position_error(moved, poses, a, b)), 2);
      const double ratio = way.variance_m2(a, b) / known;
      if (ratio >= kTwiceAsWell) candidates.push_back({a, b, ratio});
    }
  std::ranges::sort(candidates, [](const Candidate& one, const Candidate& other) {
    return std::tuple(-one.ratio, one.a, one.b) < std::tuple(-other.ratio, other.a, other.b);
  });
  std::vector<Candidate> taken;
  for (const Candidate& candidate : candidates) {
    if (taken.size() == most) break;
    if (std::ranges::none_of(taken, [&](const Candidate& other) { return close_to(other, candidate); }))
      taken.push_back(candidate);
  }
  std::vector<ShapeTie> out;
  for (const auto& [a, b, ratio] : taken) {
    const auto sigma = [half](const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xd& y) {
      return std::hypot(worst_sigma(x * x.transpose(), static_cast<double>(half)), largest_norm(y));
    };
    out.push_back({static_cast<std::uint32_t>(a),
                   static_cast<std::uint32_t>(b),
                   {sigma(position_error(stating, poses, a, b), position_error(moved, poses, a, b)),
                    sigma(rotation_error(stating, a, b), rotation_error(moved, a, b))}});
  }
  std::ranges::sort(out, {}, [](const ShapeTie& tie) { return std::pair(tie.a, tie.b); });
  return out;
}

}  // namespace tutti::server
