// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/bundle/internal/problem_structure.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <string>
#include <tuple>

#include "tutti/base/check.hpp"
#include "tutti/base/disjoint_sets.hpp"
#include "tutti/estimation/bundle/imu_factor.hpp"

namespace tutti::bundle::internal {
namespace {

std::string name(const KeyframeId& id) { return fmt::format("{}/{}", to_string(id.chain), id.index); }

template <class Matrix>
bool is_positive_definite(const Matrix& covariance) {
  return covariance.allFinite() && covariance.llt().info() == Eigen::Success;
}

Status check_links(const BundleProblem& problem) {
  for (const auto& odometry : problem.odometry) {
    TUTTI_CHECK(odometry.from < problem.keyframes.size() && odometry.to < problem.keyframes.size());
    if (!is_valid(odometry.measurement.T_a_b, 1e-3) || !is_positive_definite(odometry.measurement.covariance))
      return fail(ErrorCode::invalid, "odometry from keyframe {}: not finite, or its covariance not positive definite",
                  name(problem.keyframes[odometry.from].id));
  }
  for (const auto& imu : problem.imu) {
    TUTTI_CHECK(imu.from < problem.keyframes.size() && imu.to < problem.keyframes.size());
    const auto& m = imu.measurement;
    if (!(m.duration_s > 0.0) || !std::isfinite(m.duration_s) || !m.delta_rotation.coeffs().allFinite() ||
        !m.delta_velocity.allFinite() || !m.delta_position.allFinite() || !m.d_bias.allFinite() ||
        !m.gyro_bias.allFinite() || !m.accelerometer_bias.allFinite() || !is_positive_definite(m.covariance))
      return fail(ErrorCode::invalid, "IMU from keyframe {}: not finite, or its covariance not positive definite",
                  name(problem.keyframes[imu.from].id));
  }
  return {};
}

}  // namespace

ProblemStructure analyse(const BundleProblem& problem) {
  const std::size_t n = problem.keyframes.size();
  DisjointSets sets(n);
  std::vector<std::size_t> first_view(problem.landmarks.size(), n);
  for (const auto& view : problem.observations) {
    if (first_view[view.landmark] == n)
      first_view[view.landmark] = view.keyframe;
    else
      sets.join(first_view[view.landmark], view.keyframe);
  }
  ProblemStructure out{.has_motion = std::vector<bool>(n), .begins_motion = std::vector<bool>(n)};
  for (const auto& odometry : problem.odometry) sets.join(odometry.from, odometry.to);
  for (const auto& imu : problem.imu) {
    sets.join(imu.from, imu.to);
    out.has_motion[imu.from] = out.has_motion[imu.to] = out.begins_motion[imu.from] = true;
  }
  for (const auto& imu : problem.imu) out.begins_motion[imu.to] = false;
  std::tie(out.component, out.components) = sets.labels();
  std::vector<bool> is_held(static_cast<std::size_t>(out.components), false);
  out.has_gravity = is_held;
  for (std::size_t k = 0; k < n; ++k) {
    const auto c = static_cast<std::size_t>(out.component[k]);
    if (problem.keyframes[k].is_constant) is_held[c] = true;
    if (out.has_motion[k]) out.has_gravity[c] = true;
  }
  for (std::size_t k = 0; k < n; ++k) {
    const auto c = static_cast<std::size_t>(out.component[k]);
    if (is_held[c] && !problem.keyframes[k].is_constant) continue;
    out.anchors.push_back(k);
    is_held[c] = true;
  }
  return out;
}

Status check_problem(const BundleProblem& problem) {
  for (const auto& keyframe : problem.keyframes)
    if (!is_valid(keyframe.T_world_body, 1e-3))
      return fail(ErrorCode::invalid, "keyframe {}: its pose is not finite", name(keyframe.id));
  for (const auto& camera : problem.cameras)
    if (const auto status = check_camera(camera.camera.model); !status || !is_valid(camera.camera.T_body_camera, 1e-3))
      return fail(ErrorCode::invalid, "camera {} of robot {}: {}", camera.index, camera.robot.value,
                  status ? "its pose is not finite" : status.error().message);
  for (std::size_t l = 0; l < problem.landmarks.size(); ++l)
    if (!problem.landmarks[l].allFinite()) return fail(ErrorCode::invalid, "landmark {}: not finite", l);
  for (const auto& view : problem.observations) {
    TUTTI_CHECK(view.keyframe < problem.keyframes.size() && view.camera < problem.cameras.size() &&
                view.landmark < problem.landmarks.size());
    if (!view.pixel.allFinite() || !(view.sigma_px > 0.0) || !std::isfinite(view.sigma_px))
      return fail(ErrorCode::invalid, "keyframe {}: its view of landmark {} is not finite, or its sigma not positive",
                  name(problem.keyframes[view.keyframe].id), view.landmark);
  }
  return check_links(problem);
}

void initialise_motion(const BundleProblem& problem, const ProblemStructure& structure, BundleSolution& solution) {
  const auto& poses = solution.T_world_body;
  solution.motion.assign(poses.size(), {});
  solution.gravity.assign(static_cast<std::size_t>(structure.components), Eigen::Vector3d::Zero());
  std::vector<int> ends(poses.size(), 0);
  for (const auto& imu : problem.imu) {  // a keyframe between two factors moves at their mean
    const Eigen::Vector3d v = (poses[imu.to].translation - poses[imu.from].translation) / imu.measurement.duration_s;
    for (const std::size_t k : {imu.from, imu.to}) {
      solution.motion[k].velocity += (v - solution.motion[k].velocity) / ++ends[k];
      solution.motion[k].gyro_bias = imu.measurement.gyro_bias;
      solution.motion[k].accelerometer_bias = imu.measurement.accelerometer_bias;
    }
  }
  for (const auto& imu : problem.imu)  // v_j - v_i = g t + R_i dv, summed
    solution.gravity[static_cast<std::size_t>(structure.component[imu.from])] +=
        solution.motion[imu.to].velocity - solution.motion[imu.from].velocity -
        poses[imu.from].rotation * imu.measurement.delta_velocity;
  for (auto& g : solution.gravity)
    if (g.norm() > 0.0) g *= kGravity_mps2 / g.norm();
}

}  // namespace tutti::bundle::internal
