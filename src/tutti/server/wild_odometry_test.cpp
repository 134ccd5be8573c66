// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>

#include "support/sanitized.hpp"
#include "support/server/world.hpp"
#include "tutti/geometry/covariance.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/server/graph_monitor.hpp"

/// One robot's odometry and covariances are anything that a message may carry; the others must not feel it.
namespace tutti::server {
namespace wild_odometry_test {

double any_magnitude(Rng& rng, double least, double most) {
  return std::exp(rng.uniform(std::log(least), std::log(most)));
}

/// Has any size and correlation, and is not always of full rank.
Matrix6d any_covariance(Rng& rng) {
  const auto columns = static_cast<Eigen::Index>(1 + rng.index(6));
  Eigen::Matrix<double, 6, Eigen::Dynamic> root(6, columns);
  const double size = any_magnitude(rng, 1e-9, 1e9);
  for (double& x : root.reshaped()) x = size * any_magnitude(rng, 1e-4, 1.0) * rng.normal();
  const Matrix6d covariance = root * root.transpose();
  return 0.5 * (covariance + covariance.transpose());
}

/// Submaps whose poses follow from their wild steps.
void make_wild(std::vector<Submap>& submaps, Rng rng) {
  Pose3 T_odom_body = submaps.front().keyframes.front().T_odom_body;
  for (Submap& submap : submaps) {
    const auto kind = rng.index(4);
    for (RelativePose& step : submap.odometry) {
      if (kind == 0 || kind == 1) step.covariance = any_covariance(rng);
      if (kind == 1 || kind == 2)
        step.T_a_b = retract({}, test::draw(rng, any_magnitude(rng, 1e-3, 1e4), any_magnitude(rng, 1e-3, 1.0)));
    }
    submap.keyframes.front().T_odom_body = T_odom_body;
    for (std::size_t k = 0; k < submap.odometry.size(); ++k)
      submap.keyframes[k + 1].T_odom_body = T_odom_body = T_odom_body * submap.odometry[k].T_a_b;
  }
}

struct World {
  SubmapSet submaps;
  VerdictSet verdicts;
};

/// Three robots, the last one's odometry wild.
World wild_world(std::uint64_t seed) {
  const test::TestVerifier verifier(1);
  World out;
  for (std::uint32_t r = 0; r < 3; ++r) {
    auto made = test::make_submaps(RobotId{r}, {.keyframes = 71}, Rng(seed).fork(r));
    if (r == 2) make_wild(made, Rng(seed).fork(9));
    for (Submap& submap : made) out.submaps[submap.id] = std::make_shared<const Submap>(std::move(submap));
  }
  for (auto a = out.submaps.begin(); a != out.submaps.end(); ++a)
    for (auto b = std::next(a); b != out.submaps.end(); ++b)
      if (verifier.is_candidate(*a->second, *b->second))
        out.verdicts[{a->first, b->first}] = *verifier.verify(*a->second, *b->second, MemoryPayloadStore());
  return out;
}

std::size_t closures_between_good_robots(const MapEstimate& map) {
  return static_cast<std::size_t>(std::ranges::count_if(map.closures, [](const JudgedClosure& c) {
    return c.accepted && std::max(c.closure.from.chain.robot, c.closure.to.chain.robot) < RobotId{2};
  }));
}

TEST(WildOdometry, OfOneRobotHarmsNoOther) {
  const std::size_t kSeeds = tutti::seeds<std::size_t>(100);
  std::size_t informed = 0;
  std::size_t kept = 0;
  std::size_t without_it = 0;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    World world = wild_world(seed);
    const MapEstimate map = estimate_map(world.submaps, world.verdicts, {});
    EXPECT_TRUE(map.converged) << seed;
    const ProxyGraph graph = monitor_graph(map, 1, {});
    informed += std::ranges::count(graph.nodes, ChainId(RobotId{0}), &ProxyNode::chain) > 30 &&
                std::ranges::count(graph.nodes, ChainId(RobotId{1}), &ProxyNode::chain) > 30;
    EXPECT_TRUE(std::ranges::all_of(graph.nodes, [](const ProxyNode& node) {
      return check_covariance(node.covariance).has_value();
    })) << seed;
    kept += closures_between_good_robots(map);
    std::erase_if(world.submaps, [](const auto& entry) { return entry.first.chain.robot == RobotId{2}; });
    without_it += closures_between_good_robots(estimate_map(world.submaps, world.verdicts, {}));
  }
  EXPECT_GT(without_it, 9 * kSeeds);
  // The other maps are solved, but too ill-conditioned for a covariance.
  EXPECT_GE(informed, kSeeds * 95 / 100);
  EXPECT_GE(kept, without_it * 95 / 100);
}

}  // namespace wild_odometry_test
}  // namespace tutti::server
