// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>

#include "tutti/model/proxy_graph.hpp"
#include "tutti/wire/internal/columns.hpp"
#include "tutti/wire/internal/integer_coder.hpp"
#include "tutti/wire/internal/logarithm.hpp"
#include "tutti/wire/internal/quantise.hpp"
#include "tutti/wire/limits.hpp"

/// How the numbers of a proxy graph are predicted and coded. One routine serves both directions, so that they cannot
/// differ: it hands each number to code(model, number), which writes and returns it, or ignores it and returns the one
/// read.
namespace tutti::wire {

/// The stamps of one chain are multiples of a step after an offset: sensors are regular. Differences wrap around.
struct Clock {
  std::uint64_t offset_ns = 0;
  std::uint64_t step_ns = 1;
};

/// One chain's part of the graph.
struct Run {
  ChainId chain;
  Clock clock;
  std::size_t nodes = 0;
  std::size_t eliminated = 0;
  bool has_uncertainty = false;
};

struct ColumnWriter {
  RangeEncoder out;
  std::int64_t code(IntegerModel& model, std::int64_t value) {
    model.put(out, value);
    return value;
  }
};
struct ColumnReader {
  RangeDecoder in;
  std::int64_t code(IntegerModel& model, std::int64_t) { return model.get(in); }
};

/// Stamps of one chain, each by its distance to the one before.
class StampColumn {
 public:
  void start_run() { previous_ = 0; }
  template <class Coder>
  Timestamp code(Coder& coder, const Clock& clock, Timestamp stamp) {
    const std::uint64_t tick = (static_cast<std::uint64_t>(stamp.ns) - clock.offset_ns) / clock.step_ns;
    previous_ += static_cast<std::uint64_t>(coder.code(model_, static_cast<std::int64_t>(tick - previous_)));
    return {static_cast<std::int64_t>(clock.offset_ns + previous_ * clock.step_ns)};
  }

 private:
  IntegerModel model_;
  std::uint64_t previous_ = 0;
};

/// Predicts the nodes of one chain by a graph that the receiver has: a map is bent as a whole, so two neighbours keep
/// their places to each other.
class KnownNodes {
 public:
  struct Expected {
    PoseCode motion;  ///< Since the node before.
    CovarianceCode covariance;
  };
  KnownNodes() = default;
  explicit KnownNodes(std::span<const ProxyNode> nodes) : nodes_(nodes) {}
  /// The prediction of the node at this stamp. Stamps must be asked for in order; nothing unless this one and the one
  /// before are neighbours there.
  std::optional<Expected> at(Timestamp stamp) {
    while (next_ < nodes_.size() && nodes_[next_].stamp < stamp) skip();
    const bool is_known = next_ < nodes_.size() && nodes_[next_].stamp == stamp;
    std::optional<Expected> out;
    if (is_known && follows_)
      out = {quantise(T_world_previous_.inverse() * nodes_[next_].T_world_body, kProxyPoseSteps),
             quantise(nodes_[next_].covariance, kProxyCovarianceSteps)};
    if (is_known) skip();
    follows_ = is_known;
    return out;
  }

 private:
  void skip() {
    T_world_previous_ = nodes_[next_++].T_world_body;
    follows_ = false;
  }
  std::span<const ProxyNode> nodes_;
  std::size_t next_ = 0;
  Pose3 T_world_previous_;
  bool follows_ = true;  // the last one asked for is the one before `next_`
};

/// Nodes of one chain along its trajectory. A pose is coded as the motion since the node before *as the receiver knows
/// it*, so errors do not add up; by its difference to what is known of it, if anything is.
class NodeColumns {
 public:
  void start_run(std::span<const ProxyNode> known = {}) {
    stamps_.start_run();
    known_ = KnownNodes(known);
    T_world_previous_ = Pose3();
  }
  /// Nothing when a number is outside what encoding makes.
  template <class Coder>
  std::optional<ProxyNode> code(Coder& coder, const Run& run, const ProxyNode& node) {
    const Timestamp stamp = stamps_.code(coder, run.clock, node.stamp);
    PoseCode motion = quantise(T_world_previous_.inverse() * node.T_world_body, kProxyPoseSteps);
    CovarianceCode covariance = quantise(node.covariance, kProxyCovarianceSteps);
    if (const auto known = known_.at(stamp)) {
      code(coder, known_motion_, known->motion, motion);
      code(coder, known_covariance_, known->covariance, covariance);
    } else {
      code(coder, motion_, PoseCode{}, motion);
      std::int64_t change = 0;  // variances grow and shrink together
      for (std::size_t i = 0; i < covariance.size(); ++i) {
        const std::int64_t expected = sum(previous_covariance_[i], i < 6 ? change : 0);
        covariance[i] = sum(expected, coder.code(covariance_[i], difference(covariance[i], expected)));
        change = difference(covariance[i], previous_covariance_[i]);
      }
    }
    previous_covariance_ = covariance;

    const auto T_previous_body = dequantise(motion, kProxyPoseSteps);
    const auto matrix = dequantise(covariance, kProxyCovarianceSteps);
    if (!T_previous_body || !matrix) return std::nullopt;
    T_world_previous_ = T_world_previous_ * *T_previous_body;
    if (T_world_previous_.translation.cwiseAbs().maxCoeff() > kMaxCoordinate_m + 1.0) return std::nullopt;
    return ProxyNode{run.chain, stamp, T_world_previous_, *matrix};
  }

 private:
  template <class Coder, std::size_t K>
  static void code(Coder& coder, std::array<IntegerModel, K>& models, const std::array<std::int64_t, K>& expected,
                   std::array<std::int64_t, K>& numbers) {
    for (std::size_t i = 0; i < K; ++i)
      numbers[i] = sum(expected[i], coder.code(models[i], difference(numbers[i], expected[i])));
  }
  StampColumn stamps_;
  KnownNodes known_;
  std::array<IntegerModel, 6> motion_, known_motion_;
  std::array<IntegerModel, 21> covariance_, known_covariance_;
  Pose3 T_world_previous_;
  CovarianceCode previous_covariance_{};
};

/// Edges, in few bits when sorted. The logarithm of the weight is rounded; 0 stays 0.
class EdgeColumns {
 public:
  /// Nothing when an end is not one of the `nodes`.
  template <class Coder>
  std::optional<ProxyEdge> code(Coder& coder, std::int64_t nodes, const ProxyEdge& edge) {
    const std::int64_t step = coder.code(a_, edge.a - a);
    a = sum(a, step);
    const std::int64_t from = step == 0 ? b : a;
    b = sum(from, coder.code(step == 0 ? next_b_ : first_b_, edge.b - from));
    if (a < 0 || a >= nodes || b < 0 || b >= nodes) return std::nullopt;
    ProxyEdge out{static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b), 0.0};
    if (coder.code(positive_, edge.weight > 0.0 ? 1 : 0) == 0) return out;
    log_weight = sum(log_weight, coder.code(log_weight_, difference(rounded_log(edge.weight), log_weight)));
    out.weight = std::exp(static_cast<double>(log_weight) * kLogWeightStep);
    return out;
  }
  std::int64_t a = 0, b = 0, log_weight = 0;  ///< The last edge's.

 private:
  static constexpr double kLogWeightStep = 1.0 / 2048.0;
  static std::int64_t rounded_log(double weight) {
    constexpr double kMax = 88.7;  // clear of the largest float
    return weight > 0.0 ? std::llround(std::min(std::log(weight), kMax) / kLogWeightStep) : 0;
  }
  IntegerModel a_, first_b_, next_b_, positive_, log_weight_;
};

/// Uncertainties: `whole`, then scale after scale, the sigmas each by their difference to the block before, then the
/// directions, then what is doubted.
class UncertaintyColumns {
 public:
  /// Nothing when a number is outside what encoding makes.
  template <class Coder>
  std::optional<ChainUncertainty> code(Coder& coder, const Run& run, const ChainUncertainty& in) {
    ChainUncertainty out{.chain = run.chain};
    SigmaCode previous{};
    if (!code(coder, whole_, in.whole, previous, out.whole)) return std::nullopt;
    const auto scales = coder.code(count_, static_cast<std::int64_t>(in.scales.size()));
    if (scales < 0 || scales > static_cast<std::int64_t>(ChainUncertainty::kMostScales)) return std::nullopt;
    for (std::size_t s = 0; s < static_cast<std::size_t>(scales); ++s) {
      const ScaleUncertainty scale = s < in.scales.size() ? in.scales[s] : ScaleUncertainty{};
      auto& made = out.scales.emplace_back();
      if (coder.code(has_sigma_, scale.sigma.empty() ? 0 : 1) == 0) continue;
      for (std::size_t b = 0; b < ChainUncertainty::blocks(run.nodes); ++b) {
        const PoseSigma sigma = scale.sigma.empty() ? PoseSigma{} : scale.sigma[b];
        if (!code(coder, b == 0 ? first_ : next_, sigma, previous, made.sigma.emplace_back())) return std::nullopt;
      }
    }
    const auto directions = coder.code(count_, static_cast<std::int64_t>(in.directions.size()));
    if (directions < 0 || directions > static_cast<std::int64_t>(ChainUncertainty::kMostDirections))
      return std::nullopt;
    for (std::size_t d = 0; d < static_cast<std::size_t>(directions); ++d)
      if (!code(coder, run, d < in.directions.size() ? in.directions[d] : KnownDirection{},
                out.directions.emplace_back()))
        return std::nullopt;
    if (coder.code(doubted_, in.doubted ? 1 : 0) == 0) return out;
    if (!code(coder, run, in.doubted ? *in.doubted : KnownDirection{}, out.doubted.emplace())) return std::nullopt;
    return out;
  }

 private:
  static constexpr int kSigmaSteps = 8;
  static constexpr int kFineSteps = 1024;
  using SigmaCode = std::array<std::int64_t, 2>;
  using Models = std::array<IntegerModel, 2>;
  /// `previous` becomes this one's code.
  template <class Coder>
  static bool code(Coder& coder, Models& models, const PoseSigma& sigma, SigmaCode& previous, PoseSigma& out) {
    const SigmaCode wanted{quantise_log(sigma.position_m, kSigmaSteps), quantise_log(sigma.rotation_rad, kSigmaSteps)};
    for (std::size_t k = 0; k < 2; ++k)
      previous[k] = sum(previous[k], coder.code(models[k], difference(wanted[k], previous[k])));
    const auto position_m = dequantise_log(previous[0], kSigmaSteps);
    const auto rotation_rad = dequantise_log(previous[1], kSigmaSteps);
    if (position_m && rotation_rad) out = {*position_m, *rotation_rad};
    return position_m && rotation_rad;
  }
  template <class Coder>
  bool code_fine(Coder& coder, double value, double& out) {
    const auto made = dequantise_log(coder.code(fine_, quantise_log(value, kFineSteps)), kFineSteps);
    if (made) out = *made;
    return made.has_value();
  }
  template <class Coder>
  bool code(Coder& coder, const Run& run, const KnownDirection& in, KnownDirection& out) {
    if (!code_fine(coder, in.rotation_scale, out.rotation_scale) || !code_fine(coder, in.sigma, out.sigma))
      return false;
    const std::size_t spread = ChainUncertainty::spread(run.nodes).size();
    for (std::size_t i = 0; i + 3 < 3 * spread; ++i)
      for (const auto member : {&KnownDirection::position, &KnownDirection::rotation}) {
        const auto number = coder.code(number_, i < (in.*member).size() ? (in.*member)[i] : 0);
        if (number < -127 || number > 127) return false;
        (out.*member).push_back(static_cast<std::int8_t>(number));
      }
    return true;
  }
  Models whole_, first_, next_;
  IntegerModel count_, has_sigma_, doubted_, fine_, number_;
};

}  // namespace tutti::wire
