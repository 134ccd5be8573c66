// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/range_factors.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tutti/base/chi_square.hpp"
#include "tutti/base/random.hpp"
#include "tutti/estimation/range_factor.hpp"
#include "tutti/geometry/alignment.hpp"

namespace tutti::server {
namespace range_factors_test {

constexpr int kSeconds = 240, kPerSubmap = 10;

/// How ranges are wrong.
struct Radio {
  double sigma_m = 0.1, wrong_share = 0.0, clock_offset_s = 0.0, bias_m = 0.0;
  int of_robot = -1;      ///< Whose radio has the offset and the bias; -1: all.
  RobotId to_of_all{99};  ///< Whom ranges are said to be to; 99: to whom they are.
};

/// Three robots that go round circles beside each other. Closures tie them at the beginning.
struct World {
  static constexpr int kRobots = 3;
  SubmapSet submaps;
  VerdictSet verdicts;
  std::map<ChainId, Trajectory> truth;
  Eigen::Vector3d antenna{0.2, -0.1, 0.5};

  static Pose3 place(int robot, double t) {
    const double radius = 8.0 + 4.0 * robot, angle = 0.6 * t / radius + 2.0 * robot;
    return {Eigen::Quaterniond(Eigen::AngleAxisd(angle + std::numbers::pi / 2, Eigen::Vector3d::UnitZ())),
            {radius * std::cos(angle) + 9.0 * robot, radius * std::sin(angle), 0.3 * robot * std::sin(0.05 * t)}};
  }

  World(double drift, const Radio& radio, std::uint64_t seed) {
    Rng rng(seed);
    for (int r = 0; r < kRobots; ++r) add(r, drift, rng.fork(static_cast<std::uint64_t>(r)));
    for (int r = 0; r < kRobots; ++r) range(r, radio, rng.fork(100U + static_cast<std::uint64_t>(r)));
    for (int r = 1; r < kRobots; ++r) close(r);
  }

  void add(int r, double drift, Rng rng) {
    const ChainId chain{RobotId{static_cast<std::uint32_t>(r)}};
    Matrix6d covariance = Matrix6d::Identity();
    covariance.topLeftCorner<3, 3>() *= std::pow(0.02 * drift + 1e-3, 2);
    covariance.bottomRightCorner<3, 3>() *= std::pow(0.01 * drift + 1e-4, 2);
    Trajectory odometry;
    for (int k = 0; k <= kSeconds; ++k) {
      truth[chain].push_back({Timestamp{0} + static_cast<double>(k), place(r, k)});
      if (k == 0) {
        odometry.push_back({truth[chain][0].stamp, Pose3{}});
        continue;
      }
      Vector6d error;
      for (int i = 0; i < 6; ++i) error(i) = drift * rng.normal(i < 3 ? 0.02 : 0.01);
      odometry.push_back(
          {truth[chain].back().stamp, retract(odometry.back().pose * place(r, k - 1).inverse() * place(r, k), error)});
    }
    for (int first = 0; first < kSeconds; first += kPerSubmap) {
      auto submap = std::make_shared<Submap>();
      submap->id = {chain, static_cast<std::uint32_t>(first / kPerSubmap)};
      for (int k = first; k <= first + kPerSubmap; ++k) {
        const auto i = static_cast<std::size_t>(k);
        submap->keyframes.push_back({static_cast<std::uint32_t>(k), odometry[i].stamp, odometry[i].pose, true});
        if (k > first) submap->odometry.push_back({odometry[i - 1].pose.inverse() * odometry[i].pose, covariance});
      }
      submaps[submap->id] = submap;
    }
  }

  /// Every second, between keyframes, to the other robots in turn.
  void range(int r, const Radio& radio, Rng rng) {
    const ChainId chain{RobotId{static_cast<std::uint32_t>(r)}};
    const bool is_off = radio.of_robot < 0 || radio.of_robot == r;
    const double clock_offset_s = is_off ? radio.clock_offset_s : 0.0, bias_m = is_off ? radio.bias_m : 0.0;
    for (auto& [id, submap] : submaps) {
      if (id.chain != chain) continue;
      auto with = std::make_shared<Submap>(*submap);
      for (int k = 0; k < kPerSubmap; ++k) {
        const double t = static_cast<double>(id.index) * kPerSubmap + k + 0.5;
        const int other = (r + 1 + k % (kRobots - 1)) % kRobots;
        const double apart = (between(r, t) * antenna - between(other, t) * antenna).norm();
        const double error = rng.normal(radio.sigma_m) + (rng.bernoulli(radio.wrong_share) ? 5.0 : 0.0) + bias_m;
        const RobotId to{static_cast<std::uint32_t>(other)};
        with->ranges.push_back({.stamp = Timestamp{0} + (t + clock_offset_s),
                                .to = radio.to_of_all == RobotId{99} ? to : radio.to_of_all,
                                .distance_m = std::max(0.0, apart + error),
                                .sigma_m = std::max(radio.sigma_m, 0.01),
                                .p_body_antenna = antenna,
                                .name = {}});
      }
      submap = with;
    }
  }
  /// As straight as odometry between two keyframes is taken to be.
  static Pose3 between(int r, double t) {
    return interpolate(place(r, std::floor(t)), place(r, std::ceil(t)), t - std::floor(t));
  }

  /// The robot's first submap with that of robot 0.
  void close(int r) {
    const SubmapPair pair{{RobotId{0}, 0}, {RobotId{static_cast<std::uint32_t>(r)}, 0}};
    ClosureVerdict verdict{.pair = pair};
    for (const int k : {0, 3, 6, 9}) {
      const auto index = static_cast<std::uint32_t>(k);
      verdict.closures.push_back({.from = {pair.first.chain, index},
                                  .to = {pair.second.chain, index},
                                  .measurement = {place(0, k).inverse() * place(r, k), Matrix6d::Identity() * 1e-4}});
    }
    verdicts[pair] = verdict;
  }

  [[nodiscard]] MapEstimate without() const { return estimate_map(submaps, verdicts, {}); }
  [[nodiscard]] MapEstimate with() const { return with_ranges(without(), submaps, {}); }
  [[nodiscard]] double rmse(const MapEstimate& map) const {
    std::vector<Eigen::Vector3d> expected, estimate;
    for (const MapNode& node : map.nodes) {
      expected.push_back(truth.at(node.id.chain)[node.id.index].pose.translation);
      estimate.push_back(node.T_world_body.translation);
    }
    const Pose3 T = align_points(expected, estimate);
    double sum = 0.0;
    for (std::size_t i = 0; i < expected.size(); ++i) sum += (expected[i] - T * estimate[i]).squaredNorm();
    return std::sqrt(sum / static_cast<double>(expected.size()));
  }
};

std::size_t used(const MapEstimate& map) {
  std::size_t out = 0;
  for (const JudgedRanges& judged : map.ranges.judged) out += judged.used;
  return out;
}

std::size_t all(const MapEstimate& map) {
  std::size_t out = 0;
  for (const JudgedRanges& judged : map.ranges.judged) out += judged.ranges;
  return out;
}

bool is_refused(const JudgedRanges& judged) { return judged.objection != RangeObjection::none && judged.used == 0; }

bool is_same(const MapEstimate& a, const MapEstimate& b) {
  return std::ranges::equal(a.nodes, b.nodes, {}, &MapNode::T_world_body, &MapNode::T_world_body) &&
         a.graph.edges.size() == b.graph.edges.size();
}

TEST(RangeFactors, WithoutErrorsTheyKeepTheTruth) {
  const World world(0.0, {.sigma_m = 0.0}, 1);
  const MapEstimate map = world.with();
  EXPECT_EQ(map.components, 1U);
  EXPECT_EQ(used(map), all(map));
  EXPECT_EQ(all(map), std::size_t{3} * kSeconds);
  EXPECT_EQ(map.ranges.edges, used(map));
  EXPECT_LT(world.rmse(map), 1e-3);
}

TEST(RangeFactors, TakeDriftAwayThatNoClosureDoes) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const World world(1.0, {}, seed);
    const double without = world.rmse(world.without()), with = world.rmse(world.with());
    EXPECT_LT(with, 0.75 * without) << "seed " << seed << ": " << without << " m before";
  }
}

/// The ranges that count miss the map by as much as they state.
TEST(RangeFactors, MissByWhatTheyState) {
  const World world(1.0, {}, 4);
  const MapEstimate map = world.with();
  double sum = 0.0;
  for (std::size_t e = map.graph.edges.size() - map.ranges.edges; e < map.graph.edges.size(); ++e) {
    const PoseGraphEdge& edge = map.graph.edges[e];
    const Vector6d r = local(edge.T_from_to, map.graph.poses[edge.from].inverse() * map.graph.poses[edge.to]);
    sum += r.dot(edge.information * r);
  }
  const auto count = static_cast<double>(map.ranges.edges);
  EXPECT_GT(sum, 0.5 * count);  // what the map follows of their noise
  EXPECT_LT(sum, chi_square_quantile(0.999, count));
}

TEST(RangeFactors, OneInFiveTooLongDoesNoHarm) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const World right(1.0, {}, seed), wrong(1.0, {.wrong_share = 0.2}, seed);
    const MapEstimate map = wrong.with();
    EXPECT_LT(wrong.rmse(map), 1.1 * wrong.rmse(wrong.without()));
    EXPECT_LT(wrong.rmse(map), 1.5 * right.rmse(right.with()));
    EXPECT_LT(static_cast<double>(used(map)), 0.85 * static_cast<double>(all(map)));
    EXPECT_GT(static_cast<double>(used(map)), 0.7 * static_cast<double>(all(map)));
  }
}

/// The map is as good as without.
MapEstimate expect_no_harm(const World& world, std::uint64_t seed) {
  MapEstimate map = world.with();
  EXPECT_LT(world.rmse(map), 1.05 * world.rmse(world.without())) << "seed " << seed;
  return map;
}

/// Everybody's clock, which a drifting map can follow.
TEST(RangeFactors, ClocksThatAreOffDoNoHarm) {
  for (const std::uint64_t seed : {1U, 2U, 3U})
    for (const double offset_s : {20.0, 2.0, -2.0}) {
      expect_no_harm({1.0, {.clock_offset_s = offset_s}, seed}, seed);
      const MapEstimate map = expect_no_harm({0.2, {.clock_offset_s = offset_s}, seed}, seed);
      EXPECT_TRUE(std::ranges::all_of(map.ranges.judged, &is_refused)) << "seed " << seed << ", " << offset_s << " s";
    }
}

TEST(RangeFactors, LengthsThatAreOffDoNoHarm) {
  for (const std::uint64_t seed : {1U, 2U, 3U})
    for (const double drift : {0.2, 1.0}) {
      const MapEstimate map = expect_no_harm({drift, {.bias_m = 2.0}, seed}, seed);
      EXPECT_TRUE(std::ranges::all_of(map.ranges.judged, &is_refused)) << "seed " << seed << ", drift " << drift;
    }
}

/// The others' ranges make the map better all the same.
TEST(RangeFactors, OneRobotWithAWrongRadioIsLeftOut) {
  for (const std::uint64_t seed : {1U, 2U, 3U})
    for (const Radio& radio : {Radio{.clock_offset_s = 2.0, .of_robot = 1}, Radio{.bias_m = 2.0, .of_robot = 1}}) {
      const World world(0.2, radio, seed);
      const MapEstimate map = expect_no_harm(world, seed);
      EXPECT_LT(world.rmse(map), 0.85 * world.rmse(world.without())) << "seed " << seed;
      for (const JudgedRanges& judged : map.ranges.judged)
        EXPECT_EQ(is_refused(judged), judged.from.robot == RobotId{1}) << "seed " << seed << ": " << why_none(judged);
      const auto of_it = std::ranges::find(map.ranges.judged, RobotId{1}, [](const auto& of) { return of.from.robot; });
      const bool is_late = radio.clock_offset_s > 0.0;
      EXPECT_EQ(of_it->objection, is_late ? RangeObjection::clock : RangeObjection::map);
      EXPECT_NEAR(of_it->clock_off_s, is_late ? -2.0 : 0.0, 1.0) << "to first order";
      expect_no_harm({1.0, radio, seed}, seed);
    }
}

/// As many as a hostile robot likes, to whomever: they cost little and do nothing.
TEST(RangeFactors, AFloodOfRangesDoesNothing) {
  World world(0.2, {}, 1);
  const MapEstimate before = world.with();
  auto flooded = std::make_shared<Submap>(*world.submaps.rbegin()->second);
  for (std::uint32_t k = 0; k < 1000; ++k) {
    RobotRange range = flooded->ranges.front();
    range.to = RobotId{k % 2 == 0 ? 1000 + k : 0};
    range.stamp = flooded->keyframes.front().stamp + 0.001 * k;
    range.distance_m = 1e5;
    flooded->ranges.push_back(range);
  }
  world.submaps.rbegin()->second = flooded;
  const MapEstimate map = world.with();
  EXPECT_LT(world.rmse(map), 1.05 * world.rmse(before));
  EXPECT_LT(map.graph.edges.size(), before.graph.edges.size() + 20);
}

TEST(RangeFactors, ToARobotThatTheMapDoesNotHaveChangeNothing) {
  const World world(1.0, {.to_of_all = RobotId{7}}, 1);
  const MapEstimate map = world.with();
  EXPECT_TRUE(is_same(map, world.without()));
  for (const JudgedRanges& judged : map.ranges.judged) EXPECT_EQ(judged.unplaced, judged.ranges);
}

/// Ranges alone do not say how two maps lie to each other.
TEST(RangeFactors, DoNotJoinComponents) {
  World world(1.0, {}, 1);
  world.verdicts.clear();
  const MapEstimate map = world.with();
  EXPECT_EQ(map.components, 3U);
  EXPECT_EQ(map.ranges.edges, 0U);
  EXPECT_TRUE(is_same(map, world.without()));
}

}  // namespace range_factors_test
}  // namespace tutti::server
