// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/fit/image_step.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <map>
#include <set>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/perception/visual/absolute_pose.hpp"
#include "tutti/perception/visual/triangulate.hpp"

namespace tutti::fit {
namespace {

using visual::View;
using PosePoint = Eigen::Matrix<double, 6, 3>;

constexpr std::size_t kFewestPoints = 15;
constexpr double kLeastAgreeing = 0.5;  // share of the points
// Calibrations err by this at least: points at the same pixels are wrong alike.
constexpr double kCalibration_m = 0.01, kCalibration_rad = 0.1 * kRadPerDeg;
// Where to begin. The distance of a far point is hardly known, and weighs as little when all is solved together.
constexpr visual::TriangulationConfig kTriangulation{.min_views = 2, .min_parallax_deg = 0.5};
constexpr int kMostSteps = 8;
constexpr double kLossSigmas2 = 4.0, kConverged = 1e-7;  // m and rad

/// A point with its views at both times, in the body's frame at the first.
struct SeenPoint {
  std::vector<View> first, second;  ///< View::T_camera_submap is T_camera_body.
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

void collect(const TrackedImages& images, std::vector<View> SeenPoint::*views,
             std::map<std::uint64_t, SeenPoint>& out) {
  for (const TrackedImage& image : images.images) {
    const Camera& camera = (*images.cameras)[image.camera];
    const Pose3 T_camera_body = camera.T_body_camera.inverse();
    for (const TrackedKeypoint& seen : image.keypoints)
      if (seen.track != 0)
        (out[seen.track].*views)
            .push_back({&camera.model, T_camera_body, seen.pixel.cast<double>(), double{seen.sigma_px}});
  }
}

/// Those that have a distance at the first time and are seen at the second.
std::vector<SeenPoint> points_of(const TrackedImages& from, const TrackedImages& to) {
  std::map<std::uint64_t, SeenPoint> by_track;
  collect(from, &SeenPoint::first, by_track);
  collect(to, &SeenPoint::second, by_track);
  std::vector<SeenPoint> out;
  for (auto& [track, point] : by_track) {
    if (point.first.size() < 2 || point.second.empty()) continue;
    const auto there = visual::triangulate(point.first, kTriangulation);
    if (!there) continue;
    point.position = there->position;
    point.covariance = there->covariance;
    out.push_back(std::move(point));
  }
  return out;
}

/// The body's pose at the second time from points as they are at the first; the points that do not agree are dropped.
std::optional<Pose3> first_pose(std::vector<SeenPoint>& points, const TrackedImages& to) {
  std::vector<visual::Sighting> sightings;
  std::vector<std::size_t> point_of;
  for (std::size_t i = 0; i < points.size(); ++i)
    for (const View& view : points[i].second) {
      const auto camera = std::ranges::find_if(*to.cameras, [&](const Camera& c) { return &c.model == view.camera; });
      sightings.push_back({static_cast<std::uint32_t>(camera - to.cameras->begin()), view.pixel, view.sigma_px,
                           points[i].position, points[i].covariance});
      point_of.push_back(i);
    }
  const auto least = static_cast<std::size_t>(kLeastAgreeing * static_cast<double>(sightings.size()));
  const auto pose =
      visual::absolute_pose(sightings, *to.cameras, {}, Rng(static_cast<std::uint64_t>(to.stamp.ns)), least);
  if (!pose || pose->inliers.size() < least) return std::nullopt;
  std::set<std::size_t> agree;
  for (const std::uint32_t inlier : pose->inliers) agree.insert(point_of[inlier]);
  std::vector<SeenPoint> kept;
  for (const std::size_t i : agree) kept.push_back(std::move(points[i]));
  points = std::move(kept);
  return pose->T_map_body;
}

/// The normal equations of one point and the pose at the second time.
struct PointSums {
  Matrix6d H = Matrix6d::Zero();
  Vector6d g = Vector6d::Zero();
  PosePoint H_pose_point = PosePoint::Zero();
  Eigen::Matrix3d H_point = Eigen::Matrix3d::Zero();
  Eigen::Vector3d g_point = Eigen::Vector3d::Zero();
  double chi2 = 0.0;
  int residuals = 0;

  void add(const View& view, const Eigen::Vector3d& p, const Pose3* T_first_second) {
    const Pose3 T_body_map = T_first_second == nullptr ? Pose3{} : T_first_second->inverse();
    const Eigen::Vector3d p_body = T_body_map * p;
    Eigen::Matrix<double, 2, 3> d_camera;
    const auto pixel = project(*view.camera, view.T_camera_submap * p_body, &d_camera);
    if (!pixel) return;
    const Eigen::Matrix<double, 2, 3> d_body = d_camera * view.T_camera_submap.rotation.toRotationMatrix();
    const Eigen::Matrix<double, 2, 3> d_point = d_body * T_body_map.rotation.toRotationMatrix();
    const Eigen::Vector2d r = *pixel - view.pixel;
    const double distance2 = r.squaredNorm() / (view.sigma_px * view.sigma_px);
    const double w = 1.0 / ((1.0 + distance2 / kLossSigmas2) * view.sigma_px * view.sigma_px);
    H_point += w * d_point.transpose() * d_point;
    g_point += w * d_point.transpose() * r;
    chi2 += w * r.squaredNorm();
    residuals += 2;
    if (T_first_second == nullptr) return;
    Eigen::Matrix<double, 2, 6> d_pose;
    d_pose << -d_body, d_body * skew(p_body);
    H += w * d_pose.transpose() * d_pose;
    g += w * d_pose.transpose() * r;
    H_pose_point += w * d_pose.transpose() * d_point;
  }
};

PointSums sums_of(const SeenPoint& point, const Pose3& T_first_second) {
  PointSums out;
  for (const View& view : point.first) out.add(view, point.position, nullptr);
  for (const View& view : point.second) out.add(view, point.position, &T_first_second);
  return out;
}

/// Pose and points together by Gauss-Newton, the points eliminated: were the points taken as known, whose errors come
/// from the same pixels, the motion would come out too short. Returns the pose's covariance; nothing when it fails.
std::optional<Matrix6d> solve_together(std::vector<SeenPoint>& points, Pose3& T_first_second) {
  for (int iteration = 0;; ++iteration) {
    std::vector<PointSums> sums;
    Matrix6d H = Matrix6d::Zero();
    Vector6d g = Vector6d::Zero();
    double chi2 = 0.0, freedom = -6.0;
    for (const SeenPoint& point : points) {
      const PointSums& s = sums.emplace_back(sums_of(point, T_first_second));
      const PosePoint gain = s.H_pose_point * s.H_point.inverse();
      H += s.H - gain * s.H_pose_point.transpose();
      g += s.g - gain * s.g_point;
      chi2 += s.chi2;
      freedom += s.residuals - 3.0;
    }
    const Eigen::LDLT<Matrix6d> solver(H);
    const Vector6d step = -solver.solve(g);
    if (!step.allFinite() || freedom <= 0.0) return std::nullopt;
    if (step.norm() < kConverged || iteration == kMostSteps)
      return std::max(1.0, chi2 / freedom) * solver.solve(Matrix6d::Identity());
    T_first_second = retract(T_first_second, step);
    for (std::size_t i = 0; i < points.size(); ++i)
      points[i].position -= sums[i].H_point.ldlt().solve(sums[i].g_point + sums[i].H_pose_point.transpose() * step);
  }
}

}  // namespace

std::optional<ScanStep> step_between(const TrackedImages& from, const TrackedImages& to) {
  std::vector<SeenPoint> points = points_of(from, to);
  const std::size_t all = points.size();
  if (all < kFewestPoints) return std::nullopt;
  const auto begin = first_pose(points, to);
  if (!begin || points.size() < kFewestPoints) return std::nullopt;
  ScanStep step{.from = from.stamp, .to = to.stamp, .T_from_to = *begin};
  const auto covariance = solve_together(points, step.T_from_to);
  if (!covariance || !covariance->allFinite()) return std::nullopt;
  step.overlap = static_cast<double>(points.size()) / static_cast<double>(all);
  step.covariance = *covariance;
  step.covariance.diagonal().head<3>().array() += kCalibration_m * kCalibration_m;
  step.covariance.diagonal().tail<3>().array() += kCalibration_rad * kCalibration_rad;
  step.registrations = 1;
  return step;
}

}  // namespace tutti::fit
