// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/shape_ties.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "tutti/base/check.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/server/worst_sigma.hpp"

namespace tutti::server {
namespace {

constexpr std::size_t kMostLookedAt = 200;
constexpr Eigen::Index kFewestSamples = 8;
constexpr double kTwiceAsWell = 4.0;  ///< Ratio of variances.
constexpr std::size_t kShare = 8;     ///< Of the way between two tied nodes: nothing else is tied so close to both.

/// What nodes are off by, in the axes of `world`: one column per sample or shift.
struct Displacements {
  Displacements(std::span<const Pose3> poses, const Eigen::MatrixXd& tangents)
      : position_m(3 * static_cast<Eigen::Index>(poses.size()), tangents.cols()), rotation_rad(position_m) {
    for (std::size_t k = 0; k < poses.size(); ++k) {
      const Eigen::Matrix3d R = poses[k].rotation.toRotationMatrix();
      const auto row = static_cast<Eigen::Index>(k);
      position_m.middleRows<3>(3 * row) = R * tangents.middleRows<3>(6 * row);
      rotation_rad.middleRows<3>(3 * row) = R * tangents.middleRows<3>(6 * row + 3);
    }
  }
  Eigen::MatrixXd position_m;
  Eigen::MatrixXd rotation_rad;
};

/// What T_a_b is off by for each sample, turned into the axes of `world`: position and rotation, 3 x samples.
struct RelativeError {
  Eigen::Matrix3Xd position_m;
  Eigen::Matrix3Xd rotation_rad;
};
RelativeError relative_error(const Displacements& x, std::span<const Pose3> poses, std::size_t a, std::size_t b) {
  const auto from = 3 * static_cast<Eigen::Index>(a), to = 3 * static_cast<Eigen::Index>(b);
  const auto turn = x.rotation_rad.middleRows<3>(from);
  const Eigen::Vector3d arm = poses[b].translation - poses[a].translation;
  return {x.position_m.middleRows<3>(to) - x.position_m.middleRows<3>(from) + skew(arm) * turn,
          x.rotation_rad.middleRows<3>(to) - turn};
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
      moved(poses, shifts.cols() == 0 ? Eigen::MatrixXd(rows, 0) : shifts);
  const Way way(poses, steps);

  std::vector<Candidate> candidates;
  const std::size_t stride = (poses.size() + kMostLookedAt - 1) / kMostLookedAt;
  for (std::size_t a = 0; a < poses.size(); a += stride)
    for (std::size_t b = a + std::max(stride, 2 * ShapeUncertainty::kShortest); b < poses.size(); b += stride) {
      const double known = relative_error(choosing, poses, a, b).position_m.squaredNorm() / static_cast<double>(half) +
                           std::pow(largest_norm(relative_error(moved, poses, a, b).position_m), 2);
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
    const RelativeError error = relative_error(stating, poses, a, b), shift = relative_error(moved, poses, a, b);
    const auto sigma = [half](const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xd& y) {
      return std::hypot(worst_sigma(x * x.transpose(), static_cast<double>(half)), largest_norm(y));
    };
    out.push_back({static_cast<std::uint32_t>(a),
                   static_cast<std::uint32_t>(b),
                   {sigma(error.position_m, shift.position_m), sigma(error.rotation_rad, shift.rotation_rad)}});
  }
  std::ranges::sort(out, {}, [](const ShapeTie& tie) { return std::pair(tie.a, tie.b); });
  return out;
}

}  // namespace tutti::server
