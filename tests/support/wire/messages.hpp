// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include "tutti/base/fields.hpp"
#include "tutti/base/random.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/model/closure_decision.hpp"
#include "tutti/model/loop_closure.hpp"
#include "tutti/model/map_mark.hpp"
#include "tutti/model/messages.hpp"
#include "tutti/model/refinement.hpp"
#include "tutti/model/status.hpp"
#include "tutti/model/submap_copy.hpp"

/// Valid messages for the tests of wire/.
namespace tutti::wire::test {

inline Pose3 any_pose(Rng& rng, double extent_m, double extent_rad = 3.0) {
  Pose3 T;
  for (double& t : T.translation) t = rng.uniform(-extent_m, extent_m);
  Eigen::Vector3d theta;
  for (double& r : theta) r = rng.uniform(-1.0, 1.0);
  T.rotation = so3_exp(theta * rng.uniform(0.0, extent_rad) / std::max(theta.norm(), 1e-9)).normalized();
  return T;
}

/// Positive definite with correlations of any strength and variances over many magnitudes.
inline Matrix6d any_covariance(Rng& rng) {
  Matrix6d mix;
  for (double& m : mix.reshaped()) m = rng.normal();
  mix.diagonal().array() += rng.uniform(0.0, 5.0);
  Vector6d scale;
  for (double& s : scale) s = std::exp(rng.uniform(-9.0, 1.0));
  const Matrix6d G = scale.asDiagonal() * mix;
  const Matrix6d covariance = G * G.transpose();
  return 0.5 * (covariance + covariance.transpose());
}

/// Pairs of steps of a walking robot: the covariance of odometry over `metres`, turning a little.
inline Matrix6d odometry_covariance(double metres, double turn_rad) {
  Matrix6d step = Matrix6d::Zero();
  step.diagonal() << 1e-6, 1e-6, 1e-6, 4e-9, 4e-9, 1e-7;
  const Pose3 T{so3_exp({0, 0, 0.02 * turn_rad}), {0.02 * metres, 0, 0}};
  Matrix6d covariance = step;
  for (int i = 1; i < 50; ++i) covariance = compound_covariance(T, covariance, step);
  return covariance * metres;
}

/// Many chains are the first of their robot; other sessions have any number.
inline std::uint64_t any_session(Rng& rng) { return rng.bernoulli(0.5) ? 0 : rng.index(~std::uint64_t{0}); }

inline SubmapMessage any_submap(Rng& rng, std::size_t keyframes, std::size_t points) {
  SubmapMessage message;
  const ChainId chain{RobotId{static_cast<std::uint32_t>(rng.index(5))}, any_session(rng)};
  message.header = {chain.robot, chain.session, rng.index(1000)};
  Submap& submap = message.submap;
  submap.id = {chain, static_cast<std::uint32_t>(rng.index(1000))};
  Keyframe keyframe{static_cast<std::uint32_t>(rng.index(100'000)), {1'700'000'000'123'456'789}, any_pose(rng, 100.0)};
  for (std::size_t k = 0; k < keyframes; ++k) {
    if (k > 0) {
      const Pose3 step = any_pose(rng, 1.0, 0.5);
      submap.odometry.push_back({step, any_covariance(rng)});
      keyframe.T_odom_body = keyframe.T_odom_body * step;
    }
    keyframe.representative = rng.bernoulli(0.7);
    submap.keyframes.push_back(keyframe);
    ++keyframe.index;
    keyframe.stamp.ns += 1 + static_cast<std::int64_t>(rng.index(2'000'000'000));
  }
  if (points > 0) {
    auto cloud = std::make_shared<PointCloud>();
    for (std::size_t i = 0; i < points; ++i)
      cloud->points.emplace_back(rng.uniform(-40, 40), rng.uniform(-40, 40), rng.uniform(-2, 4));
    submap.cloud = cloud;
  }
  return message;
}

/// As of a drifting trajectory with so many nodes.
inline ChainUncertainty any_uncertainty(Rng& rng, const ChainId& chain, std::size_t nodes) {
  const auto sigma = [&](double length) {
    return PoseSigma{0.002 * std::pow(length, 1.3) * std::exp(rng.normal(0.12)),
                     0.001 * std::sqrt(length) * std::exp(rng.normal(0.12))};
  };
  ChainUncertainty out{.chain = chain, .whole = sigma(static_cast<double>(nodes))};
  for (int s = 0; s < 4; ++s) {
    ScaleUncertainty& scale = out.scales.emplace_back();
    if (s == 1) continue;
    for (std::size_t b = 0; b < ChainUncertainty::blocks(nodes); ++b) scale.sigma.push_back(sigma(8.0 / (1 + s)));
  }
  const std::size_t spread = ChainUncertainty::spread(nodes).size();
  for (std::size_t d = spread == 0 ? 0 : rng.index(5); d-- > 0;) {
    KnownDirection& direction = out.directions.emplace_back();
    direction.rotation_scale = rng.uniform(0.1, 10.0);
    direction.sigma = rng.uniform(0.01, 1.0);
    for (std::size_t i = 3; i < 3 * spread; ++i) {
      direction.position.push_back(static_cast<std::int8_t>(static_cast<int>(rng.index(255)) - 127));
      direction.rotation.push_back(static_cast<std::int8_t>(static_cast<int>(rng.index(255)) - 127));
    }
  }
  if (out.directions.size() > 1) out.doubted = out.directions.front();
  return out;
}

/// Nodes about every metre along each chain's trajectory, two chains a robot; of every other chain, beginning with the
/// first, it is known how sure the server is.
inline ProxyGraphMessage any_proxy_graph(Rng& rng, std::size_t chains, std::size_t nodes_each, bool reduced) {
  ProxyGraphMessage message;
  message.header.session = rng.index(1'000'000'000'000);
  message.header.sequence = rng.index(1000);
  ProxyGraph& graph = message.graph;
  graph.epoch = rng.index(1'000'000'000);
  graph.revision = rng.index(1000);
  graph.reduced = reduced;
  for (std::size_t r = 0; r < chains; ++r) {
    const ChainId chain{RobotId{static_cast<std::uint32_t>(3 * (r / 2))}, r % 2 == 0 ? 0 : 1 + any_session(rng)};
    graph.components.push_back({chain, static_cast<std::uint32_t>(rng.index(2))});
    Timestamp stamp{1'700'000'000'123'456'789 + static_cast<std::int64_t>(rng.index(1'000'000'000))};
    Pose3 T = any_pose(rng, 50.0);
    const std::size_t first = graph.nodes.size();
    for (std::size_t k = 0; k < nodes_each; ++k) {
      stamp.ns += 1'000'000'000 + static_cast<std::int64_t>(rng.index(500'000'000));
      const double turn = rng.normal(0.1);
      T = T * Pose3{so3_exp({rng.normal(0.01), rng.normal(0.01), turn}), {rng.uniform(0.9, 1.2), 0.0, 0.0}};
      if (reduced && k > 0 && k + 1 < nodes_each && rng.bernoulli(0.5)) {
        graph.eliminated.push_back({chain, stamp});
        continue;
      }
      const Matrix6d covariance = k == 0 ? Matrix6d::Zero() : odometry_covariance(rng.uniform(0.9, 1.2), turn);
      graph.nodes.push_back({chain, stamp, T, covariance});
    }
    const ProxyNode& last = graph.nodes.back();
    if (r % 2 == 1) graph.last_seen.pop_back();  // in the session before
    graph.last_seen.push_back(
        {chain, last.stamp, last.T_world_body, r % 4 < 2 ? "robot-" + std::to_string(r / 2) : std::string()});
    if (r % 2 == 0) graph.uncertainties.push_back(any_uncertainty(rng, chain, graph.nodes.size() - first));
    if (!reduced) continue;
    for (std::size_t a = first; a < graph.nodes.size(); ++a)
      for (std::size_t b = a + 1; b < std::min(a + 5, graph.nodes.size()); ++b)
        graph.edges.push_back({static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b), rng.uniform(0.0, 2.0)});
  }
  return message;
}

inline ClosureVerdict any_verdict(Rng& rng, std::size_t closures) {
  const ChainId one{RobotId{0}, any_session(rng)}, two{RobotId{1}, any_session(rng)};
  ClosureVerdict verdict{
      .pair = {{one, static_cast<std::uint32_t>(rng.index(1000))}, {two, static_cast<std::uint32_t>(rng.index(1000))}}};
  for (std::size_t i = 0; i < closures; ++i)
    verdict.closures.push_back({{one, static_cast<std::uint32_t>(rng.index(1000))},
                                {two, static_cast<std::uint32_t>(rng.index(1000))},
                                {any_pose(rng, 5.0), any_covariance(rng)}});
  if (closures == 0) verdict.refusal = Refusal{RefusalReason::overlap, rng.uniform(0.0, 0.3), 0.3};
  if (rng.bernoulli(0.7))
    verdict.verifier = {rng.bernoulli(0.5) ? "lidar" : "", static_cast<std::uint32_t>(rng.index(3)), rng.index(3)};
  if (closures > 0 && rng.bernoulli(0.7)) {
    verdict.evidence = {{RefusalReason::overlap, rng.uniform(0.3, 1.0), 0.3}, {RefusalReason::plane_rmse, 0.02, 0.1}};
    verdict.worker = 1 + rng.index(3);
    verdict.verified_ns = 1'700'000'000'000'000'000;
  }
  return verdict;
}

inline std::vector<SubmapPair> any_pairs(Rng& rng, std::size_t count) {
  std::vector<SubmapPair> pairs;
  for (std::size_t i = 0; i < count; ++i) {
    SubmapPair pair = any_verdict(rng, 1).pair;
    pair.second.index = static_cast<std::uint32_t>(rng.index(1000));
    pairs.push_back(pair);
  }
  return pairs;
}

/// Fills every field with any value that its rule allows (base/fields.hpp), about every third with none.
class AnyFields {
 public:
  explicit AnyFields(Rng& rng) : rng_(rng) {}
  template <class T>
  void field(int /*number*/, const char* name, T& value, const FieldRule& rule = {}, const char* /*help*/ = "") {
    const bool is_needed = rule.text == FieldRule::Text::name || rule.at_least > 0 || rule.low > 0.0 || rule.always;
    if (!HasFields<T> && !is_needed && rng_.bernoulli(0.3)) return;
    if constexpr (IsOptionalField<T>) {
      fill(value.emplace(), name, rule);
    } else if constexpr (IsListField<T>) {
      value.resize(rng_.index(std::min<std::size_t>(4, rule.at_most + 1)));
      for (auto& element : value) fill(element, name, rule);
    } else {
      fill(value, name, rule);
    }
  }

 private:
  template <class T>
  void fill(T& value, const std::string& name, const FieldRule& rule) {
    if constexpr (HasFields<T>) {
      value.describe(*this);
    } else if constexpr (std::is_same_v<T, std::string>) {
      value = rule.text == FieldRule::Text::any ? name + "/12-\xff/7" : "any_" + name;
      value.resize(std::min(value.size(), rule.at_most));
    } else if constexpr (std::is_same_v<T, std::map<std::uint64_t, NumberSet>>) {
      for (std::uint64_t sessions = rng_.index(4); sessions > 0; --sessions)
        for (int i = 0; i < 20; ++i) value[any_session(rng_)].insert(rng_.index(40));
    } else if constexpr (std::is_same_v<T, Pose3>) {
      value = any_pose(rng_, 100.0);
    } else if constexpr (std::is_same_v<T, Matrix6d>) {
      value = any_covariance(rng_);
    } else if constexpr (std::is_same_v<T, Timestamp>) {
      value.ns = static_cast<std::int64_t>(rng_.index(std::uint64_t{1} << 62U));
    } else if constexpr (std::is_same_v<T, RobotId>) {
      value.value = static_cast<std::uint32_t>(rng_.index(1000));
    } else if constexpr (std::is_same_v<T, double>) {
      value = rng_.uniform(std::max(rule.low, -1e4), std::min(rule.high, 1e4));
    } else if constexpr (std::is_enum_v<T>) {
      value = static_cast<T>(rule.low +
                             static_cast<double>(rng_.index(1 + static_cast<std::uint64_t>(rule.high - rule.low))));
    } else if constexpr (std::is_same_v<T, bool>) {
      value = true;
    } else {
      constexpr std::uint64_t kAny = ~std::uint64_t{0};  // of any size, and below 0
      value = static_cast<T>(rng_.index(rule.high < 1e18 ? static_cast<std::uint64_t>(rule.high) + 1 : kAny));
    }
  }
  Rng& rng_;
};
template <HasFields T>
T any_fields(Rng& rng) {
  AnyFields fields(rng);
  T value;
  value.describe(fields);
  return value;
}

inline NodeStatus any_status(Rng& rng) { return any_fields<NodeStatus>(rng); }

inline MissionStatus any_mission_status(Rng& rng) {
  auto status = any_fields<MissionStatus>(rng);
  for (std::uint32_t i = 0; auto& robot : status.robots) robot.robot.value = 3 * i++;
  for (std::uint32_t i = 7; auto& worker : status.workers) worker.number = i++;
  return status;
}

inline ClosureDecision any_decision(Rng& rng) { return any_fields<ClosureDecision>(rng); }
inline MarkOrder any_mark_order(Rng& rng) { return any_fields<MarkOrder>(rng); }
inline Receipt any_receipt(Rng& rng) { return any_fields<Receipt>(rng); }
inline SubmapRequest any_submap_request(Rng& rng) { return any_fields<SubmapRequest>(rng); }
inline SubmapCopy any_submap_copy(Rng& rng) { return any_fields<SubmapCopy>(rng); }

inline Verdicts any_verdicts(Rng& rng) {
  Verdicts out{.job = "12/0.3:4-5_6",
               .verdicts = {},
               .failed = any_pairs(rng, rng.index(3)),
               .why = "\xff no cloud",
               .cannot = rng.bernoulli(0.5)};
  for (std::size_t i = rng.index(5); i > 0; --i) out.verdicts.push_back(any_verdict(rng, rng.index(3)));
  return out;
}

inline RefinementJob any_refinement_job(Rng& rng) {
  RefinementJob job{.id = "12/0/7", .revision = rng.index(1000), .whole = rng.bernoulli(0.5)};
  for (std::uint64_t i = rng.index(5); i > 0; --i) {
    RefinementJob::Part part{any_submap_copy(rng).id, rng.bernoulli(0.5), {}};
    for (std::uint64_t k = rng.index(4); k > 0; --k) part.T_world_body.push_back(any_pose(rng, 100.0));
    job.parts.push_back(std::move(part));
  }
  std::ranges::sort(job.parts, {}, &RefinementJob::Part::submap);
  const auto twice = std::ranges::unique(job.parts, {}, &RefinementJob::Part::submap);
  job.parts.erase(twice.begin(), twice.end());
  job.closed = any_pairs(rng, rng.index(4));
  std::ranges::sort(job.closed);
  if (rng.bernoulli(0.5)) job.refiner = {"bundle", 1, 1 + rng.index(9)};
  if (rng.bernoulli(0.5)) job.settings = "sigma_px: 1.0\n";
  return job;
}

inline Refinement any_refinement(Rng& rng) {
  Refinement out = answer_to(any_refinement_job(rng));
  for (std::uint64_t i = rng.index(8); i > 0; --i) {
    const ChainId chain{RobotId{static_cast<std::uint32_t>(rng.index(3))}, any_session(rng)};
    out.T_world_body[{chain, static_cast<std::uint32_t>(rng.index(1000))}] = any_pose(rng, 100.0);
  }
  for (const auto& [id, T] : out.T_world_body)
    if (rng.bernoulli(0.7)) out.steps.push_back({id, {any_pose(rng, 5.0), any_covariance(rng)}});
  out.counts = {.keyframes = rng.index(1000), .two_things = rng.index(1000), .rms_before_px = 1.5, .rms_after_px = 0.5};
  if (rng.bernoulli(0.3)) out.remarks.push_back({RobotId{2}, "its IMU is not believed"});
  if (rng.bernoulli(0.3)) out.why = "no images";
  out.cannot = rng.bernoulli(0.2);
  return out;
}

}  // namespace tutti::wire::test
