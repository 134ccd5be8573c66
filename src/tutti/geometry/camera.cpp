// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/geometry/camera.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace tutti {
namespace {

using Matrix23 = Eigen::Matrix<double, 2, 3>;
using Distortion = std::array<double, 8>;

/// A polynomial in Bernstein form lies between its smallest and largest coefficient and starts and ends at the outer
/// ones; de Casteljau's halves come closer and closer to it. One that stays undecided touches zero.
template <std::size_t N>
bool is_positive(const std::array<double, N>& b, int halvings_left) {
  if (!(b.front() > 0.0) || !(b.back() > 0.0)) return false;
  if (std::ranges::min(b) > 0.0) return true;
  if (halvings_left == 0) return false;
  std::array<double, N> left{};
  std::array<double, N> right = b;
  for (std::size_t i = 0; i < b.size(); ++i) {
    left[i] = right[0];
    for (std::size_t j = 0; j + 1 < b.size() - i; ++j) right[j] = 0.5 * (right[j] + right[j + 1]);
  }
  return is_positive(left, halvings_left - 1) && is_positive(right, halvings_left - 1);
}

/// Is the polynomial of these coefficients positive all the way from 0 to s?
template <std::size_t N>
bool is_positive_until(double s, const std::array<double, N>& coefficients) {
  constexpr int kHalvings = 12;
  const auto choose = [](std::size_t n, std::size_t k) {
    double out = 1.0;
    for (std::size_t i = 0; i < k; ++i) out = out * static_cast<double>(n - i) / static_cast<double>(i + 1);
    return out;
  };
  std::array<double, N> b{};
  double power = 1.0;
  for (std::size_t i = 0; i < N; ++i, power *= s)
    for (std::size_t j = i; j < N; ++j) b[j] += choose(j, i) / choose(N - 1, i) * coefficients[i] * power;
  return is_positive(b, kHalvings);
}

/// Distortion of the plane, v to w = v n(s) / d(s) + tangential part, with s = |v|^2, n = 1 + k1 s + k2 s^2 + k3 s^3 +
/// k4 s^4 and d = 1 + d1 s + d2 s^2 + d3 s^3.
struct PlaneDistortion {
  std::array<double, 4> k{};
  double p1 = 0.0, p2 = 0.0;
  std::array<double, 3> d{};

  /// Does |w| still grow with |v| all the way from the centre to s, where d is positive? Without d its derivative is
  /// 1 + 3 k1 s + ... + 9 k4 s^4; with d (and no k4), times d^2, the sum of (2i + 1 - 2j) k_i d_j s^(i + j).
  [[nodiscard]] bool grows_until(double s) const {
    const std::array<double, 5> n{1.0, k[0], k[1], k[2], k[3]};
    if (d == std::array<double, 3>{}) {
      std::array<double, 5> growth = n;
      for (std::size_t i = 0; i < n.size(); ++i) growth[i] *= static_cast<double>(2 * i + 1);
      return is_positive_until(s, growth);
    }
    const std::array<double, 4> below{1.0, d[0], d[1], d[2]};
    std::array<double, 7> growth{};
    for (std::size_t i = 0; i < below.size(); ++i)
      for (std::size_t j = 0; j < below.size(); ++j)
        growth[i + j] += (2.0 * static_cast<double>(i) + 1.0 - 2.0 * static_cast<double>(j)) * n[i] * below[j];
    return is_positive_until(s, below) && is_positive_until(s, growth);
  }

  /// Nothing where it has folded back: there a second v, nearer to the centre, has the same w.
  [[nodiscard]] std::optional<Eigen::Vector2d> operator()(const Eigen::Vector2d& v, Eigen::Matrix2d& d_w_d_v) const {
    const double s = v.squaredNorm();
    const double x = v.x();
    const double y = v.y();
    const double above = 1.0 + s * (k[0] + s * (k[1] + s * (k[2] + s * k[3])));
    const double d_above = k[0] + s * (2.0 * k[1] + s * (3.0 * k[2] + s * 4.0 * k[3]));
    const double below = 1.0 + s * (d[0] + s * (d[1] + s * d[2]));
    const double d_below = d[0] + s * (2.0 * d[1] + s * 3.0 * d[2]);
    const double scale = above / below;
    const double d_scale_d_s = (d_above - scale * d_below) / below;
    const double cross = 2.0 * (p1 * x + p2 * y);
    d_w_d_v << 2.0 * p1 * y + 6.0 * p2 * x, cross, cross, 6.0 * p1 * y + 2.0 * p2 * x;
    d_w_d_v += scale * Eigen::Matrix2d::Identity() + 2.0 * d_scale_d_s * v * v.transpose();
    const bool is_definite = d_w_d_v.determinant() > 0.0 && d_w_d_v.trace() > 0.0;
    if (!grows_until(s) || !is_definite) return std::nullopt;
    return scale * v + Eigen::Vector2d(2.0 * p1 * x * y + p2 * (s + 2.0 * x * x),  //
                                       2.0 * p2 * x * y + p1 * (s + 2.0 * y * y));
  }

  /// The v of a w by Newton's method, from the centre. A step that would leave the part before the fold, or that does
  /// not come nearer to w, is halved; nothing when there is no such v.
  [[nodiscard]] std::optional<Eigen::Vector2d> inverse(const Eigen::Vector2d& w) const {
    constexpr int kIterations = 50;
    constexpr double kTolerance = 1e-13;  // in w, 1e-10 px for any lens
    Eigen::Vector2d v = Eigen::Vector2d::Zero();
    Eigen::Matrix2d d_w_d_v = Eigen::Matrix2d::Identity();
    Eigen::Vector2d missing = w;
    for (int i = 0; i < kIterations; ++i) {
      if (missing.norm() <= kTolerance * std::max(1.0, w.norm())) return v;
      const Eigen::Vector2d step = d_w_d_v.inverse() * missing;
      Eigen::Matrix2d next_jacobian;
      double part = 1.0;
      for (;; part *= 0.5) {
        if (part < 1e-12) return std::nullopt;
        const auto reached = (*this)(v + part * step, next_jacobian);
        if (!reached || !((w - *reached).norm() < missing.norm())) continue;
        missing = w - *reached;
        break;
      }
      v += part * step;
      d_w_d_v = next_jacobian;
    }
    return std::nullopt;
  }
};

using Projected = std::optional<Eigen::Vector2d>;  // pixel, before focal lengths and principal point
using Direction = std::optional<Eigen::Vector3d>;

// --- pinhole with radial-tangential distortion (Brown 1966) ---

/// In OpenCV's order; of the plain one the last four are zero.
PlaneDistortion radial_tangential(const Distortion& d) {
  return {{d[0], d[1], d[4], 0.0}, d[2], d[3], {d[5], d[6], d[7]}};
}
PlaneDistortion of_angle(const Distortion& d) { return {{d[0], d[1], d[2], d[3]}}; }

Projected project_pinhole(const Distortion& distortion, const Eigen::Vector3d& p, Matrix23& jacobian) {
  if (!(p.z() > 0.0)) return std::nullopt;
  const Eigen::Vector2d v = p.head<2>() / p.z();
  Eigen::Matrix2d d_w_d_v;
  const auto w = radial_tangential(distortion)(v, d_w_d_v);
  jacobian << d_w_d_v, -d_w_d_v * v;
  jacobian /= p.z();
  return w;
}

Direction unproject_pinhole(const Distortion& distortion, const Eigen::Vector2d& w) {
  const auto v = radial_tangential(distortion).inverse(w);
  if (!v) return std::nullopt;
  return Eigen::Vector3d(v->x(), v->y(), 1.0).normalized();
}

// --- equidistant fisheye: the angle from the axis is distorted (Kannala and Brandt 2006, eq. 6) ---

Projected project_equidistant(const Distortion& distortion, const Eigen::Vector3d& p, Matrix23& jacobian) {
  const double r = p.head<2>().norm();
  if (r == 0.0 && !(p.z() > 0.0)) return std::nullopt;  // straight behind: seen in every direction
  const double angle = std::atan2(r, p.z());
  const Eigen::Vector2d outwards = r > 0.0 ? Eigen::Vector2d(p.head<2>() / r) : Eigen::Vector2d::UnitX();
  Eigen::Matrix2d d_w_d_v;
  const auto w = of_angle(distortion)(angle * outwards, d_w_d_v);
  const double angle_by_r = r > 0.0 ? angle / r : 1.0 / p.z();
  const double d_angle_d_r = p.z() / p.squaredNorm();
  Matrix23 d_v_d_p;
  d_v_d_p << angle_by_r * Eigen::Matrix2d::Identity() + (d_angle_d_r - angle_by_r) * outwards * outwards.transpose(),
      -r / p.squaredNorm() * outwards;
  jacobian = d_w_d_v * d_v_d_p;
  return w;
}

Direction unproject_equidistant(const Distortion& distortion, const Eigen::Vector2d& w) {
  const auto v = of_angle(distortion).inverse(w);
  if (!v || !(v->norm() < std::numbers::pi)) return std::nullopt;
  const double angle = v->norm();
  const Eigen::Vector2d xy = (angle > 0.0 ? std::sin(angle) / angle : 1.0) * *v;
  return Eigen::Vector3d(xy.x(), xy.y(), std::cos(angle)).normalized();
}

// --- double sphere (Usenko, Demmel, Cremers 2018, section IV) ---

/// z1 / d2 must exceed this: beyond it the depth is not positive, or |w| no longer grows with the angle from the axis,
/// since d|w| / d angle = (1 + xi cos) (alpha z1 / d2 + 1 - alpha) / depth^2. (Eq. 45 turns this into an angle at the
/// first centre, but not exactly: it accepts points that share their pixel with others.)
double double_sphere_limit(double alpha) {
  return -(alpha <= 0.5 ? alpha / (1.0 - alpha) : (1.0 - alpha) / alpha);  // eq. 44
}

Projected project_double_sphere(const Distortion& distortion, const Eigen::Vector3d& p, Matrix23& jacobian) {
  const double xi = distortion[0], alpha = distortion[1];
  const double d1 = p.norm();
  const double z1 = xi * d1 + p.z();
  const double d2 = std::sqrt(p.head<2>().squaredNorm() + z1 * z1);
  const double depth = alpha * d2 + (1.0 - alpha) * z1;
  if (!(z1 > double_sphere_limit(alpha) * d2)) return std::nullopt;
  const Eigen::Vector2d w = p.head<2>() / depth;  // eqs. 40 to 42
  const Eigen::RowVector3d d_z1 = xi / d1 * p.transpose() + Eigen::RowVector3d::UnitZ();
  const Eigen::RowVector3d d_d2 = (Eigen::RowVector3d(p.x(), p.y(), 0.0) + z1 * d_z1) / d2;
  jacobian = (Matrix23::Identity() - w * (alpha * d_d2 + (1.0 - alpha) * d_z1)) / depth;
  return w;
}

Direction unproject_double_sphere(const Distortion& distortion, const Eigen::Vector2d& w) {
  const double xi = distortion[0], alpha = distortion[1];
  const double s = w.squaredNorm();
  const double under_root = 1.0 - (2.0 * alpha - 1.0) * s;  // eqs. 46 to 51
  if (!(under_root >= 0.0)) return std::nullopt;
  const double z = (1.0 - alpha * alpha * s) / (alpha * std::sqrt(under_root) + 1.0 - alpha);
  if (!(z > double_sphere_limit(alpha) * std::sqrt(z * z + s))) return std::nullopt;
  const double scale = (z * xi + std::sqrt(z * z + (1.0 - xi * xi) * s)) / (z * z + s);
  return Eigen::Vector3d(scale * w.x(), scale * w.y(), scale * z - xi).normalized();
}

// --- the table ---

/// The projection of a kind at unit focal length. The Jacobian is by the point.
struct Formula {
  Projected (*project)(const Distortion&, const Eigen::Vector3d&, Matrix23&);
  Direction (*unproject)(const Distortion&, const Eigen::Vector2d&);
};

constexpr std::array<Formula, 4> kFormulas{{
    {project_pinhole, unproject_pinhole},              // CameraKind::pinhole
    {project_equidistant, unproject_equidistant},      // CameraKind::equidistant
    {project_double_sphere, unproject_double_sphere},  // CameraKind::double_sphere
    {project_pinhole, unproject_pinhole},              // CameraKind::rational
}};

const Formula& formula(const CameraModel& camera) { return kFormulas.at(static_cast<std::size_t>(camera.kind)); }

}  // namespace

std::size_t distortion_numbers(CameraKind kind) { return kind == CameraKind::rational ? 8 : 4; }

Status check_camera(const CameraModel& camera) {
  const auto kind = static_cast<std::size_t>(camera.kind);
  if (kind >= kFormulas.size())
    return fail(ErrorCode::unsupported, "camera kind {} is not one of 0 to {}", kind, kFormulas.size() - 1);
  if (camera.width_px <= 0 || camera.height_px <= 0)
    return fail(ErrorCode::invalid, "an image of {} x {} pixels; expected a positive size", camera.width_px,
                camera.height_px);
  if (!(camera.fx > 0.0) || !(camera.fy > 0.0) || !std::isfinite(camera.fx) || !std::isfinite(camera.fy))
    return fail(ErrorCode::invalid, "focal lengths {} and {} px; expected positive ones", camera.fx, camera.fy);
  if (!std::isfinite(camera.cx) || !std::isfinite(camera.cy))
    return fail(ErrorCode::invalid, "principal point {}, {} px is not finite", camera.cx, camera.cy);
  for (std::size_t i = 0; i < camera.distortion.size(); ++i)
    if (!std::isfinite(camera.distortion[i]))
      return fail(ErrorCode::invalid, "distortion coefficient {} is {}", i + 1, camera.distortion[i]);
  const auto [xi, alpha, third, fourth, k3, k4, k5, k6] = camera.distortion;
  if (camera.kind != CameraKind::rational && (k3 != 0.0 || k4 != 0.0 || k5 != 0.0 || k6 != 0.0))
    return fail(ErrorCode::invalid, "more than four coefficients of distortion: only a rational camera has them");
  if (camera.kind != CameraKind::double_sphere) return {};
  if (!(std::abs(xi) < 1.0) || alpha < 0.0 || alpha > 1.0)
    return fail(ErrorCode::invalid, "double sphere with xi {} and alpha {}; expected -1 < xi < 1 and 0 <= alpha <= 1",
                xi, alpha);
  if (third != 0.0 || fourth != 0.0)
    return fail(ErrorCode::invalid, "a double sphere has two coefficients, but the others are {} and {}", third,
                fourth);
  return {};
}

std::optional<Eigen::Vector2d> project(const CameraModel& camera, const Eigen::Vector3d& point,
                                       Eigen::Matrix<double, 2, 3>* d_pixel_d_point) {
  Matrix23 jacobian;
  const auto w = formula(camera).project(camera.distortion, point, jacobian);
  if (!w || !w->allFinite() || !point.allFinite()) return std::nullopt;
  if (d_pixel_d_point != nullptr) *d_pixel_d_point = Eigen::Vector2d(camera.fx, camera.fy).asDiagonal() * jacobian;
  return Eigen::Vector2d(camera.fx * w->x() + camera.cx, camera.fy * w->y() + camera.cy);
}

std::optional<Eigen::Vector3d> unproject(const CameraModel& camera, const Eigen::Vector2d& pixel) {
  const Eigen::Vector2d w((pixel.x() - camera.cx) / camera.fx, (pixel.y() - camera.cy) / camera.fy);
  if (!w.allFinite()) return std::nullopt;
  return formula(camera).unproject(camera.distortion, w);
}

bool in_image(const CameraModel& camera, const Eigen::Vector2d& pixel, double border_px) {
  const double low = border_px - 0.5;
  return pixel.x() >= low && pixel.y() >= low && pixel.x() < camera.width_px - 0.5 - border_px &&
         pixel.y() < camera.height_px - 0.5 - border_px;
}

}  // namespace tutti
