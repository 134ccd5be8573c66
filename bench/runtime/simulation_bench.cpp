// SPDX-License-Identifier: BSD-3-Clause
// How long a world takes to build and how many rays per second one core casts into it. The world is the tunnel
// mission's size: 4 x 5 junctions 30 m apart.
#include <benchmark/benchmark.h>

#include <memory>
#include <vector>

#include "tutti/simulation/bvh.hpp"
#include "tutti/simulation/lidar.hpp"
#include "tutti/simulation/surface.hpp"
#include "tutti/simulation/trajectory.hpp"
#include "tutti/simulation/world.hpp"

namespace tutti::simulation {
namespace {

CorridorWorld tunnel() {
  WorldConfig config;
  config.network.block_m = 30.0;
  return make_world(config, Rng(1));
}

struct Scene {
  CorridorWorld world = tunnel();
  TriangleMesh mesh = world_surface(world, {}, Rng(2));
  std::shared_ptr<const Bvh> bvh = std::make_shared<const Bvh>(mesh);
};

const Scene& scene() {
  static const Scene scene;
  return scene;
}

void BM_Surface(benchmark::State& state) {
  double length = 0.0;
  for (const Corridor& corridor : scene().world.corridors) length += corridor.length_m;
  for (auto _ : state) benchmark::DoNotOptimize(world_surface(scene().world, {}, Rng(2)));
  state.counters["corridors_m"] = length;
  state.counters["triangles"] = static_cast<double>(scene().mesh.triangles.size());
}
BENCHMARK(BM_Surface)->Unit(benchmark::kMillisecond);

void BM_BvhBuild(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(Bvh(scene().mesh));
}
BENCHMARK(BM_BvhBuild)->Unit(benchmark::kMillisecond);

/// From random places on the corridors into random directions.
void BM_IncoherentRays(benchmark::State& state) {
  Rng rng(3);
  struct Ray {
    Eigen::Vector3f origin, direction;
  };
  std::vector<Ray> rays;
  for (int i = 0; i < 100000; ++i) {
    const Corridor& corridor = scene().world.corridors[rng.index(scene().world.corridors.size())];
    const Eigen::Vector3d& a = scene().world.junctions[corridor.a];
    const Eigen::Vector3d& b = scene().world.junctions[corridor.b];
    const Eigen::Vector3d direction(rng.normal(), rng.normal(), rng.normal());
    rays.push_back({(a + rng.uniform(0.0, 1.0) * (b - a)).cast<float>(), direction.normalized().cast<float>()});
  }
  std::size_t hits = 0, cast = 0;
  for (auto _ : state)
    for (const Ray& ray : rays) {
      hits += scene().bvh->cast(ray.origin, ray.direction, 60.0F).has_value();
      ++cast;
    }
  state.counters["rays"] = benchmark::Counter(static_cast<double>(cast), benchmark::Counter::kIsRate);
  state.counters["hit_share"] = static_cast<double>(hits) / static_cast<double>(cast);
}
BENCHMARK(BM_IncoherentRays)->Unit(benchmark::kMillisecond);

/// Whole sweeps of a walking robot: rays, poses and noise.
void BM_Sweep(benchmark::State& state) {
  WalkConfig walk;
  walk.duration_s = 300.0;
  const LidarConfig config;
  const SimulatedLidar lidar(scene().bvh, simulate_walk(scene().world, walk, {}, 0, Rng(4)), config, Rng(5));
  std::size_t sample = 1, points = 0;
  for (auto _ : state) {
    points += (*lidar.scan(sample))->cloud->points.size();
    sample = 1 + (sample + 97) % 2000;
  }
  const double rays = 360.0 / config.azimuth_step_deg * config.beams;
  const auto sweeps = static_cast<double>(state.iterations());
  state.counters["rays"] = benchmark::Counter(sweeps * rays, benchmark::Counter::kIsRate);
  state.counters["points_per_ray"] = static_cast<double>(points) / sweeps / rays;
}
BENCHMARK(BM_Sweep)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace tutti::simulation

BENCHMARK_MAIN();
