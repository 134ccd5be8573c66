// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/consistency_graph.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <tuple>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/estimation/chi_square.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::estimation::internal {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Symmetric 6x6 by its 3x3 blocks [tt, tr; tr^T, rr] (translation, rotation).
struct Covariance {
  Matrix3d tt = Matrix3d::Zero();
  Matrix3d tr = Matrix3d::Zero();
  Matrix3d rr = Matrix3d::Zero();

  Covariance() = default;
  explicit Covariance(const Matrix6d& m)
      : tt(m.topLeftCorner<3, 3>()), tr(m.topRightCorner<3, 3>()), rr(m.bottomRightCorner<3, 3>()) {}
  Covariance& operator+=(const Covariance& other) {
    tt += other.tt;
    tr += other.tr;
    rr += other.rr;
    return *this;
  }
  friend Covariance operator-(Covariance a, const Covariance& b) {
    a.tt -= b.tt;
    a.tr -= b.tr;
    a.rr -= b.rr;
    return a;
  }
  [[nodiscard]] Matrix6d matrix() const {
    Matrix6d m;
    m << tt, tr, tr.transpose(), rr;
    return m;
  }
};

/// Ad(T) C Ad(T)^T with Ad(T) = [R, [t]x R; 0, R].
Covariance moved(const Matrix3d& R, const Vector3d& t, const Covariance& c) {
  const Matrix3d S = skew(t);
  const Matrix3d tt = R * c.tt * R.transpose();
  const Matrix3d tr = R * c.tr * R.transpose();
  Covariance out;
  out.rr = R * c.rr * R.transpose();
  out.tr = tr + S * out.rr;
  const Matrix3d cross = tr * S;
  out.tt = tt - cross - cross.transpose() - S * out.rr * S;
  return out;
}
Covariance moved(const Pose3& T, const Covariance& c) { return moved(T.rotation.toRotationMatrix(), T.translation, c); }

/// e^T C^-1 e by Cholesky factorisation of C, which is overwritten; infinity when it is not positive definite. Written
/// out because this is the inner loop of the server's judgement.
template <int N>
double squared_error(Eigen::Matrix<double, N, N>& C, Eigen::Matrix<double, N, 1> e) {
  double sum = 0.0;
  for (int k = 0; k < N; ++k) {
    if (!(C(k, k) > 0.0)) return std::numeric_limits<double>::infinity();
    const double scale = 1.0 / C(k, k);
    sum += e(k) * e(k) * scale;
    for (int i = k + 1; i < N; ++i) {
      const double factor = C(i, k) * scale;
      e(i) -= factor * e(k);
      for (int j = k + 1; j <= i; ++j) C(i, j) -= factor * C(j, k);
    }
  }
  return sum;
}

/// Odometry of one robot in a frame at the middle of its trajectory (short levers keep the differences below accurate).
struct Chain {
  std::uint32_t first_index = 0;
  std::vector<Pose3> poses;        ///< T_middle_body
  std::vector<Covariance> prefix;  ///< Sum of Ad(T_middle_body_k) Q_k Ad^T over the steps up to each pose.

  explicit Chain(const OdometryChain& odometry) : first_index(odometry.first_index), poses(odometry.T_odom_body) {
    TUTTI_CHECK(!poses.empty() && odometry.step_covariance.size() + 1 == poses.size(), "{} poses, {} covariances",
                poses.size(), odometry.step_covariance.size());
    const Pose3 T_middle_odom = poses[poses.size() / 2].inverse();
    for (Pose3& pose : poses) pose = T_middle_odom * pose;
    prefix.reserve(poses.size());
    prefix.emplace_back();
    for (std::size_t k = 1; k < poses.size(); ++k) {
      prefix.push_back(prefix.back());
      prefix.back() += moved(poses[k], Covariance(odometry.step_covariance[k - 1]));
    }
  }
  [[nodiscard]] bool contains(std::uint32_t index) const {
    return index >= first_index && index - first_index < poses.size();
  }
  /// Covariance of the odometry between two poses, either way round, in the middle frame.
  [[nodiscard]] Covariance between(std::size_t a, std::size_t b) const {
    return prefix[std::max(a, b)] - prefix[std::min(a, b)];
  }
  [[nodiscard]] Matrix3d rotation_between(std::size_t a, std::size_t b) const {
    return prefix[std::max(a, b)].rr - prefix[std::min(a, b)].rr;
  }
};

/// A closure from the first robot (pose i) to the second (pose j), or from an earlier to a later pose of one robot.
struct Candidate {
  std::size_t position = 0;  ///< In the input.
  std::size_t i = 0;
  std::size_t j = 0;
  Pose3 T_i_j;
  Pose3 T_first_second;  ///< Between the middle frames, as this closure alone would have it.
  Pose3 T_second_first;  ///< Its inverse, and the rotation of that as a matrix.
  Matrix3d R_second_first;
  Covariance covariance;  ///< Of the closure, in the second's middle frame.
};

/// Ad(T) local(I, T^-1 E T): the error E of a cycle, measured where T is.
Vector6d error_at(const Vector3d& t, const Pose3& E, const Vector3d& rotation) {
  Vector6d error;
  error << E.rotation * t + E.translation - t + t.cross(rotation), rotation;
  return error;
}

/// The 4-cycle a - odometry of the second from j_a to j_b - b^-1 - odometry of the first from i_b to i_a, seen at j_b,
/// closes within `threshold` of its covariance (Mangelson et al. 2018, eqs. 7 to 9), which is summed in the second's
/// middle frame. Its rotation alone often shows that it does not.
bool agree(const Candidate& a, const Candidate& b, const Chain& first, const Chain& second, double threshold) {
  const Pose3 E = b.T_second_first * a.T_first_second;
  const Vector3d rotation = so3_log(E.rotation);
  const Matrix3d& R = b.R_second_first;
  Matrix3d of_rotation = a.covariance.rr + b.covariance.rr + second.rotation_between(a.j, b.j);
  of_rotation.noalias() += R * first.rotation_between(a.i, b.i) * R.transpose();
  if (squared_error<3>(of_rotation, rotation) > threshold) return false;
  Covariance covariance = a.covariance;
  covariance += b.covariance;
  covariance += second.between(a.j, b.j);
  covariance += moved(R, b.T_second_first.translation, first.between(a.i, b.i));
  Matrix6d C = covariance.matrix();
  return squared_error<6>(C, error_at(second.poses[b.j].translation, E, rotation)) <= threshold;
}

/// The loop of a closure within one chain and the odometry between its ends, seen at j: inverse of its covariance.
Matrix6d loop_information(const Candidate& a, const Chain& chain) {
  Covariance covariance = a.covariance;
  covariance += chain.between(a.i, a.j);
  const Matrix6d to_j = adjoint(chain.poses[a.j].inverse());
  return (to_j * covariance.matrix() * to_j.transpose()).llt().solve(Matrix6d::Identity());
}

bool fits_odometry(const Candidate& a, const Chain& chain, const Matrix6d& information, double threshold) {
  const Pose3& T_middle_j = chain.poses[a.j];
  const Vector6d error = local({}, T_middle_j.inverse() * (a.T_first_second * T_middle_j));
  return error.dot(information * error) <= threshold;
}

bool is_usable(const RelativePose& measurement) {
  return is_valid(measurement.T_a_b, 1e-3) && measurement.covariance.allFinite() &&
         measurement.covariance.llt().info() == Eigen::Success;
}

/// Total order that does not depend on where a closure stands in the input.
bool canonical_less(const LoopClosure& a, const LoopClosure& b) {
  const auto ids = [](const LoopClosure& c) { return std::tie(c.from, c.to); };
  if (ids(a) != ids(b)) return ids(a) < ids(b);
  const auto numbers = [](const LoopClosure& c) {
    Eigen::Matrix<double, 43, 1> v;
    v << c.measurement.T_a_b.translation, c.measurement.T_a_b.rotation.coeffs(),
        Eigen::Map<const Eigen::Matrix<double, 36, 1>>(c.measurement.covariance.data());
    return v;
  };
  const auto x = numbers(a);
  const auto y = numbers(b);
  return std::lexicographical_compare(x.begin(), x.end(), y.begin(), y.end());
}

class Placing {
 public:
  explicit Placing(std::span<const OdometryChain> chains) {
    for (const OdometryChain& chain : chains) {
      position_.emplace(KeyframeId{chain.id, chain.first_index}, chains_.size());
      chains_.emplace_back(chain);
    }
  }
  [[nodiscard]] const Chain& chain(std::size_t position) const { return chains_[position]; }

  struct Placed {
    std::size_t first = 0, second = 0;  ///< Chains.
    Candidate candidate;
  };
  /// Nothing when the closure cannot be used.
  [[nodiscard]] std::optional<Placed> place(const LoopClosure& closure) const {
    KeyframeId from = closure.from;
    KeyframeId to = closure.to;
    if (!is_usable(closure.measurement)) return std::nullopt;
    Pose3 T = closure.measurement.T_a_b;
    Matrix6d covariance = closure.measurement.covariance;
    auto first = chain_of(from);
    auto second = chain_of(to);
    if (!first || !second || from == to) return std::nullopt;
    if (to < from) {
      const Matrix6d to_start = adjoint(T);
      covariance = to_start * covariance * to_start.transpose();
      T = T.inverse();
      std::swap(from, to);
      std::swap(first, second);
    }
    const Chain& a = chains_[*first];
    const Chain& b = chains_[*second];
    Candidate out;
    out.i = from.index - a.first_index;
    out.j = to.index - b.first_index;
    out.T_i_j = T;
    const Pose3& T_second_j = b.poses[out.j];
    out.T_first_second = a.poses[out.i] * T * T_second_j.inverse();
    out.T_second_first = out.T_first_second.inverse();
    out.R_second_first = out.T_second_first.rotation.toRotationMatrix();
    out.covariance = moved(T_second_j, Covariance(covariance));
    return Placed{*first, *second, out};
  }

 private:
  [[nodiscard]] std::optional<std::size_t> chain_of(const KeyframeId& id) const {
    auto after = position_.upper_bound(id);
    if (after == position_.begin()) return std::nullopt;
    const auto& [start, position] = *std::prev(after);
    if (start.chain != id.chain || !chains_[position].contains(id.index)) return std::nullopt;
    return position;
  }
  std::map<KeyframeId, std::size_t> position_;  // by first keyframe
  std::vector<Chain> chains_;
};

ConsistencyGraph connect(std::size_t first, std::size_t second, const std::vector<Candidate>& candidates,
                         const Placing& placing, double threshold) {
  ConsistencyGraph graph{first, second, {}, BitGraph(static_cast<int>(candidates.size()))};
  const Chain& one = placing.chain(first);
  const Chain& other = placing.chain(second);
  for (std::size_t b = 0; b < candidates.size(); ++b) {
    const Candidate& closure = candidates[b];
    graph.closures.push_back({closure.position, closure.i, closure.j, closure.T_i_j});
    if (first == second) {
      PlacedClosure& placed = graph.closures.back();
      placed.loop_information = loop_information(closure, one);
      placed.fits_odometry = fits_odometry(closure, one, placed.loop_information, threshold);
    }
    for (std::size_t a = 0; a < b; ++a)
      if (agree(candidates[a], closure, one, other, threshold))
        graph.agreement.connect(static_cast<int>(a), static_cast<int>(b));
  }
  return graph;
}

}  // namespace

std::vector<ConsistencyGraph> consistency_graphs(std::span<const OdometryChain> chains,
                                                 std::span<const LoopClosure> closures, double confidence) {
  const Placing placing(chains);
  std::vector<std::size_t> order(closures.size());
  for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return canonical_less(closures[a], closures[b]); });
  std::map<std::pair<std::size_t, std::size_t>, std::vector<Candidate>> groups;
  for (const std::size_t position : order) {
    auto placed = placing.place(closures[position]);
    if (!placed) continue;
    placed->candidate.position = position;
    groups[{placed->first, placed->second}].push_back(placed->candidate);
  }
  const double threshold = chi_square_6_quantile(confidence);
  std::vector<ConsistencyGraph> graphs;
  for (const auto& [pair, candidates] : groups)
    graphs.push_back(connect(pair.first, pair.second, candidates, placing, threshold));
  return graphs;
}

BitGraph induced(const BitGraph& graph, std::span<const int> vertices) {
  const int n = static_cast<int>(vertices.size());
  BitGraph out(n);
  for (int b = 1; b < n; ++b)
    for (int a = 0; a < b; ++a)
      if (graph.connected(vertices[a], vertices[b])) out.connect(a, b);
  return out;
}

}  // namespace tutti::estimation::internal
