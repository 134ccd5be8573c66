// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "support/random_pose.hpp"
#include "tutti/base/random.hpp"
#include "tutti/geometry/covariance.hpp"
#include "tutti/server/closure_verifier.hpp"
#include "tutti/server/map_estimate.hpp"

/// Small maps with known truth for the tests of this folder.
namespace tutti::server::test {

/// Robots walk once and a half around a circle of 10 m radius, a keyframe a metre, half a metre apart sideways.
inline Pose3 true_pose(RobotId robot, std::uint32_t index) {
  const double angle = 0.1 * index + 0.3 * robot.value;
  const double radius = 10.0 + 0.5 * robot.value;
  return {Eigen::Quaterniond(Eigen::AngleAxisd(angle + std::numbers::pi / 2, Eigen::Vector3d::UnitZ())),
          {radius * std::cos(angle), radius * std::sin(angle), 0.1 * robot.value}};
}

struct TestWorldConfig {
  std::uint32_t keyframes = 91;
  std::uint32_t per_submap = 10;
  double sigma_m = 0.02;
  double sigma_rad = 0.005;
};

using tutti::test::draw;

/// Overlapping submaps of one chain with noisy odometry, in an odom frame of its own.
inline std::vector<Submap> make_submaps(const ChainId& chain, const TestWorldConfig& config, Rng rng) {
  std::vector<Submap> submaps;
  Submap open{.id = {chain, 0}};
  Pose3 T_odom_body = retract({}, draw(rng, 5.0, 1.0));
  for (std::uint32_t k = 0; k < config.keyframes; ++k) {
    if (k > 0) {
      const Pose3 step = true_pose(chain.robot, k - 1).inverse() * true_pose(chain.robot, k);
      const Pose3 measured = retract(step, draw(rng, config.sigma_m, config.sigma_rad));
      T_odom_body = T_odom_body * measured;
      open.odometry.push_back({measured, diagonal_covariance(config.sigma_m, config.sigma_rad)});
    }
    open.keyframes.push_back({k, Timestamp{1'000'000'000LL * (k + 1)}, T_odom_body, k % 2 == 0});
    if (open.keyframes.size() > config.per_submap || k + 1 == config.keyframes) {
      submaps.push_back(open);
      open = {.id = {chain, open.id.index + 1}, .keyframes = {open.keyframes.back()}};
    }
  }
  return submaps;
}

/// True relative poses with noise between the middle keyframes of submaps closer than 4 m; every `wrong_every`-th
/// reporting pair is wrong by 3 m.
class TestVerifier final : public ClosureVerifier {
 public:
  explicit TestVerifier(std::uint64_t seed, std::uint32_t wrong_every = 0, std::uint32_t version = 1)
      : seed_(seed), wrong_every_(wrong_every), version_(version) {}

  [[nodiscard]] MethodId id() const override { return {"test", version_, 0}; }
  [[nodiscard]] bool can_compare(const PayloadSize&, const PayloadSize&) const override { return true; }
  [[nodiscard]] bool is_candidate(const Submap& first, const Submap& second) const override {
    if (first.id.chain == second.id.chain && second.id.index - first.id.index < 3) return false;
    const auto [a, b] = middles(first, second);
    return (true_pose(a.chain.robot, a.index).translation - true_pose(b.chain.robot, b.index).translation).norm() < 4.0;
  }
  [[nodiscard]] Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                              const PayloadStore&) const override {
    const auto [a, b] = middles(first, second);
    const std::uint64_t key = (std::uint64_t{first.id.chain.robot.value} << 48U) ^
                              (std::uint64_t{first.id.index} << 32U) ^
                              (std::uint64_t{second.id.chain.robot.value} << 16U) ^ second.id.index ^
                              (3 * first.id.chain.session + second.id.chain.session) << 40U;
    Rng rng = Rng(seed_).fork(key);
    Pose3 T = retract(true_pose(a.chain.robot, a.index).inverse() * true_pose(b.chain.robot, b.index),
                      draw(rng, 0.02, 0.005));
    if (wrong_every_ > 0 && rng.index(wrong_every_) == 0)
      T.translation += Eigen::Vector3d(rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1)).normalized() * 3.0;
    return ClosureVerdict{{first.id, second.id}, {{a, b, {T, diagonal_covariance(0.02, 0.005)}}}, {}, id()};
  }
  static bool is_wrong(const LoopClosure& closure) {
    const Pose3 truth = true_pose(closure.from.chain.robot, closure.from.index).inverse() *
                        true_pose(closure.to.chain.robot, closure.to.index);
    return local(truth, closure.measurement.T_a_b).head<3>().norm() > 0.5;
  }

 private:
  static std::pair<KeyframeId, KeyframeId> middles(const Submap& first, const Submap& second) {
    const auto middle = [](const Submap& s) {
      return KeyframeId{s.id.chain, s.keyframes[s.keyframes.size() / 2].index};
    };
    return {middle(first), middle(second)};
  }
  std::uint64_t seed_;
  std::uint32_t wrong_every_;
  std::uint32_t version_;
};

/// A verifier that describes places: where on the circle they are. The nearer, the more alike.
class RankingVerifier final : public WrappedVerifier {
 public:
  explicit RankingVerifier(std::shared_ptr<const ClosureVerifier> verifier) : WrappedVerifier(std::move(verifier)) {}
  [[nodiscard]] std::string place_of(const Submap& submap) const override {
    const Keyframe& middle = submap.keyframes[submap.keyframes.size() / 2];
    const Eigen::Vector3d at = true_pose(submap.id.chain.robot, middle.index).translation;
    return fmt::format("{:.6f} {:.6f}", at.x(), at.y());
  }
  [[nodiscard]] bool can_rank(std::string_view place) const override { return place.find(' ') != place.npos; }
  [[nodiscard]] std::vector<Likeness> likeness(std::string_view place,
                                               std::span<const std::string_view> others) const override {
    std::vector<Likeness> out;
    for (std::size_t i = 0; i < others.size(); ++i)
      out.push_back({.other = i, .value = -(at(place) - at(others[i])).norm()});
    return out;
  }

 private:
  static Eigen::Vector2d at(std::string_view place) {
    std::istringstream in{std::string(place)};
    Eigen::Vector2d out;
    in >> out.x() >> out.y();
    return out;
  }
};

}  // namespace tutti::server::test
