// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/consistency/signal.hpp"
#include "tutti/model/proxy_graph.hpp"
#include "tutti/spectral/meyer.hpp"

namespace tutti::consistency {

struct AgreementConfig {
  std::string signal = "pose";
  int scales = 0;
  double false_alarm_rate = 0.01;
  std::string thresholds = "server";
  std::string tests = "both";
  double threshold_m = 0.05;
  double threshold_deg = 0.5;

  template <class V>
  void describe(V& v) {
    v.field("signal", signal, one_of({"distance", "pose", "relative_motion"}),
            "What is compared along the time chain: 'distance' to the first node, 'pose', or 'relative_motion'.");
    v.field("scales", scales, between(0, 30),
            "Wavelet scales, half an octave of length each; 0: as many as the run is long.");
    v.field("false_alarm_rate", false_alarm_rate, between(1e-9, 0.5),
            "Chance that a robot which agrees with the server within the server's own uncertainty is told otherwise, "
            "once per mission.");
    v.field("thresholds", thresholds, one_of({"server", "absolute"}),
            "server: from the uncertainty that the server sends and false_alarm_rate; absolute: the two below.");
    v.field("tests", tests, one_of({"both", "wavelets", "ties"}),
            "What is held against the server's uncertainty: wavelets along the run, pairs of nodes that closures tie "
            "together, or both. One kind alone is there to compare with.");
    v.field("threshold_m", threshold_m, greater_than(0.0),
            "Absolute threshold on the disagreement in position, any scale; also where the server says nothing.");
    v.field("threshold_deg", threshold_deg, greater_than(0.0), "The same in rotation.");
  }
};

/// What a robot's poses of two tied nodes miss the server's relative pose T_a_b by.
struct MissedTie {
  std::size_t a = 0;  ///< Synchronised nodes, in time order.
  std::size_t b = 0;
  double position_m = 0.0;
  double rotation_rad = 0.0;
  double significance = 0.0;  ///< Over the threshold, the larger of the two.
};

/// A difference between robot and server, by node and scale (0 = largest), and by tie.
struct ChainDisagreement {
  Eigen::MatrixXd position_m;    ///< nodes x scales, length of the wavelet coefficient.
  Eigen::MatrixXd rotation_rad;  ///< Same shape; zero when the signal has no rotation.
  Eigen::MatrixXd significance;  ///< Over the threshold, the larger of the two.
  /// Per scale: the same for the energy of a whole scale, which drift raises that stands out nowhere.
  Eigen::VectorXd scale_significance;
  std::vector<MissedTie> missed_ties;  ///< Significance above 1, largest first.
  /// Something stands out of the server's uncertainty.
  [[nodiscard]] bool disagrees() const {
    return !missed_ties.empty() ||
           (significance.size() > 0 && std::max(significance.maxCoeff(), scale_significance.maxCoeff()) > 1.0);
  }
};

/// Tests the hypothesis that a robot differs from the server's map only within the server's own uncertainty, by
/// wavelets on the time chain of one robot's synchronised nodes, and across its ties.
///
/// The uncertainty (ShapeUncertainty) passes through the transform linearly: the sag of stretches of 2 L nodes is the
/// variance of the nodes' errors seen through the filter 1 - cos(omega L); this gives their spectral density in the
/// octave around omega = pi / L at every node, and from it sigma(s, n)^2 = (1/N) sum_k g_s(lambda_k)^2 P(lambda_k), the
/// variance of W_{s,n}. What is longer than the longest stretch is bounded by the uncertainty of the whole, what is
/// shorter than the shortest is taken as a random walk.
///
/// Three kinds of tests share the false-alarm rate by thirds: of every coefficient, |W| / sigma against the chi
/// quantile (3 degrees of freedom) for nodes x scales x {position, rotation} of them, which finds what is local; of
/// every scale, the mean of |W|^2 / sigma^2 over all nodes against the chi-square quantile for 3 degrees of freedom per
/// mode that the scale holds, which finds slow drift; and of every tie, what its relative pose is off by against the
/// chi quantile, which finds what only closures know: that a robot is back where it was. Updates while the run doubles
/// in length see much the same and count as one look: look k = 1, 2, ... has the share 1 / (k (k + 1)) of the rate,
/// which sums to 1 over a mission of any length. docs/math.md.
class ChainAgreement {
 public:
  /// `ranks`: of the synchronised nodes among the robot's proxy nodes, increasing. `shape` may be null. `update` counts
  /// from 1.
  ChainAgreement(std::span<const std::size_t> ranks, const ShapeUncertainty* shape, std::uint64_t update,
                 const AgreementConfig& config);

  /// Poses of the synchronised nodes, in frames of their own.
  [[nodiscard]] ChainDisagreement compare(std::span<const Pose3> server, std::span<const Pose3> robot) const;
  /// From the signal's difference(), n x d; without the ties.
  [[nodiscard]] ChainDisagreement compare(const Eigen::MatrixXd& difference) const;

  [[nodiscard]] Eigen::Index nodes() const { return threshold_m_.rows(); }
  [[nodiscard]] int scales() const { return bank_.scales(); }
  /// Half the wavelength in the middle of a scale's band, in nodes; scale 0: the whole run.
  [[nodiscard]] double scale_length(int scale) const;
  [[nodiscard]] const Eigen::MatrixXd& threshold_m() const { return threshold_m_; }  ///< nodes x scales
  [[nodiscard]] const Eigen::MatrixXd& threshold_rad() const { return threshold_rad_; }

 private:
  struct Tie {
    std::size_t a = 0, b = 0;  ///< Synchronised nodes.
    ShapeSigma threshold;
  };
  void set_wavelet_thresholds(std::span<const std::size_t> ranks, const ShapeUncertainty& shape, double rate);
  void set_tie_thresholds(std::span<const std::size_t> ranks, const ShapeUncertainty& shape, double rate);

  std::unique_ptr<Signal> signal_;
  spectral::MeyerFilterBank bank_;
  Eigen::MatrixXd threshold_m_, threshold_rad_;
  std::vector<Tie> ties_;
  Eigen::VectorXd mean_square_;  ///< Per scale: threshold on the mean over the nodes of (|W| / threshold)^2.
};

/// x with P(chi > x) = probability for the chi distribution with 3 degrees of freedom, probability in (0, 1).
double chi_3_exceeded_with(double probability);

/// x with P(chi^2 > x) = probability, for any number of degrees of freedom > 0 (Wilson and Hilferty, 1931). For 3 of
/// them within 2 % down to 1e-3, from there on too large: 3.5 % at 1e-4, 14 % at 1e-10; for 10, 1.1 and 4.8 %.
double chi_square_exceeded_with(double probability, double degrees_of_freedom);

}  // namespace tutti::consistency
