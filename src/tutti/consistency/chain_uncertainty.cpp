// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/chain_uncertainty.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>

#include "tutti/base/check.hpp"
#include "tutti/base/chi_square.hpp"
#include "tutti/base/random.hpp"
#include "tutti/consistency/internal/chain_filter.hpp"
#include "tutti/consistency/internal/worst_sigma.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/spectral/wavelet_transform.hpp"

namespace tutti::consistency {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// A scale with fewer waves than these is left out: the rigid motion has taken most of it away.
constexpr double kLeastWaves = 2.0;
constexpr Index kProbes = 48;
/// Closures know a direction far better than odometry does below this ratio of variances.
constexpr double kKnownFarBetter = 0.25;
constexpr Index kMostDirections = 4;
constexpr double kFinest = 127.0;
/// A group of closures on which the map hinges is doubted by half when odometry finds it as unlikely as the worst of
/// all such groups, if all are right, is with this probability.
constexpr double kStillRight = 0.9;

/// Errors of one kind in the axes of `world`: n x (3 columns).
struct Errors {
  MatrixXd position_m, rotation_rad;
};

/// Right tangents, (6 n) x columns.
Errors in_world(std::span<const ProxyNode> nodes, const MatrixXd& tangents) {
  const auto n = static_cast<Index>(nodes.size());
  Errors out{MatrixXd(n, 3 * tangents.cols()), MatrixXd(n, 3 * tangents.cols())};
  for (Index k = 0; k < n && tangents.cols() > 0; ++k) {
    const Eigen::Matrix3d R = nodes[static_cast<std::size_t>(k)].T_world_body.rotation.toRotationMatrix();
    out.position_m.row(k) = (R * tangents.middleRows<3>(6 * k)).reshaped().transpose();
    out.rotation_rad.row(k) = (R * tangents.middleRows<3>(6 * k + 3)).reshaped().transpose();
  }
  return out;
}

/// As the robot sees them: without what the gauge can take away.
void free_of_gauge(const internal::RigidMotion& rigid, Errors& errors) {
  for (Index c = 0; c < errors.position_m.cols(); c += 3) {
    rigid.remove(errors.position_m.middleCols<3>(c));
    internal::remove_mean(errors.rotation_rad.middleCols<3>(c));
  }
}

/// Root mean square over the nodes.
double whole(const MatrixXd& samples) {
  return std::sqrt(3.0 * samples.squaredNorm() / static_cast<double>(samples.size()));
}

/// Per block of nodes, the sigma of the wavelet coefficients of one kind at one scale, from so many samples' products
/// (spectral::WaveletFilter::scatter). `rounding`: that of what is sent, at this scale.
std::vector<double> sigmas(const MatrixXd& products, double samples, double rounding) {
  const double rounding_squared = rounding * rounding;
  std::vector<double> out(ChainUncertainty::blocks(static_cast<std::size_t>(products.rows())), 0.0);
  for (Index n = 0; n < products.rows(); ++n) {
    Eigen::Matrix3d S;
    S << products(n, 0), products(n, 1), products(n, 3), products(n, 1), products(n, 2), products(n, 4), products(n, 3),
        products(n, 4), products(n, 5);
    double& block = out[static_cast<std::size_t>(n) / ChainUncertainty::kBlock];
    const double mean = S.trace() / 3.0, apart = std::max(0.0, S.squaredNorm() / 3.0 - mean * mean);
    const double most = (mean + std::sqrt(2.0 * apart)) / samples;  // no eigenvalue is larger (Samuelson 1968)
    if ((1.0 + 1e-7) * (most + rounding_squared) <= block * block) continue;
    block = std::max(block, std::sqrt(std::pow(internal::worst_sigma(S, samples), 2) + rounding_squared));
  }
  return out;
}

/// Per scale, how many waves it contains, the constant not counted: the trace of g_s(L)^2, by random signs (Hutchinson
/// 1990).
std::vector<double> waves(const spectral::WaveletFilter& filter, Index nodes) {
  Rng rng(0);
  MatrixXd z(nodes, kProbes);
  for (double& value : z.reshaped()) value = rng.bernoulli(0.5) ? 1.0 : -1.0;
  z.rowwise() -= Eigen::RowVectorXd(z.colwise().mean());
  std::vector<double> out;
  for (const MatrixXd& products : filter.scatter(z))
    out.push_back((products.col(0) + products.col(2) + products.col(5)).sum() / static_cast<double>(kProbes));
  return out;
}

std::vector<ScaleUncertainty> scales(const spectral::SparseMatrix& laplacian, const Errors& samples,
                                     std::size_t* products) {
  const spectral::WaveletFilter filter(laplacian, internal::kScales);
  if (products != nullptr)
    *products += static_cast<std::size_t>((2 * samples.position_m.cols() + kProbes) * filter.degree());
  const std::vector<double> contained = waves(filter, laplacian.rows());
  const auto position_m = filter.scatter(samples.position_m), rotation_rad = filter.scatter(samples.rotation_rad);
  const double count = static_cast<double>(samples.position_m.cols()) / 3.0;
  std::vector<ScaleUncertainty> out(internal::kScales);
  for (std::size_t s = 0; s < out.size(); ++s) {
    if (contained[s] < kLeastWaves) continue;
    const double share = std::sqrt(contained[s] / static_cast<double>(laplacian.rows()));
    const std::vector<double> metres = sigmas(position_m[s], count, share * internal::kRounding.position_m);
    const std::vector<double> radians = sigmas(rotation_rad[s], count, share * internal::kRounding.rotation_rad);
    for (std::size_t b = 0; b < metres.size(); ++b) out[s].sigma.push_back({metres[b], radians[b]});
  }
  return out;
}

/// The linear map from the right tangents of all spread nodes to [position; rotation] of each but the first, seen from
/// the first, in the axes of `world`.
MatrixXd seen_from_first(std::span<const Pose3> poses) {
  const auto m = static_cast<Index>(poses.size());
  MatrixXd out = MatrixXd::Zero(6 * (m - 1), 6 * m);
  const Eigen::Matrix3d R_first = poses[0].rotation.toRotationMatrix();
  for (Index k = 1; k < m; ++k) {
    const Pose3& T = poses[static_cast<std::size_t>(k)];
    const Index row = 6 * (k - 1);
    out.block<3, 3>(row, 0) = -R_first;
    out.block<3, 3>(row, 3) = skew(T.translation - poses[0].translation) * R_first;
    out.block<3, 3>(row + 3, 3) = -R_first;
    out.block<3, 3>(row, 6 * k) = out.block<3, 3>(row + 3, 6 * k + 3) = T.rotation.toRotationMatrix();
  }
  return out;
}

/// Covariance of the same by odometry alone: every step moves all nodes after it.
MatrixXd by_odometry(std::span<const Pose3> poses, std::span<const Matrix6d> steps) {
  const auto m = static_cast<Index>(poses.size());
  MatrixXd moves = MatrixXd::Zero(6 * (m - 1), 6 * (m - 1)), scaled = moves;
  for (Index step = 1; step < m; ++step) {
    const Pose3& T = poses[static_cast<std::size_t>(step)];
    const Eigen::Matrix3d R = T.rotation.toRotationMatrix();
    const Index column = 6 * (step - 1);
    for (Index k = step; k < m; ++k) {
      const Index row = 6 * (k - 1);
      moves.block<3, 3>(row, column) = moves.block<3, 3>(row + 3, column + 3) = R;
      moves.block<3, 3>(row, column + 3) = -skew(poses[static_cast<std::size_t>(k)].translation - T.translation) * R;
    }
    scaled.middleCols<6>(column) = moves.middleCols<6>(column) * steps[static_cast<std::size_t>(step)];
  }
  return scaled * moves.transpose();
}

/// In one byte a number; `v` becomes their values. None: a kind is all zero.
std::optional<KnownDirection> coded(Eigen::VectorXd& v) {
  std::array<double, 2> largest{};
  for (Index k = 0; k < v.size(); ++k) largest[k % 6 / 3] = std::max(largest[k % 6 / 3], std::abs(v(k)));
  if (!(largest[0] > 0.0 && largest[1] > 0.0)) return std::nullopt;
  KnownDirection out{.position = {}, .rotation = {}, .rotation_scale = largest[1] / largest[0], .sigma = largest[0]};
  for (Index k = 0; k < v.size(); ++k) {
    const double code = std::round(kFinest * v(k) / largest[k % 6 / 3]);
    (k % 6 < 3 ? out.position : out.rotation).push_back(static_cast<std::int8_t>(code));
    v(k) = code / kFinest * (k % 6 < 3 ? 1.0 : out.rotation_scale);
  }
  return out;
}

/// `P`: the map's covariance of the spread nodes seen from the first; `O`: odometry's.
std::vector<KnownDirection> directions(const MatrixXd& P, const MatrixXd& O) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> eigen(0.5 * (P + P.transpose()), O);
  std::vector<KnownDirection> out;
  if (eigen.info() != Eigen::Success) return out;
  for (Index i = 0; i < std::min(kMostDirections, P.rows()) && eigen.eigenvalues()(i) < kKnownFarBetter; ++i) {
    Eigen::VectorXd v = eigen.eigenvectors().col(i);
    auto direction = coded(v);
    if (!direction) continue;
    double variance = std::max(0.0, v.dot(P * v));
    for (Index k = 0; k < v.size(); ++k)
      variance += std::pow(v(k) * (k % 6 < 3 ? internal::kRounding.position_m : internal::kRounding.rotation_rad), 2);
    direction->sigma = std::sqrt(variance);
    out.push_back(std::move(*direction));
  }
  return out;
}

/// With the group right, the squared length of its shift in odometry's covariance is about chi-square, with six degrees
/// of freedom for each place that it measures, and no more than all closures measure together, which is what P leaves
/// of O. Where the other groups contradict odometry, too, it is odometry that is worse than it says: by as much as they
/// have it in the mean. D^2 beyond the quantile of the worst of so many groups speaks for a wrong one with odds
/// exp((D^2 - quantile) / 2). That share of the shift is doubted, of the group of which it is largest.
std::optional<KnownDirection> doubted(const MatrixXd& P, const MatrixXd& O, const MatrixXd& shifts,
                                      std::span<const std::size_t> places) {
  if (shifts.cols() == 0) return std::nullopt;
  const Eigen::LDLT<MatrixXd> odometry(O);
  const double measured = static_cast<double>(O.rows()) - odometry.solve(P).trace();
  Eigen::VectorXd D2(shifts.cols()), freedom(shifts.cols());
  for (Index c = 0; c < shifts.cols(); ++c) {
    D2(c) = shifts.col(c).dot(odometry.solve(shifts.col(c)));
    freedom(c) = std::max(6.0, std::min(6.0 * static_cast<double>(places[static_cast<std::size_t>(c)]), measured));
  }
  const double probability = std::pow(kStillRight, 1.0 / static_cast<double>(shifts.cols()));
  const double all = D2.cwiseQuotient(freedom).sum(), others = static_cast<double>(shifts.cols() - 1);
  Eigen::VectorXd largest = Eigen::VectorXd::Zero(O.rows());
  for (Index c = 0; c < shifts.cols(); ++c) {
    const double worse = others > 0.0 ? std::max(1.0, (all - D2(c) / freedom(c)) / others) : 1.0;
    const double beyond = D2(c) / worse - chi_square_quantile(probability, freedom(c));
    const Eigen::VectorXd share = shifts.col(c) / (1.0 + std::exp(-0.5 * beyond));
    if (share.squaredNorm() > largest.squaredNorm()) largest = share;
  }
  if (largest.norm() < internal::kRounding.position_m) return std::nullopt;
  return coded(largest);
}

}  // namespace

ChainUncertainty chain_uncertainty(const ProxyGraph& graph, const ChainId& chain, const ChainKnowledge& known,
                                   std::size_t* products) {
  const std::span<const ProxyNode> nodes = nodes_of(graph, chain);
  const auto n = static_cast<Index>(nodes.size());
  TUTTI_CHECK(n > 0 && known.samples.rows() == 6 * n && known.samples.cols() > 0, "{} x {} samples of {} nodes",
              known.samples.rows(), known.samples.cols(), n);
  TUTTI_CHECK(known.shifts.cols() == 0 || known.shifts.rows() == 6 * n, "{} x {} shifts of {} nodes",
              known.shifts.rows(), known.shifts.cols(), n);
  TUTTI_CHECK(known.shift_places.size() == static_cast<std::size_t>(known.shifts.cols()), "{} groups, {} shifts",
              known.shift_places.size(), known.shifts.cols());
  const internal::RigidMotion rigid(nodes);
  Errors samples = in_world(nodes, known.samples);
  free_of_gauge(rigid, samples);
  ChainUncertainty out{.chain = chain, .whole = {whole(samples.position_m), whole(samples.rotation_rad)}};
  if (n >= 2 && known.samples.cols() >= kLeastSamples)
    out.scales = scales(internal::chain_laplacian(graph, chain), samples, products);

  const std::vector<std::size_t> spread = ChainUncertainty::spread(nodes.size());
  const auto m = static_cast<Index>(spread.size());
  if (m < 2 || known.spread_covariance.size() == 0) return out;
  TUTTI_CHECK(known.spread_covariance.rows() == 6 * m && known.spread_odometry.size() == spread.size(),
              "{} rows and {} steps of {} spread nodes", known.spread_covariance.rows(), known.spread_odometry.size(),
              m);
  std::vector<Pose3> poses;
  MatrixXd spread_shifts(6 * m, known.shifts.cols());
  for (Index k = 0; k < m; ++k) {
    const std::size_t node = spread[static_cast<std::size_t>(k)];
    poses.push_back(nodes[node].T_world_body);
    if (known.shifts.cols() > 0)
      spread_shifts.middleRows<6>(6 * k) = known.shifts.middleRows<6>(6 * static_cast<Index>(node));
  }
  const MatrixXd seen = seen_from_first(poses), odometry = by_odometry(poses, known.spread_odometry);
  const MatrixXd covariance = seen * known.spread_covariance * seen.transpose();
  out.directions = directions(covariance, odometry);
  out.doubted = doubted(covariance, odometry, seen * spread_shifts, known.shift_places);
  return out;
}

ChainUncertainty even_uncertainty(const ChainId& chain, std::size_t nodes, const PoseSigma& sigma) {
  ChainUncertainty out{.chain = chain, .whole = sigma};
  const double share = 1.0 / std::sqrt(static_cast<double>(internal::kScales));
  const PoseSigma at_each{share * sigma.position_m, share * sigma.rotation_rad};
  for (int s = 0; s < internal::kScales; ++s) {
    const double waves = std::ldexp(static_cast<double>(nodes), s - internal::kScales);
    ScaleUncertainty& scale = out.scales.emplace_back();
    if (waves >= kLeastWaves) scale.sigma.assign(ChainUncertainty::blocks(nodes), at_each);
  }
  return out;
}

ProxyGraph without_doubted(const ProxyGraph& graph, const ChainId& chain) {
  ProxyGraph out = graph;
  const ChainUncertainty* uncertainty = uncertainty_of(graph, chain);
  if (uncertainty == nullptr || !uncertainty->doubted) return out;
  const KnownDirection& doubted = *uncertainty->doubted;
  const std::span<const ProxyNode> nodes = nodes_of(graph, chain);
  const auto first = static_cast<std::size_t>(nodes.data() - graph.nodes.data());
  const std::vector<std::size_t> spread = ChainUncertainty::spread(nodes.size());
  // Motions of space about the first node, [translation; rotation], so that a turn carries what lies between.
  const auto from_first = [&](std::size_t node) -> Eigen::Vector3d {
    return nodes[node].T_world_body.translation - nodes[0].T_world_body.translation;
  };
  Vector6d before = Vector6d::Zero(), after;
  for (std::size_t k = 1; k < spread.size(); ++k, before = after) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto row = static_cast<Index>(axis);
      after(row) = doubted.sigma / kFinest * doubted.position[3 * (k - 1) + axis];
      after(row + 3) = doubted.sigma * doubted.rotation_scale / kFinest * doubted.rotation[3 * (k - 1) + axis];
    }
    after.head<3>() -= after.tail<3>().cross(from_first(spread[k]));
    for (std::size_t n = spread[k - 1] + 1; n <= spread[k]; ++n) {
      const double alpha = static_cast<double>(n - spread[k - 1]) / static_cast<double>(spread[k] - spread[k - 1]);
      const Vector6d motion = (1.0 - alpha) * before + alpha * after;
      Pose3& T = out.nodes[first + n].T_world_body;
      T.translation += motion.head<3>() + motion.tail<3>().cross(from_first(n));
      T.rotation = so3_exp(motion.tail<3>()) * T.rotation;
    }
  }
  return out;
}

}  // namespace tutti::consistency
