// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "tutti/evaluation/agreement.hpp"
#include "tutti/evaluation/ate.hpp"
#include "tutti/evaluation/cloud_distance.hpp"
#include "tutti/mission/evaluate.hpp"
#include "tutti/perception/lidar/voxel_filter.hpp"

namespace tutti::mission {
namespace {

/// Equal voxels: every square metre of a wall counts the same, no matter how often it was seen.
constexpr double kMapVoxel_m = 0.1;
/// Landmarks known worse along the viewing ray are no picture of the place.
constexpr float kMaxLandmarkSigma_m = 0.1F;

void append_moved(const Pose3& T_a_b, const PointCloud& cloud_b, PointCloud& cloud_a) {
  const Eigen::Isometry3d T(T_a_b.matrix());
  for (const Eigen::Vector3f& p : cloud_b.points) cloud_a.points.push_back((T * p.cast<double>()).cast<float>());
}

/// Grows by whole clouds; thins itself now and then, so that a long mission's map stays small in memory.
class ThinnedCloud {
 public:
  void add(const PointCloud& cloud_b, const Pose3& T_a_b) {
    append_moved(T_a_b, cloud_b, cloud_);
    if (cloud_.points.size() < thin_at_) return;
    cloud_ = lidar::voxel_downsample(cloud_, kMapVoxel_m);
    thin_at_ = 2 * cloud_.points.size() + kAtLeast;
  }
  [[nodiscard]] PointCloud thinned() const { return lidar::voxel_downsample(cloud_, kMapVoxel_m); }

 private:
  static constexpr std::size_t kAtLeast = 1'000'000;
  PointCloud cloud_;
  std::size_t thin_at_ = kAtLeast;
};

/// One robot's submaps, put together by each of its estimates.
struct RobotMaps {
  ThinnedCloud onboard;    ///< T_odom
  ThinnedCloud corrected;  ///< T_map
  ThinnedCloud server;     ///< T_world
};

/// Where an estimate puts a submap: it hangs on the keyframe in its middle, as its closures do.
std::optional<Pose3> place(const Submap& submap, const Trajectory& estimate) {
  const Keyframe& first = submap.keyframes.front();
  const Keyframe& middle = submap.keyframes[submap.keyframes.size() / 2];
  const auto found = std::lower_bound(estimate.begin(), estimate.end(), middle.stamp,
                                      [](const StampedPose& p, Timestamp t) { return p.stamp < t; });
  if (found == estimate.end() || found->stamp != middle.stamp) return std::nullopt;
  return found->pose * middle.T_odom_body.inverse() * first.T_odom_body;
}

std::shared_ptr<const PointCloud> landmarks_of(const VisualPayload& payload) {
  auto out = std::make_shared<PointCloud>();
  for (const Landmark& landmark : payload.landmarks)
    if (landmark.sigma_m <= kMaxLandmarkSigma_m) out->points.push_back(landmark.position);
  return out;
}

/// A submap's points, in its own frame: its cloud, or else the landmarks of its images. The only place that knows where
/// payloads lie. Null when it saw nothing.
std::shared_ptr<const PointCloud> cloud_of(const server::MapServer& server, SubmapId id, MissionRecord& record) {
  const auto size = server.state().payload_sizes.find(id);
  if (size == server.state().payload_sizes.end()) return nullptr;
  if (size->second.points == 0 && size->second.observations == 0) return nullptr;
  auto cloud = size->second.points > 0
                   ? server.payloads().cloud(id)
                   : server.payloads().visual(id).map([](const auto& seen) { return landmarks_of(*seen); });
  if (cloud) return *cloud;
  record.notes.push_back("Missing in the map: " + cloud.error().message + ".");
  return nullptr;
}

RobotMaps put_together(const server::MapServer& server, const RobotRecord& robot, MissionRecord& record) {
  const PolicyRecord* policy = find_policy(robot, record.default_policy);
  const bool want_corrected = record.survey && policy != nullptr;  // it is only measured
  RobotMaps out;
  for (const auto& [id, submap] : server.state().submaps) {
    if (id.chain.robot != robot.id) continue;
    const auto cloud = cloud_of(server, id, record);
    if (!cloud) continue;
    const auto add = [&](ThinnedCloud& map, const Trajectory& estimate) {
      if (const auto T = place(*submap, estimate)) map.add(*cloud, *T);
    };
    add(out.onboard, robot.odometry);
    if (want_corrected) add(out.corrected, policy->corrected);
    add(out.server, robot.server_estimate);
  }
  return out;
}

/// The rigid motion that ATE measures after; nothing without a reference.
std::optional<Pose3> reference_from(const Trajectory& estimate, const RobotRecord& robot,
                                    const evaluation::AssociationConfig& association) {
  const auto fit = evaluation::ate(evaluation::associate(estimate, robot.reference, association));
  return fit ? std::optional<Pose3>(fit->T_reference_estimate) : std::nullopt;
}

void keep_onboard(const ThinnedCloud& map, const evaluation::CloudIndex* survey,
                  const evaluation::AssociationConfig& association, RobotRecord& robot) {
  const auto T_reference_odom = reference_from(robot.odometry, robot, association);
  Pose3 T_shown_odom = T_reference_odom.value_or(Pose3{});
  if (!T_reference_odom)
    if (const auto fit = evaluation::agreement(robot.odometry, robot.server_estimate))
      T_shown_odom = fit->T_reference_estimate;
  append_moved(T_shown_odom, map.thinned(), robot.onboard_cloud);
  if (survey != nullptr && T_reference_odom)
    robot.map_error.onboard = evaluation::summarise(survey->distances(robot.onboard_cloud));
}

void measure_corrected(const ThinnedCloud& map, const evaluation::CloudIndex& survey, const PolicyRecord* policy,
                       const evaluation::AssociationConfig& association, RobotRecord& robot) {
  if (policy == nullptr) return;
  const auto T_reference_map = reference_from(policy->corrected, robot, association);
  if (T_reference_map)
    robot.map_error.corrected = evaluation::summarise(survey.distances(map.thinned(), *T_reference_map));
}

/// Walls that bend where a robot turned are not the map's error, but that of the odometry within a submap.
void note_landmarks(const server::MapServer& server, MissionRecord& record) {
  std::string names;
  for (const RobotRecord& robot : record.robots) {
    PayloadSize seen;
    for (const auto& [id, size] : server.state().payload_sizes)
      if (id.chain.robot == robot.id) seen = {seen.points + size.points, seen.observations + size.observations};
    if (seen.points == 0 && seen.observations > 0) names += (names.empty() ? "" : ", ") + robot.name;
  }
  if (!names.empty())
    record.notes.push_back(names +
                           ": what it saw is shown by its landmarks, each triangulated within one submap by "
                           "odometry. The server moves the keyframes that they hang on, not them: distances "
                           "to the survey are those of the odometry's landmarks.");
}

/// The joint map of the largest component against the survey, and vice versa.
void measure_joint_cloud(const evaluation::CloudIndex& survey, MissionRecord& record) {
  ServerRecord& server = record.server;
  if (!server.T_reference_world) return;
  PointCloud joint;
  for (CloudRecord& seen : server.clouds) {
    const auto robot = std::find_if(record.robots.begin(), record.robots.end(),
                                    [&](const RobotRecord& r) { return r.id == seen.robot; });
    if (robot == record.robots.end() || robot->component != server.largest_component) continue;
    seen.distance_m = survey.distances(seen.cloud, *server.T_reference_world);
    joint.points.insert(joint.points.end(), seen.cloud.points.begin(), seen.cloud.points.end());
  }
  joint = lidar::voxel_downsample(joint, kMapVoxel_m);  // what several robots saw counts once
  server.map_error = evaluation::summarise(survey.distances(joint, *server.T_reference_world));
  const auto back = evaluation::summarise(
      evaluation::CloudIndex(joint).distances(*record.survey, server.T_reference_world->inverse()));
  if (back) server.survey_covered = back->within_30cm;
}

}  // namespace

void evaluate_map(const server::MapServer& server, const evaluation::AssociationConfig& association,
                  MissionRecord& record) {
  std::unique_ptr<const evaluation::CloudIndex> survey;
  if (record.survey) survey = std::make_unique<const evaluation::CloudIndex>(*record.survey);
  for (RobotRecord& robot : record.robots) {
    const RobotMaps maps = put_together(server, robot, record);
    keep_onboard(maps.onboard, survey.get(), association, robot);
    if (survey)
      measure_corrected(maps.corrected, *survey, find_policy(robot, record.default_policy), association, robot);
    CloudRecord seen{.robot = robot.id, .cloud = maps.server.thinned()};
    if (!seen.cloud.points.empty()) record.server.clouds.push_back(std::move(seen));
  }
  if (survey) measure_joint_cloud(*survey, record);
  note_landmarks(server, record);
}

}  // namespace tutti::mission
