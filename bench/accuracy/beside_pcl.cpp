// SPDX-License-Identifier: BSD-3-Clause
// PCL's NDT or GICP in the place of a robot's node, on the runs of tutti run --frozen: docs/results/localise.md.
//
// The robot begins at its true pose. Odometry carries the last pose to the next scan, the registration of the scan on
// the map's whole cloud begins there, and what it says is published when it has converged and fits. Both are set up as
// lidar_localization_ros2 does by default, which calls these classes of PCL; it would guess from the last two poses,
// where odometry is better. Points nearer than Tutti's limit are dropped, and sweeps undistorted, as Tutti does.
#include <fmt/format.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/point_types.h>
#include <pcl/registration/gicp.h>
#include <pcl/registration/ndt.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tutti/drive/stopwatch.hpp"
#include "tutti/lab/mission_input.hpp"
#include "tutti/mapfile/export.hpp"
#include "tutti/mission/localise_mission.hpp"
#include "tutti/mission/report/localise.hpp"
#include "tutti/model/pose_at.hpp"
#include "tutti/perception/lidar/undistort.hpp"

namespace {

using namespace tutti;
using Points = pcl::PointCloud<pcl::PointXYZ>;
using Registration = pcl::Registration<pcl::PointXYZ, pcl::PointXYZ>;

constexpr float kLeaf_m = 0.2F;
constexpr double kMostFitness_m2 = 2.0;  // mean squared distance of the scan's points to the map's nearest
constexpr double kEpsilon = 0.01;
constexpr int kMostIterations = 35;
constexpr float kResolution_m = 1.0F;      // NDT's
constexpr double kStep_m = 0.1;            // NDT's
constexpr double kCorrespondence_m = 2.0;  // GICP's
constexpr int kNeighbours = 20;            // GICP's, of which a point's covariance is

Points::Ptr to_pcl(const PointCloud& cloud, double min_range_m = 0.0,
                   double max_range_m = std::numeric_limits<double>::infinity()) {
  auto out = std::make_shared<Points>();
  for (const Eigen::Vector3f& p : cloud.points) {
    const auto range_m = static_cast<double>(p.norm());
    if (p.allFinite() && range_m >= min_range_m && range_m <= max_range_m) out->emplace_back(p.x(), p.y(), p.z());
  }
  return out;
}

Points::Ptr thinned(const Points::Ptr& cloud) {
  auto out = std::make_shared<Points>();
  pcl::VoxelGrid<pcl::PointXYZ> grid;
  grid.setLeafSize(kLeaf_m, kLeaf_m, kLeaf_m);
  grid.setInputCloud(cloud);
  grid.filter(*out);
  return out;
}

Registration::Ptr make_registration(const std::string& method, const Points::Ptr& map) {
  Registration::Ptr out;
  if (method == "NDT") {
    auto ndt = std::make_shared<pcl::NormalDistributionsTransform<pcl::PointXYZ, pcl::PointXYZ>>();
    ndt->setResolution(kResolution_m);
    ndt->setStepSize(kStep_m);
    ndt->setInputTarget(map);
    out = ndt;
  } else {
    auto gicp = std::make_shared<pcl::GeneralizedIterativeClosestPoint<pcl::PointXYZ, pcl::PointXYZ>>();
    gicp->setCorrespondenceRandomness(kNeighbours);
    gicp->setMaxCorrespondenceDistance(kCorrespondence_m);
    gicp->setInputTarget(thinned(map));
    out = gicp;
  }
  out->setTransformationEpsilon(kEpsilon);
  out->setMaximumIterations(kMostIterations);
  return out;
}

struct Registered {
  Pose3 T_world_body;
  double fitness_m2 = 0.0;
  bool is_published = false;
};

Registered register_scan(Registration& registration, const Points::Ptr& scan, const Pose3& T_world_guess) {
  registration.setInputSource(thinned(scan));
  Points aligned;
  registration.align(aligned, T_world_guess.matrix().cast<float>());
  const Eigen::Matrix4d T = registration.getFinalTransformation().cast<double>();
  Registered out{.T_world_body = T_world_guess, .fitness_m2 = registration.getFitnessScore()};
  out.is_published = registration.hasConverged() && T.allFinite() && out.fitness_m2 <= kMostFitness_m2;
  if (!out.is_published) return out;
  const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
  out.T_world_body = {Eigen::Quaterniond(R).normalized(), T.topRightCorner<3, 1>()};
  return out;
}

/// Asked for are scans as a robot's node does, and with odometry of their time.
mission::LocalisedRobot follow(Registration& registration, const Recording& recording, const Pose3& T_world_start,
                               double every_s, const robot::SubmapConfig& ranges) {
  mission::LocalisedRobot out{.name = recording.name};
  Pose3 T_world_body = T_world_start;
  Pose3 T_odom_before = recording.odometry.front().pose;
  std::optional<Timestamp> before;
  for (std::size_t k = 0; const auto stamp = stamp_at(recording, recording.scan_stamps, k); ++k) {
    const auto T_odom_body = pose_at(recording.odometry, *stamp);
    if (!T_odom_body || (before && *stamp - *before < every_s)) continue;
    const auto scan = recording.scans->scan(k);
    if (!scan) out.troubles.push_back(scan.error().message);
    if (!scan || !*scan) continue;
    double cpu_s = 0.0;
    Registered registered;
    {
      const drive::CpuScope measured(cpu_s);
      const auto undistorted = lidar::undistort(**scan, recording.odometry);
      if (!undistorted) continue;
      registered = register_scan(registration, to_pcl(*undistorted->cloud, ranges.min_range_m, ranges.max_range_m),
                                 T_world_body * T_odom_before.inverse() * *T_odom_body);
    }
    T_world_body = registered.T_world_body;
    T_odom_before = *T_odom_body;
    before = *stamp;
    ++out.work.registered;
    out.cpu_s += cpu_s;
    out.scan_ms.push_back(1e3 * cpu_s);
    localise::Located located{.stamp = *stamp, .why = fmt::format("fitness {:.4f} m2", registered.fitness_m2)};
    located.state = registered.is_published ? localise::State::localised : localise::State::lost;
    if (registered.is_published) located.T_world_body = RelativePose{T_world_body, Matrix6d::Zero()};
    out.course.push_back(std::move(located));
  }
  out.duration_s = recording.odometry.back().stamp - recording.odometry.front().stamp;
  return out;
}

struct Options {
  std::string mission, map, data, method = "NDT", out;
  std::uint64_t seed = 1;
  mission::LocaliseTrial trial{.true_start = true};
};

Status run(const Options& options) {
  const auto config = lab::load_mission(options.mission, {});
  if (!config) return tl::unexpected(config.error());
  const auto map = mapfile::open_known_map(options.map);
  if (!map) return tl::unexpected(map.error());
  if (map->known->floors > 1) return fail(ErrorCode::invalid, "{}: several floors, expected one cloud", options.map);
  const auto input = lab::load_input(*config, options.data, options.seed);
  if (!input) return tl::unexpected(input.error());
  const auto store = mapfile::open_copy(options.map);
  if (!store) return tl::unexpected(store.error());
  const auto joint = mapfile::joint_cloud(**store, map->content, map->estimate);
  if (!joint) return tl::unexpected(joint.error());
  const auto registration = make_registration(options.method, to_pcl(joint->cloud));
  fmt::print("{}: {} points of the map\n", options.method, registration->getInputTarget()->size());
  const auto robots = mission::localise_mission(
      *config, *input, *map, options.trial,
      [&](const mission::MissionRecording& robot, const std::optional<StartPose>& start) {
        return follow(*registration, robot.recording, start.value().T_world_body.value().T_a_b,
                      config->localise.track_every_s, config->agent.submap);
      });
  if (!robots) return tl::unexpected(robots.error());
  return mission::write_localised(*robots, *map->known, options.out);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("PCL's NDT or GICP follows the robots of a mission in a map that others of them have made.");
  Options options;
  app.add_option("mission", options.mission, "A mission's file")->required();
  app.add_option("--map-in", options.map, "The map's file")->required();
  app.add_option("--method", options.method, "NDT or GICP")->check(CLI::IsMember({"NDT", "GICP"}));
  app.add_option("--data", options.data, "Folder of the recordings");
  app.add_option("--seed", options.seed, "The mission's seed");
  app.add_option("--kidnap-every", options.trial.kidnap_s, "As of tutti run");
  app.add_option("--out", options.out, "Folder for what tutti run --frozen writes")->required();
  CLI11_PARSE(app, argc, argv);
  if (const Status done = run(options); !done) {
    fmt::print(stderr, "tutti_beside_pcl: {}\n", done.error().message);
    return 1;
  }
  return 0;
}
