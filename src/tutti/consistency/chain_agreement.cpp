// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/chain_agreement.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "tutti/base/check.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/spectral/chain_transform.hpp"

namespace tutti::consistency {
namespace {

using std::numbers::pi;

/// What the wire rounds poses to (wire/codec.hpp): an error of its own at every node.
constexpr ShapeSigma kRounding{5e-4, 1e-4};

/// Thresholds as above are on the safe side throughout (the worst direction for all, bounds where octaves end): with
/// the true covariance they could all be 0.7 to 0.8 of what they are before the false-alarm rate is met
/// (chain_agreement_test, 300 draws). For whole scales, which slow drift is noticed by, this much is taken back.
constexpr double kCalibration = 0.8;

/// As many as leave about two waves of the run to the largest scale.
int default_scales(std::size_t nodes) {
  return std::max(2, static_cast<int>(2.0 * std::log2(std::max<double>(1.0, static_cast<double>(nodes))) - 4.3));
}

double stretch_half(int octave) { return std::ldexp(static_cast<double>(ShapeUncertainty::kShortest), octave); }

/// Octave of half-lengths L = kShortest 2^octave that a frequency pi / L belongs to.
int octave_of(double omega) {
  return static_cast<int>(std::lround(std::log2(pi / omega / static_cast<double>(ShapeUncertainty::kShortest))));
}

/// Squared sag at a rank: between the middles of the two nearest stretches of the octave, linearly; octaves below the
/// shortest as of a random walk.
ShapeSigma squared_sag(const ShapeUncertainty& shape, int octave, double rank) {
  const auto& stretches = shape.sag[static_cast<std::size_t>(std::max(octave, 0))];
  const double at = (rank / stretch_half(std::max(octave, 0)) - 1.0) / 2.0;
  const double last = static_cast<double>(stretches.size() - 1);
  const auto i = static_cast<std::size_t>(std::clamp(at, 0.0, last));
  const std::size_t j = std::min(i + 1, stretches.size() - 1);
  const double alpha = std::clamp(at - static_cast<double>(i), 0.0, 1.0);
  const double shrink = octave < 0 ? std::ldexp(1.0, octave) : 1.0;
  const auto mix = [&](double a, double b) { return shrink * ((1.0 - alpha) * a * a + alpha * b * b); };
  return {mix(stretches[i].position_m, stretches[j].position_m),
          mix(stretches[i].rotation_rad, stretches[j].rotation_rad)};
}

/// How the variances of octaves and whole add up to that of each scale's coefficients.
struct Propagation {
  int first = 0;             ///< Octave of column 0.
  Eigen::MatrixXd octaves;   ///< scales x octaves
  Eigen::VectorXd whole;     ///< scales
  Eigen::VectorXd modes;     ///< scales: how many each holds
  Eigen::VectorXd rounding;  ///< scales
};

Propagation propagate(const spectral::MeyerFilterBank& bank, const Signal& signal, Eigen::Index n, int octaves) {
  Propagation out;
  out.first = octave_of(pi);
  const int columns = octaves > 0 ? octaves - out.first : 0;
  out.octaves = Eigen::MatrixXd::Zero(bank.scales(), columns);
  out.whole = out.rounding = out.modes = Eigen::VectorXd::Zero(bank.scales());
  Eigen::VectorXd fourth = out.modes;
  Eigen::VectorXd sag_energy = Eigen::VectorXd::Zero(columns);
  double beyond = 0.0;
  for (Eigen::Index k = 1; k < n; ++k) {
    const double omega = pi * static_cast<double>(k) / static_cast<double>(n);
    const double lambda = spectral::chain_eigenvalue(k, n);
    const int octave = octave_of(omega);
    const bool in_octaves = octave < octaves && columns > 0;
    const Eigen::Index column = octave - out.first;
    if (in_octaves)
      sag_energy(column) += std::pow(1.0 - std::cos(omega * stretch_half(octave)), 2);
    else
      beyond += 1.0;
    for (int s = 0; s < bank.scales(); ++s) {
      const double passed = std::pow(bank.kernel(s, lambda), 2);
      out.modes(s) += passed;
      fourth(s) += passed * passed;
      const double energy = signal.gain(lambda) * passed;
      (in_octaves ? out.octaves(s, column) : out.whole(s)) += energy;
      out.rounding(s) += energy / static_cast<double>(n);
    }
  }
  for (int c = 0; c < columns; ++c)
    if (sag_energy(c) > 0.0) out.octaves.col(c) /= sag_energy(c);
  if (beyond > 0.0) out.whole /= 2.0 * beyond;  // there are about two directions of one variance
  out.rounding = out.rounding.cwiseMax(1e-6);   // runs of a few nodes have scales without a mode: no threshold of zero
  out.modes = out.modes.cwiseProduct(out.modes).cwiseQuotient(fourth.cwiseMax(1e-300)).cwiseMax(1.0);
  return out;
}

/// The scales cannot hold more than the whole (the bank is a tight frame); where a coarse reading of the sags says so,
/// it is what is wrong.
void bound_by_whole(Eigen::MatrixXd& variance, double whole, const Signal& signal) {
  const double sum = variance.colwise().mean().sum();
  if (signal.gain(1.0) == signal.gain(2.0) && sum > whole * whole) variance *= whole * whole / sum;
}

}  // namespace

double chi_3_exceeded_with(double probability) {
  TUTTI_CHECK(probability > 0.0 && probability < 1.0, "probability {}", probability);
  const auto log_tail = [](double x) {
    return std::log(std::erfc(x / std::numbers::sqrt2) + std::sqrt(2.0 / pi) * x * std::exp(-0.5 * x * x));
  };
  double low = 0.0;
  double high = 37.0;  // the tail is 1e-298 there
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (log_tail(middle) > std::log(probability) ? low : high) = middle;
  }
  return high;
}

double chi_square_exceeded_with(double probability, double degrees_of_freedom) {
  TUTTI_CHECK(probability > 0.0 && probability < 1.0 && degrees_of_freedom > 0.0, "probability {}, {} degrees",
              probability, degrees_of_freedom);
  double low = -38.0;
  double high = 38.0;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (0.5 * std::erfc(middle / std::numbers::sqrt2) > probability ? low : high) = middle;
  }
  const double spread = 2.0 / (9.0 * degrees_of_freedom);
  return degrees_of_freedom * std::pow(std::max(0.0, 1.0 - spread + high * std::sqrt(spread)), 3);
}

ChainAgreement::ChainAgreement(std::span<const std::size_t> ranks, const ShapeUncertainty* shape, std::uint64_t update,
                               const AgreementConfig& config)
    : bank_(config.scales > 0 ? std::max(2, config.scales) : default_scales(ranks.size()), spectral::kChainLambdaMax) {
  TUTTI_CHECK(update > 0, "updates count from 1");
  auto signal = make_signal(config.signal);
  TUTTI_CHECK(signal.has_value(), "signal '{}' is unknown", config.signal);
  signal_ = std::move(*signal);
  const auto n = static_cast<Eigen::Index>(ranks.size());
  threshold_m_.setConstant(n, bank_.scales(), config.threshold_m);
  threshold_rad_.setConstant(n, bank_.scales(), config.threshold_deg * kRadPerDeg);
  mean_square_.setConstant(bank_.scales(), 1.0);
  if (n < 2 || shape == nullptr || config.thresholds == "absolute") return;

  const double doublings = std::floor(std::log2(static_cast<double>(update)));
  const double look = config.false_alarm_rate / ((doublings + 1.0) * (doublings + 2.0));
  if (config.tests == "ties") {
    threshold_m_.setConstant(std::numeric_limits<double>::infinity());
    threshold_rad_ = threshold_m_;
  } else {
    set_wavelet_thresholds(ranks, *shape, look / 3.0);
  }
  if (config.tests != "wavelets") set_tie_thresholds(ranks, *shape, look / 3.0);
}

void ChainAgreement::set_wavelet_thresholds(std::span<const std::size_t> ranks, const ShapeUncertainty& shape,
                                            double rate) {
  const auto n = static_cast<Eigen::Index>(ranks.size());
  const Propagation through = propagate(bank_, *signal_, n, static_cast<int>(shape.sag.size()));
  const double share = rate / (2.0 * bank_.scales());
  const double factor = chi_3_exceeded_with(share / static_cast<double>(n));
  for (int s = 0; s < bank_.scales(); ++s)
    mean_square_(s) = std::pow((shape.sag.empty() ? 1.0 : kCalibration) / factor, 2) *
                      chi_square_exceeded_with(share, 3.0 * through.modes(s)) / through.modes(s);
  for (Eigen::Index k = 0; k < n; ++k) {
    Eigen::VectorXd position = through.whole * std::pow(shape.whole.position_m, 2);
    Eigen::VectorXd rotation = through.whole * std::pow(shape.whole.rotation_rad, 2);
    for (Eigen::Index c = 0; c < through.octaves.cols(); ++c) {
      const auto sag = squared_sag(shape, through.first + static_cast<int>(c),
                                   static_cast<double>(ranks[static_cast<std::size_t>(k)]));
      position += through.octaves.col(c) * sag.position_m;
      rotation += through.octaves.col(c) * sag.rotation_rad;
    }
    threshold_m_.row(k) = position.transpose();
    threshold_rad_.row(k) = rotation.transpose();
  }
  bound_by_whole(threshold_m_, shape.whole.position_m, *signal_);
  bound_by_whole(threshold_rad_, shape.whole.rotation_rad, *signal_);
  threshold_m_.rowwise() += std::pow(kRounding.position_m, 2) * through.rounding.transpose();
  threshold_rad_.rowwise() += std::pow(kRounding.rotation_rad, 2) * through.rounding.transpose();
  threshold_m_ = factor * threshold_m_.cwiseSqrt();
  threshold_rad_ = factor * threshold_rad_.cwiseSqrt();
}

void ChainAgreement::set_tie_thresholds(std::span<const std::size_t> ranks, const ShapeUncertainty& shape,
                                        double rate) {
  for (const ShapeTie& tie : shape.ties) {
    const auto a = std::ranges::lower_bound(ranks, tie.a), b = std::ranges::lower_bound(ranks, tie.b);
    if (a == ranks.end() || *a != tie.a || b == ranks.end() || *b != tie.b) continue;
    ties_.push_back({static_cast<std::size_t>(a - ranks.begin()),
                     static_cast<std::size_t>(b - ranks.begin()),
                     {std::hypot(tie.sigma.position_m, kRounding.position_m),
                      std::hypot(tie.sigma.rotation_rad, kRounding.rotation_rad)}});
  }
  if (ties_.empty()) return;
  const double factor = chi_3_exceeded_with(rate / (2.0 * static_cast<double>(ties_.size())));
  for (Tie& tie : ties_) tie.threshold = {factor * tie.threshold.position_m, factor * tie.threshold.rotation_rad};
}

ChainDisagreement ChainAgreement::compare(std::span<const Pose3> server, std::span<const Pose3> robot) const {
  ChainDisagreement out = compare(signal_->difference(server, robot));
  for (const auto& [a, b, threshold] : ties_) {
    const Pose3 T_server = server[a].inverse() * server[b], T_robot = robot[a].inverse() * robot[b];
    MissedTie missed{.a = a,
                     .b = b,
                     .position_m = (T_robot.translation - T_server.translation).norm(),
                     .rotation_rad = T_server.rotation.angularDistance(T_robot.rotation)};
    missed.significance =
        std::max(missed.position_m / threshold.position_m, missed.rotation_rad / threshold.rotation_rad);
    if (missed.significance > 1.0) out.missed_ties.push_back(missed);
  }
  std::ranges::stable_sort(out.missed_ties, std::greater{}, &MissedTie::significance);
  return out;
}

ChainDisagreement ChainAgreement::compare(const Eigen::MatrixXd& difference) const {
  TUTTI_CHECK(difference.rows() == nodes(), "{} rows, {} nodes", difference.rows(), nodes());
  if (nodes() == 0) return {};
  const Eigen::Index d = difference.cols();
  Eigen::MatrixXd f(spectral::fast_chain_length(nodes()), d);
  f.topRows(nodes()) = difference;
  f.bottomRows(f.rows() - nodes()).rowwise() = difference.row(nodes() - 1);
  const Eigen::MatrixXd W = spectral::chain_transform(bank_, f).topRows(nodes());
  const Eigen::Index metres = std::min(signal_->metres(), d);
  ChainDisagreement out;
  out.position_m.resize(nodes(), scales());
  out.rotation_rad.setZero(nodes(), scales());
  for (int s = 0; s < scales(); ++s) {  // eq. (8)
    out.position_m.col(s) = W.middleCols(s * d, metres).rowwise().norm();
    if (d > metres) out.rotation_rad.col(s) = W.middleCols(s * d + metres, d - metres).rowwise().norm();
  }
  out.significance =
      out.position_m.cwiseQuotient(threshold_m_).cwiseMax(out.rotation_rad.cwiseQuotient(threshold_rad_));
  const auto energy = [](const Eigen::MatrixXd& W_abs, const Eigen::MatrixXd& threshold) -> Eigen::VectorXd {
    return W_abs.cwiseQuotient(threshold).array().square().matrix().colwise().mean().transpose();
  };
  out.scale_significance = energy(out.position_m, threshold_m_)
                               .cwiseMax(energy(out.rotation_rad, threshold_rad_))
                               .cwiseQuotient(mean_square_)
                               .cwiseSqrt();
  return out;
}

double ChainAgreement::scale_length(int scale) const {
  if (scale == 0) return static_cast<double>(nodes());
  const double lambda = spectral::kChainLambdaMax * std::ldexp(1.0, scale - scales() + 1);
  return pi / std::acos(1.0 - 0.5 * std::min(lambda, spectral::kChainLambdaMax));
}

}  // namespace tutti::consistency
