// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/lab/break_recording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <utility>

#include "tutti/geometry/so3.hpp"
#include "tutti/model/pose_at.hpp"

namespace tutti::lab {
namespace {

constexpr double kLate_s = 0.6;
constexpr double kFrozenFrom_s = 25.0, kFrozenFor_s = 5.0;
constexpr double kDrift_deg_per_m = 0.2;
constexpr double kScale = 0.05;
constexpr double kLidarAhead_m = 4.0, kLidarTurned_deg = 5.0;
constexpr double kBaseline = 0.04;

/// Changes a scan.
using ChangeScan = std::function<void(Scan&, std::vector<Eigen::Vector3f>& points)>;

/// Another source's scans, changed.
class ChangedScans final : public ScanSource {
 public:
  ChangedScans(std::shared_ptr<const ScanSource> inner, ChangeScan change)
      : inner_(std::move(inner)), change_(std::move(change)) {}
  [[nodiscard]] Result<std::optional<Scan>> scan(std::size_t sample) const override {
    auto scan = inner_->scan(sample);
    if (!scan || !*scan || !(*scan)->cloud) return scan;
    auto cloud = std::make_shared<PointCloud>(*(*scan)->cloud);
    change_(**scan, cloud->points);
    (*scan)->cloud = std::move(cloud);
    return scan;
  }

 private:
  std::shared_ptr<const ScanSource> inner_;
  ChangeScan change_;
};

void change_scans(Recording& recording, ChangeScan change) {
  if (recording.scans) recording.scans = std::make_shared<const ChangedScans>(recording.scans, std::move(change));
}

void change_points(Recording& recording, const std::function<Eigen::Vector3f(const Eigen::Vector3f&)>& change) {
  change_scans(recording, [change](Scan&, std::vector<Eigen::Vector3f>& points) {
    for (Eigen::Vector3f& p : points) p = change(p);
  });
}

void change_poses(Recording& recording, const std::function<Pose3(const Pose3&)>& change) {
  for (StampedPose& sample : recording.odometry) sample.pose = change(sample.pose);
}

void change_steps(Recording& recording, const std::function<Pose3(const Pose3&, Timestamp)>& change) {
  const Trajectory before = recording.odometry;
  for (std::size_t k = 1; k < before.size(); ++k)
    recording.odometry[k].pose =
        recording.odometry[k - 1].pose * change(before[k - 1].pose.inverse() * before[k].pose, before[k].stamp);
}

void send_scans_late(Recording& recording, double times) {
  const double late_s = times * kLate_s;
  if (recording.scan_stamps.empty())
    for (const StampedPose& sample : recording.odometry) recording.scan_stamps.push_back(sample.stamp);
  for (Timestamp& stamp : recording.scan_stamps) stamp = stamp + late_s;
  change_scans(recording, [late_s](Scan& scan, std::vector<Eigen::Vector3f>&) { scan.stamp = scan.stamp + late_s; });
}

void move_into_world(Recording& recording, double) {
  const auto odometry = std::make_shared<const Trajectory>(recording.odometry);
  change_scans(recording, [odometry](Scan& scan, std::vector<Eigen::Vector3f>& points) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double age_s = scan.age_s ? double{(*scan.age_s)[i]} : 0.0;
      if (const auto pose = pose_at(*odometry, scan.stamp - age_s))
        points[i] = (*pose * points[i].cast<double>()).cast<float>();
    }
    scan.age_s = nullptr;
  });
}

void freeze(Recording& recording, double times) {
  const Timestamp from = recording.odometry.front().stamp + kFrozenFrom_s;
  change_steps(recording, [from, until = from + times * kFrozenFor_s](const Pose3& step, Timestamp stamp) {
    return stamp > from && stamp <= until ? Pose3{} : step;
  });
}

/// The cameras as they are stated.
std::vector<Camera> stretched(std::vector<Camera> cameras, double ratio) {
  for (std::size_t i = 1; i < cameras.size(); ++i) {
    const Eigen::Vector3d& first = cameras.front().T_body_camera.translation;
    Eigen::Vector3d& p = cameras[i].T_body_camera.translation;
    p = first + ratio * (p - first);
  }
  return cameras;
}

/// Another source's images, by cameras that are stated otherwise.
class RestatedCameras final : public VisualSource {
 public:
  RestatedCameras(std::shared_ptr<VisualSource> inner, double ratio) : inner_(std::move(inner)), ratio_(ratio) {}
  [[nodiscard]] TrackedImages images(std::size_t sample, bool keyframe) override {
    TrackedImages out = inner_->images(sample, keyframe);
    if (!cameras_ && out.cameras)
      cameras_ = std::make_shared<const std::vector<Camera>>(stretched(*out.cameras, ratio_));
    if (out.cameras) out.cameras = cameras_;
    return out;
  }
  std::vector<Error> take_errors() override { return inner_->take_errors(); }

 private:
  std::shared_ptr<VisualSource> inner_;
  double ratio_;
  std::shared_ptr<const std::vector<Camera>> cameras_;
};

void stretch_baseline(Recording& recording, double times) {
  const double ratio = 1.0 + times * kBaseline;
  if (recording.visual) recording.visual = std::make_shared<RestatedCameras>(recording.visual, ratio);
  if (!recording.images) return;
  auto images = std::make_shared<ImageStream>(*recording.images);
  images->cameras = stretched(std::move(images->cameras), ratio);
  recording.images = std::move(images);
}

Pose3 turn(const Eigen::Vector3d& degrees) { return {so3_exp(degrees * kRadPerDeg), Eigen::Vector3d::Zero()}; }

}  // namespace

const std::vector<RobotMistake>& robot_mistakes() {
  static const std::vector<RobotMistake> mistakes{
      {"scans_late", "scans are stamped 0.6 s late", send_scans_late},
      {"lidar_ahead", "the LiDAR is stated 4 m ahead of where it is",
       [](Recording& r, double times) {
         const Eigen::Vector3f ahead(static_cast<float>(times * kLidarAhead_m), 0, 0);
         change_points(r, [ahead](const Eigen::Vector3f& p) -> Eigen::Vector3f { return p + ahead; });
       }},
      {"lidar_turned", "the LiDAR is stated turned by 5 degrees to the left of how it sits",
       [](Recording& r, double times) {
         const Eigen::Quaternionf R = turn({0, 0, times * kLidarTurned_deg}).rotation.cast<float>();
         change_points(r, [R](const Eigen::Vector3f& p) -> Eigen::Vector3f { return R * p; });
       }},
      {"lidar_head_down", "the LiDAR hangs head down and is stated upright",
       [](Recording& r, double) {
         change_points(r, [](const Eigen::Vector3f& p) -> Eigen::Vector3f { return {p.x(), -p.y(), -p.z()}; });
       }},
      {"mirrored", "the points' y has the wrong sign",
       [](Recording& r, double) {
         change_points(r, [](const Eigen::Vector3f& p) -> Eigen::Vector3f { return {p.x(), -p.y(), p.z()}; });
       }},
      {"millimetres", "points are in millimetres",
       [](Recording& r, double) {
         change_points(r, [](const Eigen::Vector3f& p) -> Eigen::Vector3f { return 1000.0F * p; });
       }},
      {"world_cloud", "points are moved into odometry's frame already", move_into_world},
      {"ned_positions", "positions are north, east, down beside attitudes of x forward, z up",
       [](Recording& r, double) {
         change_poses(r, [](const Pose3& T) {
           return Pose3{T.rotation, {T.translation.y(), T.translation.x(), -T.translation.z()}};
         });
       }},
      {"ned", "odometry's axes are north, east, down and its body's forward, right, down",
       [](Recording& r, double) {
         const Pose3 ned{Eigen::Quaterniond(0, std::sqrt(0.5), std::sqrt(0.5), 0), Eigen::Vector3d::Zero()};
         const Pose3 frd{Eigen::Quaterniond(0, 1, 0, 0), Eigen::Vector3d::Zero()};
         change_poses(r, [ned, frd](const Pose3& T) { return ned * T * frd; });
       }},
      {"inverse_poses", "odometry has the inverse of every pose",
       [](Recording& r, double) { change_poses(r, [](const Pose3& T) { return T.inverse(); }); }},
      {"w_first", "quaternions are written w first and read w last",
       [](Recording& r, double) {
         change_poses(r, [](const Pose3& T) {
           const Eigen::Quaterniond& q = T.rotation;
           return Pose3{Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()), T.translation};
         });
       }},
      {"frozen", "odometry stands still from 25 to 30 s", freeze},
      {"drift", "odometry turns 0.2 degrees too far to the left with every metre",
       [](Recording& r, double times) {
         change_steps(r, [times](const Pose3& step, Timestamp) {
           return step * turn({0, 0, times * kDrift_deg_per_m * step.translation.norm()});
         });
       }},
      {"scale", "odometry's distances are 5 % too long",
       [](Recording& r, double times) {
         change_steps(r, [scale = 1.0 + times * kScale](const Pose3& step, Timestamp) {
           return Pose3{step.rotation, scale * step.translation};
         });
       }},
      {"baseline", "the second camera is stated 4 % too far from the first", stretch_baseline},
  };
  return mistakes;
}

Status make_mistakes(const std::vector<MistakeConfig>& mistakes, const std::vector<Recording*>& robots) {
  for (const MistakeConfig& mistake : mistakes) {
    const auto robot = std::ranges::find(robots, mistake.robot, &Recording::name);
    if (robot == robots.end())
      return fail(ErrorCode::configuration, "mistakes: no robot is called '{}'", mistake.robot);
    const auto kind = std::ranges::find(robot_mistakes(), mistake.kind, &RobotMistake::name);
    kind->make(**robot, mistake.times);
  }
  return {};
}

}  // namespace tutti::lab
