// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/internal/drift_origins.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tutti/base/chi_square.hpp"
#include "tutti/consistency/internal/odometry_drift.hpp"
#include "tutti/geometry/segment_covariance.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::consistency::internal {
namespace {

constexpr double kDegrees = 6.0;
/// Segments within this share of the largest statistic stand out "nearly alike".
constexpr double kAlike = 0.98;
constexpr std::size_t kMostSegments = 20;

double quantile(std::vector<double> values, double share) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Clips the variances (eigenvalues) of a 3 x 3 block.
void clip(Eigen::Ref<Eigen::Matrix3d> block, double largest) {
  const auto [values, vectors] = quick_eigen_of(block);
  block = vectors * values.cwiseMin(largest).cwiseMax(0.0).asDiagonal() * vectors.transpose();
}

/// Odometry with no step less sure, per metre, than usual.
std::vector<RelativePose> usual_odometry(const TimeChain& chain) {
  constexpr double kLeastStep_m = 0.1;
  constexpr double kUnusual = 2.0;  // times the median; brought back to the median
  std::vector<double> metres, radians;
  const auto length = [&](std::size_t k) {
    return std::max(kLeastStep_m, (chain.server[k].translation - chain.server[k - 1].translation).norm());
  };
  for (std::size_t k = 1; k < chain.odometry.size(); ++k) {
    const Matrix6d& C = chain.odometry[k].covariance;
    metres.push_back(eigen_of(Eigen::Matrix3d(C.topLeftCorner<3, 3>())).values(2) / length(k));
    radians.push_back(eigen_of(Eigen::Matrix3d(C.bottomRightCorner<3, 3>())).values(2) / length(k));
  }
  std::vector<RelativePose> out = chain.odometry;
  if (metres.empty()) return out;
  const double usual_m = quantile(metres, 0.5);
  const double usual_rad = quantile(radians, 0.5);
  for (std::size_t k = 1; k < out.size(); ++k) {
    if (metres[k - 1] <= kUnusual * usual_m && radians[k - 1] <= kUnusual * usual_rad) continue;
    Matrix6d& C = out[k].covariance;
    clip(C.topLeftCorner<3, 3>(), usual_m * length(k));
    clip(C.bottomRightCorner<3, 3>(), usual_rad * length(k));
    C.topRightCorner<3, 3>().setZero();
    C.bottomLeftCorner<3, 3>().setZero();
  }
  return out;
}

/// The server's variance of a relative pose over so many nodes where it knows its map well (lower quartile over the
/// blocks), by length: scales shorter than the segment move both ends, of longer ones only the slope counts. Not as it
/// knows it there: where odometry failed the server is unsure of what lies inside the segment, but not of how its ends
/// lie to each other.
std::vector<PoseSigma> server_variances(std::span<const double> scale_lengths_m, const ChainUncertainty* uncertainty,
                                        std::size_t nodes) {
  std::vector<PoseSigma> out(nodes);
  if (uncertainty == nullptr || scale_lengths_m.empty()) return out;
  const double spacing_m = std::max(1e-3, scale_lengths_m.front() / static_cast<double>(nodes));
  for (std::size_t s = 0; s < scale_lengths_m.size(); ++s) {
    std::vector<double> metres, radians;
    for (const PoseSigma& sigma : uncertainty->scales[s].sigma) {
      metres.push_back(sigma.position_m);
      radians.push_back(sigma.rotation_rad);
    }
    if (metres.empty()) continue;
    const double usual_m = quantile(metres, 0.25), usual_rad = quantile(radians, 0.25);
    const double scale_length = std::max(1.0, scale_lengths_m[s] / spacing_m);
    for (std::size_t length = 0; length < nodes; ++length) {
      const double share = 2.0 * std::pow(std::min(1.0, static_cast<double>(length) / scale_length), 2);
      out[length].position_m += share * usual_m * usual_m;
      out[length].rotation_rad += share * usual_rad * usual_rad;
    }
  }
  return out;
}

/// By covariance of the steps.
SegmentCovariance segments(std::span<const Pose3> poses, std::span<const RelativePose> steps) {
  std::vector<Matrix6d> covariances;
  for (const RelativePose& step : steps) covariances.push_back(step.covariance);
  return {poses, covariances};
}

class Scan {
 public:
  Scan(const TimeChain& chain, std::vector<PoseSigma> server)
      : poses_(chain.server),
        odometry_(chain.odometry),
        drift_(chain.server, chain.odometry),
        usual_(segments(chain.server, usual_odometry(chain))),
        server_(std::move(server)) {}

  [[nodiscard]] double statistic(std::size_t a, std::size_t b) const { return statistic(usual_(a, b), a, b); }
  [[nodiscard]] double stated_statistic(std::size_t a, std::size_t b) const {
    const std::size_t nodes = b - a + 1;  // few segments are asked for: the table is of this one only
    return statistic(segments(poses_.subspan(a, nodes), odometry_.subspan(a, nodes))(0, b - a), a, b);
  }

 private:
  [[nodiscard]] double statistic(Matrix6d C, std::size_t a, std::size_t b) const {
    Vector6d missed = drift_.missed(a, b);  // turned into the axes of pose b, as the covariance
    const Eigen::Quaterniond to_b = poses_[b].rotation.conjugate();
    missed << to_b * missed.head<3>(), to_b * missed.tail<3>();
    C.diagonal().head<3>().array() += server_[b - a].position_m + 1e-6;
    C.diagonal().tail<3>().array() += server_[b - a].rotation_rad + 1e-7;
    return squared_distance(missed, C);
  }
  std::span<const Pose3> poses_;
  std::span<const RelativePose> odometry_;
  OdometryDrift drift_;
  SegmentCovariance usual_;
  std::vector<PoseSigma> server_;  // variances by length
};

struct Segment {
  std::size_t a = 0, b = 0;
  double statistic = 0.0;
};

/// All places, lengths in steps of half an octave.
std::vector<Segment> candidates(const Scan& scan, std::size_t nodes, double threshold) {
  std::vector<Segment> out;
  for (double length = 2.0; length < static_cast<double>(nodes); length *= std::sqrt(2.0)) {
    const auto l = static_cast<std::size_t>(std::lround(length));
    const std::size_t stride = std::max<std::size_t>(1, l / 8);
    for (std::size_t a = 0; a + l < nodes; a += stride)
      if (const double z = scan.statistic(a, a + l); z > threshold) out.push_back({a, a + l, z});
  }
  return out;
}

/// Moves the ends where the statistic grows, then inwards as long as it stays nearly as large.
void settle(const Scan& scan, Segment& s, std::size_t low, std::size_t high) {
  for (std::size_t step = std::max<std::size_t>(1, (s.b - s.a) / 4); step > 0; step /= 2)
    for (bool moved = true; moved;) {
      moved = false;
      const auto consider = [&](std::size_t a, std::size_t b) {
        if (const double z = scan.statistic(a, b); z > s.statistic * (1.0 + 1e-9)) {
          s = {a, b, z};
          moved = true;
        }
      };
      if (s.a >= low + step) consider(s.a - step, s.b);
      if (s.b + step <= high) consider(s.a, s.b + step);
      if (s.a + step < s.b) consider(s.a + step, s.b);
      if (s.b > s.a + step) consider(s.a, s.b - step);
    }
  const double enough = kAlike * s.statistic;
  while (s.a + 1 < s.b) {
    const double from_left = scan.statistic(s.a + 1, s.b);
    const double from_right = scan.statistic(s.a, s.b - 1);
    if (std::max(from_left, from_right) < enough) break;
    (from_left >= from_right) ? ++s.a : --s.b;
  }
  s.statistic = scan.statistic(s.a, s.b);
}

}  // namespace

std::vector<DriftSegment> drift_segments(const TimeChain& chain, std::span<const double> scale_lengths_m,
                                         const ChainUncertainty* uncertainty, double probability) {
  const std::size_t nodes = chain.server.size();
  std::vector<DriftSegment> out;
  if (nodes < 4) return out;
  const Scan scan(chain, server_variances(scale_lengths_m, uncertainty, nodes));
  // Segments that overlap measure much the same: about as many independent ones as nodes.
  const double threshold = chi_square_exceeded_with(probability / static_cast<double>(nodes), kDegrees);
  std::vector<Segment> found = candidates(scan, nodes, threshold);
  while (!found.empty() && out.size() < kMostSegments) {
    Segment best = *std::ranges::max_element(found, {}, &Segment::statistic);
    std::size_t low = 0, high = nodes - 1;
    for (const DriftSegment& other : out) {
      if (other.last <= best.a) low = std::max(low, other.last);
      if (other.first >= best.b) high = std::min(high, other.first);
    }
    settle(scan, best, low, high);
    out.push_back(
        {best.a, best.b, std::sqrt(best.statistic / threshold), scan.stated_statistic(best.a, best.b) > threshold});
    std::erase_if(found, [&](const Segment& s) { return s.a < best.b && best.a < s.b; });
  }
  std::ranges::sort(out, {}, &DriftSegment::first);
  return out;
}

}  // namespace tutti::consistency::internal
