// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/fix_alignment.hpp"

#include <fmt/core.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "tutti/base/chi_square.hpp"
#include "tutti/base/random.hpp"
#include "tutti/geometry/alignment.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::server {
namespace {

using Eigen::Matrix3d, Eigen::Vector3d;

/// So many pairs are tried, and as many triples: with half of the points wrong, one of 2^3 triples is right.
constexpr int kHypotheses = 150;
/// More points are thinned: the median by which a hypothesis is scored hardly changes.
constexpr std::size_t kMostPoints = 600;
constexpr int kRefinements = 10;
constexpr std::size_t kFewestSubmaps = 3;
constexpr double kTiltKnown_rad = 3.0 * kRadPerDeg;
constexpr double kYawKnown_rad = 5.0 * kRadPerDeg;
constexpr double kWorstFit = 1.0 / 7.0;
/// Noise does not explain misfits that are so many times their variance.
constexpr double kNotNoise = 9.0;
/// Up is down: the points are mirrored, which a turn about a level axis undoes.
constexpr double kUpsideDown = -0.7;  // cosine

/// Squared, in standard deviations.
double misfit(const FixedPoint& point, const Pose3& T_enu_world) {
  const Vector3d r = T_enu_world * point.p_world - point.p_enu;
  return squared_distance(r, point.covariance);
}

template <class Value>
double median_of(std::span<const FixedPoint> points, const Value& value) {
  std::vector<double> values;
  values.reserve(points.size());
  for (const FixedPoint& point : points) values.push_back(value(point));
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

/// By which the variances of all points count, so that half of them fit as half of them should.
double spread_factor(std::span<const FixedPoint> points, const Pose3& T_enu_world) {
  const double half = chi_square_quantile(0.5, 3.0);
  return std::max(1.0, median_of(points, [&](const FixedPoint& p) { return misfit(p, T_enu_world); }) / half);
}

/// A turn about the vertical and a shift that lay two points on two others.
Pose3 levelled_by(const FixedPoint& a, const FixedPoint& b) {
  const Vector3d world = b.p_world - a.p_world, enu = b.p_enu - a.p_enu;
  const double yaw = std::atan2(enu.y(), enu.x()) - std::atan2(world.y(), world.x());
  const Eigen::Quaterniond R(Eigen::AngleAxisd(yaw, Vector3d::UnitZ()));
  return {R, 0.5 * (a.p_enu + b.p_enu) - R * (0.5 * (a.p_world + b.p_world))};
}

struct Start {
  Pose3 T_enu_world;
  double median = std::numeric_limits<double>::infinity();
  void improve(const Pose3& T, std::span<const FixedPoint> points) {
    const double found = median_of(points, [&](const FixedPoint& p) { return misfit(p, T); });
    if (found < median) *this = {T, found};
  }
};
struct Starts {
  Start levelled, free;
};

Starts search(std::span<const FixedPoint> points) {
  Rng rng(0);
  Starts out;
  const auto draw = [&]() -> const FixedPoint& { return points[rng.index(points.size())]; };
  for (int k = 0; k < kHypotheses; ++k) {
    const FixedPoint &a = draw(), &b = draw(), &c = draw();
    if (a.submap == b.submap) continue;
    out.levelled.improve(levelled_by(a, b), points);
    if (c.submap == a.submap || c.submap == b.submap) continue;
    const std::array enu{a.p_enu, b.p_enu, c.p_enu}, world{a.p_world, b.p_world, c.p_world};
    out.free.improve(align_points(enu, world), points);
  }
  if (out.levelled.median < out.free.median) out.free = out.levelled;
  return out;
}

/// Normal equations of a shift of the middle and a turn about it.
struct Equations {
  Matrix6d H = Matrix6d::Zero();
  Vector6d g = Vector6d::Zero();

  /// The information on the turn with the shift marginalised out.
  [[nodiscard]] Matrix3d turn() const {
    const Matrix3d across = H.topRightCorner<3, 3>();
    return H.bottomRightCorner<3, 3>() - across.transpose() * H.topLeftCorner<3, 3>().llt().solve(across);
  }
};

Equations linearise(std::span<const FixedPoint> points, const FixAlignment& at, double factor) {
  Equations out;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!at.fits[i]) continue;
    const Vector3d p = at.T_enu_world * points[i].p_world;
    const Matrix3d W = points[i].weight / factor * points[i].covariance.inverse();
    Eigen::Matrix<double, 3, 6> J;
    J << Matrix3d::Identity(), -skew(p - at.middle_enu);
    out.H += J.transpose() * W * J;
    out.g += J.transpose() * W * (p - points[i].p_enu);
  }
  return out;
}

/// Which points fit, and their middle; by how much their variances count.
double choose(std::span<const FixedPoint> points, FixAlignment& at) {
  const double factor = spread_factor(points, at.T_enu_world), most = factor * chi_square_quantile(0.99, 3.0);
  double weight = 0.0;
  Vector3d sum = Vector3d::Zero();
  at.fits.assign(points.size(), false);
  for (std::size_t i = 0; i < points.size(); ++i) {
    at.fits[i] = misfit(points[i], at.T_enu_world) <= most;
    if (!at.fits[i]) continue;
    weight += points[i].weight;
    sum += points[i].weight * (at.T_enu_world * points[i].p_world);
  }
  at.middle_enu = sum / weight;
  return factor;
}

/// Least squares over those that fit; nothing when they leave a rotation that is asked for open.
std::optional<FixAlignment> refine(std::span<const FixedPoint> points, const Pose3& start, bool is_levelled) {
  FixAlignment out{.T_enu_world = start, .is_levelled = is_levelled};
  Matrix6d H;
  for (int k = 0; k <= kRefinements; ++k) {
    const double factor = choose(points, out);
    const Equations equations = linearise(points, out, factor);
    H = equations.H;
    if (is_levelled)  // of the turn only that about the vertical is free
      H.diagonal().segment<2>(3).array() += 1.0 / (kSigmaLevel_rad * kSigmaLevel_rad);
    else if (eigen_of(equations.turn()).values(0) < 1.0 / (kTiltKnown_rad * kTiltKnown_rad))
      return std::nullopt;
    if (k == kRefinements) break;
    Vector6d step = -solve_definite(H, equations.g);
    if (is_levelled) {
      Eigen::Matrix4d levelled;
      const std::array<int, 4> free{0, 1, 2, 5};
      Eigen::Vector4d g;
      for (int r = 0; r < 4; ++r) {
        g(r) = equations.g(free[r]);
        for (int c = 0; c < 4; ++c) levelled(r, c) = equations.H(free[r], free[c]);
      }
      const Eigen::Vector4d s = -levelled.ldlt().solve(g);
      step << s.head<3>(), 0.0, 0.0, s(3);
    }
    if (!step.allFinite()) break;
    const Eigen::Quaterniond turn = so3_exp(step.tail<3>());
    Pose3& T = out.T_enu_world;
    T = {(turn * T.rotation).normalized(), turn * (T.translation - out.middle_enu) + out.middle_enu + step.head<3>()};
  }
  out.covariance = inverse_of(H);
  return out;
}

/// Root mean square distance from the middle.
double spread_m(std::span<const FixedPoint> points, const FixAlignment& at) {
  double sum = 0.0, count = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!at.fits[i]) continue;
    sum += (at.T_enu_world * points[i].p_world - at.middle_enu).squaredNorm();
    count += 1.0;
  }
  return std::sqrt(sum / count);
}

std::string why_uncertain(std::span<const FixedPoint> points, const FixAlignment& at) {
  std::vector<std::size_t> submaps;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (at.fits[i] && (submaps.empty() || submaps.back() != points[i].submap)) submaps.push_back(points[i].submap);
  if (submaps.size() < kFewestSubmaps)
    return fmt::format("fixes of {} submaps agree, expected at least {}", submaps.size(), kFewestSubmaps);
  const double spread = spread_m(points, at);
  if (at.median_miss_m > kWorstFit * spread && spread_factor(points, at.T_enu_world) > kNotNoise)
    return fmt::format(
        "its fixes do not have the shape of its trajectory: half of them are {:.1f} m off or more, and it spreads "
        "by {:.1f} m (latitude and longitude swapped? stamps of another clock?)",
        at.median_miss_m, spread);
  if (!(at.sigma_yaw_rad() <= kYawKnown_rad))
    return fmt::format(
        "its heading is known to {:.0f} degrees only, expected {:.0f}: it has not moved far enough for "
        "what its fixes are worth (its trajectory spreads by {:.1f} m)",
        std::min(180.0, at.sigma_yaw_rad() / kRadPerDeg), kYawKnown_rad / kRadPerDeg, spread);
  if ((at.T_enu_world.rotation * Vector3d::UnitZ()).z() < kUpsideDown)
    return "its fixes are a mirror image of its trajectory: are latitude and longitude swapped?";
  return {};
}

}  // namespace

double FixAlignment::sigma_m() const { return largest_sigma(covariance.topLeftCorner<3, 3>()); }
double FixAlignment::sigma_yaw_rad() const { return std::sqrt(covariance(5, 5)); }

FixAlignment align_fixes(std::span<const FixedPoint> points) {
  FixAlignment none{.fits = std::vector<bool>(points.size(), false)};
  none.why_not = "its fixes are of one submap";
  if (points.empty() || points.front().submap == points.back().submap) return none;
  std::vector<FixedPoint> some;
  const std::size_t every = (points.size() + kMostPoints - 1) / kMostPoints;
  for (std::size_t i = 0; i < points.size(); i += every) some.push_back(points[i]);
  const Starts starts = search(some);
  std::optional<FixAlignment> out;
  if (std::isfinite(starts.free.median)) out = refine(points, starts.free.T_enu_world, false);
  if (!out && std::isfinite(starts.levelled.median)) out = refine(points, starts.levelled.T_enu_world, true);
  if (!out) return none;
  out->median_miss_m =
      median_of(points, [&](const FixedPoint& p) { return (out->T_enu_world * p.p_world - p.p_enu).norm(); });
  out->why_not = why_uncertain(points, *out);
  return *out;
}

}  // namespace tutti::server
