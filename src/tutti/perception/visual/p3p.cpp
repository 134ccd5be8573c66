// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/p3p.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "tutti/geometry/so3.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::visual {
namespace {

constexpr int kPolishing = 5;
constexpr double kSmallestTriangle = 1e-6;  // area over the squared longest side: nearly on a line
constexpr double kSolved = 1e-6;            // squared sides, relative
constexpr double kTooSmall = 1e-12;

/// Distances l to the points: |l_i y_i - l_j y_j|^2 = a_ij for the pairs 12, 13, 23, eq. (3).
struct Triangle {
  double a12, a13, a23;  ///< Squared sides.
  double b12, b13, b23;  ///< Cosines between the directions.
};

/// l^T M l = l_i^2 - 2 b l_i l_j + l_j^2, eq. (4).
Eigen::Matrix3d form(int i, int j, double b) {
  Eigen::Matrix3d out = Eigen::Matrix3d::Zero();
  out(i, i) = out(j, j) = 1.0;
  out(i, j) = out(j, i) = -b;
  return out;
}

/// A real root of x^3 + p x^2 + q x + r: Newton's method from the side where it cannot leave the outermost root.
double cubic_root(double p, double q, double r) {
  const auto f = [&](double x) { return ((x + p) * x + q) * x + r; };
  const double discriminant = p * p - 3.0 * q;
  double x = -p / 3.0;  // where it bends
  if (discriminant > 0.0) {
    const double width = std::sqrt(discriminant) / 3.0;
    // Beyond the maximum on the left or the minimum on the right, wherever a root is certain.
    x += f(x) > 0.0 ? -2.0 * width : 2.0 * width;
  } else if (std::abs((3.0 * x + 2.0 * p) * x + q) < kTooSmall) {
    x += f(x) > 0.0 ? -1.0 : 1.0;
  }
  for (int i = 0; i < 50; ++i) {
    const double slope = (3.0 * x + 2.0 * p) * x + q;
    if (slope == 0.0) break;
    const double step = f(x) / slope;
    x -= step;
    if (std::abs(step) <= 1e-14 * std::abs(x)) break;
  }
  return x;
}

/// The residuals of the equations of the distances, m^2.
Eigen::Vector3d residual(const Triangle& t, const Eigen::Vector3d& l) {
  return {l[0] * l[0] + l[1] * l[1] - 2.0 * t.b12 * l[0] * l[1] - t.a12,
          l[0] * l[0] + l[2] * l[2] - 2.0 * t.b13 * l[0] * l[2] - t.a13,
          l[1] * l[1] + l[2] * l[2] - 2.0 * t.b23 * l[1] * l[2] - t.a23};
}

bool solves(const Triangle& t, const Eigen::Vector3d& l) {
  return residual(t, l).cwiseAbs().maxCoeff() < kSolved * std::max({t.a12, t.a13, t.a23});
}

/// Gauss-Newton on these equations.
Eigen::Vector3d polish(const Triangle& t, Eigen::Vector3d l) {
  for (int i = 0; i < kPolishing; ++i) {
    Eigen::Matrix3d J;
    J << l[0] - t.b12 * l[1], l[1] - t.b12 * l[0], 0.0,  //
        l[0] - t.b13 * l[2], 0.0, l[2] - t.b13 * l[0],   //
        0.0, l[1] - t.b23 * l[2], l[2] - t.b23 * l[1];
    const Eigen::Vector3d step = (2.0 * J).partialPivLu().solve(residual(t, l));
    if (!step.allFinite()) break;
    l -= step;
  }
  return l;
}

/// Distances on the plane l_1 = w0 l_2 + w1 l_3: with tau = l_3 / l_2, the pair 12 scaled to the pair 23 is a quadratic
/// in tau, eq. (15).
void solve_on_plane(const Triangle& t, double w0, double w1, std::vector<Eigen::Vector3d>& out) {
  // l_1^2 + l_2^2 - 2 b12 l_1 l_2 = (a12 / a23) (l_2^2 + l_3^2 - 2 b23 l_2 l_3), over l_2^2.
  const double k = t.a12 / t.a23;
  const double A = w1 * w1 - k;
  const double B = 2.0 * (w0 * w1 - t.b12 * w1 + k * t.b23);
  const double C = w0 * w0 + 1.0 - 2.0 * t.b12 * w0 - k;
  const double root = std::sqrt(std::max(0.0, B * B - 4.0 * A * C));
  const double q = -0.5 * (B + std::copysign(root, B));
  for (const double tau : {std::abs(A) > kTooSmall ? q / A : -1.0, std::abs(q) > kTooSmall ? C / q : -1.0}) {
    if (!(tau > 0.0)) continue;
    const double l2 = std::sqrt(t.a23 / (tau * (tau - 2.0 * t.b23) + 1.0));
    const Eigen::Vector3d l = polish(t, {w0 * l2 + w1 * tau * l2, l2, tau * l2});
    if (l.allFinite() && l.minCoeff() > 0.0 && solves(t, l)) out.push_back(l);
  }
}

std::vector<Eigen::Vector3d> distances(const Triangle& t) {
  const Eigen::Matrix3d M12 = form(0, 1, t.b12), M13 = form(0, 2, t.b13), M23 = form(1, 2, t.b23);
  const Eigen::Matrix3d D1 = M12 * t.a23 - M23 * t.a12, D2 = M13 * t.a23 - M23 * t.a13;  // eq. (6)
  // det(D1 + g D2) = 0, eq. (9)
  const auto mixed = [](const Eigen::Matrix3d& one, const Eigen::Matrix3d& two) {  // each column of `two` once
    double sum = 0.0;
    for (int c = 0; c < 3; ++c) {
      Eigen::Matrix3d m = one;
      m.col(c) = two.col(c);
      sum += m.determinant();
    }
    return sum;
  };
  const double c3 = D2.determinant(), c2 = mixed(D2, D1), c1 = mixed(D1, D2), c0 = D1.determinant();
  if (std::abs(c3) < kTooSmall * D2.cwiseAbs().maxCoeff()) return {};
  const double g = cubic_root(c2 / c3, c1 / c3, c0 / c3);
  const Eigen3 eigen = eigen_of(Eigen::Matrix3d(D1 + g * D2));
  // One eigenvalue is zero; with the others of different signs the cone is two planes, eq. (11).
  Eigen::Vector3d values = eigen.values;
  Eigen::Index zero = 0;
  values.cwiseAbs().minCoeff(&zero);
  const Eigen::Index low = zero == 0 ? 1 : 0, high = zero == 2 ? 1 : 2;
  if (!(values[low] < 0.0 && values[high] > 0.0)) return {};
  const double s = std::sqrt(-values[low] / values[high]);
  const Eigen::Vector3d e_low = eigen.vectors.col(low), e_high = eigen.vectors.col(high);
  std::vector<Eigen::Vector3d> out;
  for (const double sign : {s, -s}) {
    const Eigen::Vector3d normal = e_high - sign * e_low;  // normal^T l = 0
    if (std::abs(normal[0]) < kTooSmall) continue;
    solve_on_plane(t, -normal[1] / normal[0], -normal[2] / normal[0], out);
  }
  return out;
}

/// Columns: two sides of the triangle and their normal.
Eigen::Matrix3d frame_of(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  Eigen::Matrix3d out;
  out << a - b, a - c, (a - b).cross(a - c);
  return out;
}

}  // namespace

std::vector<Pose3> p3p(const std::array<Eigen::Vector3d, 3>& y, const std::array<Eigen::Vector3d, 3>& x) {
  const Triangle t{(x[0] - x[1]).squaredNorm(),
                   (x[0] - x[2]).squaredNorm(),
                   (x[1] - x[2]).squaredNorm(),
                   y[0].dot(y[1]),
                   y[0].dot(y[2]),
                   y[1].dot(y[2])};
  const Eigen::Matrix3d sides = frame_of(x[0], x[1], x[2]);
  const double longest = std::max({t.a12, t.a13, t.a23});
  if (!(sides.col(2).norm() > kSmallestTriangle * longest)) return {};
  const Eigen::Matrix3d to_sides = sides.inverse();
  std::vector<Pose3> out;
  for (const Eigen::Vector3d& l : distances(t)) {
    const Eigen::Vector3d a = l[0] * y[0], b = l[1] * y[1], c = l[2] * y[2];
    const Eigen::Quaterniond R_camera_map(project_to_so3(frame_of(a, b, c) * to_sides));
    out.push_back({R_camera_map, a - R_camera_map * x[0]});
  }
  return out;
}

}  // namespace tutti::visual
