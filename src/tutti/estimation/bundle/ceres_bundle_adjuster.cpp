// SPDX-License-Identifier: BSD-3-Clause
#include <ceres/ceres.h>

#include <algorithm>
#include <array>
#include <memory>
#include <vector>

#include "tutti/base/single_thread.hpp"
#include "tutti/estimation/between_factor.hpp"
#include "tutti/estimation/bundle/bundle_adjuster.hpp"
#include "tutti/estimation/bundle/imu_factor.hpp"
#include "tutti/estimation/bundle/internal/pose_block.hpp"
#include "tutti/estimation/bundle/internal/problem_structure.hpp"
#include "tutti/estimation/bundle/projection_factor.hpp"
#include "tutti/estimation/robust_loss.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::bundle {
namespace {

using estimation::RobustLoss;
using internal::minus_jacobian;
using internal::pose_of;
using MotionBlock = std::array<double, 9>;
template <int Rows, int Columns>
using RowMajor = Eigen::Matrix<double, Rows, Columns, Columns == 1 ? Eigen::ColMajor : Eigen::RowMajor>;

class PoseManifold final : public ceres::Manifold {
 public:
  [[nodiscard]] int AmbientSize() const override { return 7; }
  [[nodiscard]] int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* out) const override {
    internal::write_pose(retract(pose_of(x), Eigen::Map<const Vector6d>(delta)), out);
    return true;
  }
  bool Minus(const double* y, const double* x, double* out) const override {
    Eigen::Map<Vector6d>{out} = local(pose_of(x), pose_of(y));
    return true;
  }
  bool PlusJacobian(const double* x, double* jacobian) const override {
    Eigen::Map<internal::PlusJacobian>{jacobian} = internal::plus_jacobian(x);
    return true;
  }
  bool MinusJacobian(const double* x, double* jacobian) const override {
    Eigen::Map<internal::MinusJacobian>{jacobian} = minus_jacobian(x);
    return true;
  }
};

/// Ours as Ceres wants it: iteratively re-weighted least squares (no second derivative).
class Loss final : public ceres::LossFunction {
 public:
  explicit Loss(RobustLoss loss) : loss_(loss) {}
  void Evaluate(double s, double* out) const override {
    out[0] = loss_.rho(s);
    out[1] = loss_.weight(s);
    out[2] = 0.0;
  }

 private:
  RobustLoss loss_;
};

/// Writes a derivative by a pose's tangent as one by its block: Ceres multiplies it by plus_jacobian() again.
template <int Rows>
void write_pose_jacobian(const Eigen::Matrix<double, Rows, 6>& J, const double* x, double* out) {
  if (out) Eigen::Map<RowMajor<Rows, 7>>{out}.noalias() = J * minus_jacobian(x);
}
template <class Matrix>
void write_jacobian(const Matrix& J, double* out) {
  if (out) Eigen::Map<RowMajor<Matrix::RowsAtCompileTime, Matrix::ColsAtCompileTime>>{out} = J;
}

class ProjectionCost final : public ceres::SizedCostFunction<2, 7, 3> {
 public:
  ProjectionCost(const Camera& camera, const BundleObservation& view) : camera_(camera), view_(view) {}
  bool Evaluate(double const* const* x, double* residual, double** jacobians) const override {
    const Pose3 T = pose_of(x[0]);
    const Eigen::Map<const Eigen::Vector3d> p(x[1]);
    Eigen::Map<Eigen::Vector2d> r(residual);
    if (!jacobians) {
      const auto error = reprojection_error(camera_, T, p, view_.pixel);
      r = error ? Eigen::Vector2d(*error / view_.sigma_px) : Eigen::Vector2d::Constant(kUnseen);
      return true;
    }
    const auto at = linearise_projection(camera_, T, p, view_.pixel, view_.sigma_px);
    const ProjectionLinearisation unseen{Eigen::Vector2d::Constant(kUnseen), Eigen::Matrix<double, 2, 6>::Zero(),
                                         Eigen::Matrix<double, 2, 3>::Zero()};
    const auto& used = at ? *at : unseen;
    r = used.residual;
    write_pose_jacobian(used.J_pose, x[0], jacobians[0]);
    write_jacobian(used.J_landmark, jacobians[1]);
    return true;
  }

 private:
  static constexpr double kUnseen = 100.0;  ///< Residual of a landmark behind its camera: no step gains by it.
  const Camera& camera_;
  const BundleObservation& view_;
};

class OdometryCost final : public ceres::SizedCostFunction<6, 7, 7> {
 public:
  explicit OdometryCost(const RelativePose& measurement)
      : T_(measurement.T_a_b), root_(root_of_inverse(measurement.covariance)) {}
  bool Evaluate(double const* const* x, double* residual, double** jacobians) const override {
    const auto at = estimation::linearise_between(pose_of(x[0]), pose_of(x[1]), T_);
    Eigen::Map<Vector6d>{residual} = root_ * at.residual;
    if (!jacobians) return true;
    write_pose_jacobian<6>(root_ * at.J_i, x[0], jacobians[0]);
    write_pose_jacobian<6>(root_ * at.J_j, x[1], jacobians[1]);
    return true;
  }

 private:
  Pose3 T_;
  Matrix6d root_;
};

MotionState motion_of(const double* x) { return {{x[0], x[1], x[2]}, {x[3], x[4], x[5]}, {x[6], x[7], x[8]}}; }
MotionBlock block_of(const MotionState& m) {
  MotionBlock out;
  Eigen::Map<Vector9d>{out.data()} << m.velocity, m.gyro_bias, m.accelerometer_bias;
  return out;
}

class ImuCost final : public ceres::SizedCostFunction<15, 7, 9, 7, 9, 3> {
 public:
  ImuCost(const ImuPreintegration& imu, const BundleConfig& config)
      : imu_(imu), root_(imu_root_information(imu, config.gyro_random_walk, config.accelerometer_random_walk)) {}
  bool Evaluate(double const* const* x, double* residual, double** jacobians) const override {
    const auto at = linearise_imu(pose_of(x[0]), motion_of(x[1]), pose_of(x[2]), motion_of(x[3]),
                                  Eigen::Map<const Eigen::Vector3d>(x[4]), imu_);
    Eigen::Map<Vector15d>{residual} = root_ * at.residual;
    if (!jacobians) return true;
    write_pose_jacobian<15>(root_ * at.J_pose_i, x[0], jacobians[0]);
    write_jacobian((root_ * at.J_motion_i).eval(), jacobians[1]);
    write_pose_jacobian<15>(root_ * at.J_pose_j, x[2], jacobians[2]);
    write_jacobian((root_ * at.J_motion_j).eval(), jacobians[3]);
    write_jacobian((root_ * at.J_gravity).eval(), jacobians[4]);
    return true;
  }

 private:
  const ImuPreintegration& imu_;
  Matrix15d root_;
};

class MotionPrior final : public ceres::SizedCostFunction<9, 9> {
 public:
  explicit MotionPrior(const double* mean) {
    std::copy(mean + 3, mean + 9, mean_.begin() + 3);  // the biases; velocity's is 0
  }
  bool Evaluate(double const* const* x, double* residual, double** jacobians) const override {
    const Vector9d weight = motion_prior_sigma().cwiseInverse();
    Eigen::Map<Vector9d>{residual} =
        weight.cwiseProduct(Eigen::Map<const Vector9d>(x[0]) - Eigen::Map<const Vector9d>(mean_.data()));
    if (jacobians) write_jacobian(Matrix9d(weight.asDiagonal()), jacobians[0]);
    return true;
  }

 private:
  MotionBlock mean_{};
};

class GravityCost final : public ceres::SizedCostFunction<1, 3> {
 public:
  bool Evaluate(double const* const* x, double* residual, double** jacobians) const override {
    const Eigen::Map<const Eigen::Vector3d> g(x[0]);
    residual[0] = (g.norm() - kGravity_mps2) / kGravitySigma_mps2;
    if (jacobians) write_jacobian(Eigen::RowVector3d(g.transpose() / (g.norm() * kGravitySigma_mps2)), jacobians[0]);
    return true;
  }
};

/// The problem as Ceres sees it, over blocks of its own. They lie in one array, since Ceres sorts the blocks of a group
/// by their addresses: in arrays of their own, the allocator would decide the order of poses and motion, and with it
/// the last digits.
class CeresProblem {
 public:
  CeresProblem(const BundleProblem& problem, const internal::ProblemStructure& structure, const BundleConfig& config,
               const BundleSolution& start)
      : view_loss_(config.view_loss),
        odometry_loss_(config.odometry_loss),
        poses_(start.T_world_body.size()),
        gravities_(start.gravity.size()),
        values_(16 * poses_ + 3 * (gravities_ + start.landmarks.size())),
        reduced_size_(6 * poses_),
        ceres_(options()) {
    for (std::size_t k = 0; k < poses_; ++k) {
      internal::write_pose(start.T_world_body[k], pose(k));
      std::ranges::copy(block_of(start.motion[k]), motion(k));
    }
    for (std::size_t c = 0; c < gravities_; ++c) Eigen::Map<Eigen::Vector3d>{gravity(c)} = start.gravity[c];
    for (std::size_t l = 0; l < start.landmarks.size(); ++l)
      Eigen::Map<Eigen::Vector3d>{landmark(l)} = start.landmarks[l];
    for (std::size_t k = 0; k < poses_; ++k) ceres_.AddParameterBlock(pose(k), 7, &manifold_);
    for (const std::size_t k : structure.anchors) ceres_.SetParameterBlockConstant(pose(k));
    add_views(problem);
    for (const auto& odometry : problem.odometry)
      ceres_.AddResidualBlock(new OdometryCost(odometry.measurement), &odometry_loss_, pose(odometry.from),
                              pose(odometry.to));
    add_imu(problem, structure, config);
  }

  /// Landmarks are eliminated; the rest is solved densely while that is the faster way.
  ceres::Solver::Summary solve(const BundleConfig& config) {
    ceres::Solver::Options options;
    options.max_num_iterations = config.max_iterations;
    options.function_tolerance = config.relative_cost_tolerance;
    options.linear_solver_type = reduced_size_ > kDenseSize ? ceres::SPARSE_SCHUR : ceres::DENSE_SCHUR;
    options.dense_linear_algebra_library_type = ceres::LAPACK;
    options.initial_trust_region_radius = 1e6;  // close to Gauss-Newton: damping crawls along odometry
    options.logging_type = ceres::SILENT;
    options.num_threads = 1;
    options.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
    std::vector<double*> blocks;
    ceres_.GetParameterBlocks(&blocks);
    for (double* block : blocks) options.linear_solver_ordering->AddElementToGroup(block, block >= landmark(0) ? 0 : 1);
    ceres::Solver::Summary summary;
    ceres::Solve(options, &ceres_, &summary);
    return summary;
  }

  void read(BundleSolution& out) {
    for (std::size_t k = 0; k < poses_; ++k) {
      out.T_world_body[k] = pose_of(pose(k));
      out.motion[k] = motion_of(motion(k));
    }
    for (std::size_t l = 0; l < out.landmarks.size(); ++l)
      out.landmarks[l] = Eigen::Map<const Eigen::Vector3d>(landmark(l));
    for (std::size_t c = 0; c < gravities_; ++c) out.gravity[c] = Eigen::Map<const Eigen::Vector3d>(gravity(c));
  }

 private:
  static constexpr std::size_t kDenseSize = 2500;  ///< Numbers.

  static ceres::Problem::Options options() {
    ceres::Problem::Options options;
    options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.disable_all_safety_checks = true;
    return options;
  }

  void add_views(const BundleProblem& problem) {
    for (const auto& view : problem.observations)
      ceres_.AddResidualBlock(new ProjectionCost(problem.cameras[view.camera].camera, view), &view_loss_,
                              pose(view.keyframe), landmark(view.landmark));
  }

  void add_imu(const BundleProblem& problem, const internal::ProblemStructure& structure, const BundleConfig& config) {
    reduced_size_ += 9 * static_cast<std::size_t>(std::ranges::count(structure.has_motion, true));
    for (const auto& imu : problem.imu)
      ceres_.AddResidualBlock(new ImuCost(imu.measurement, config), nullptr, pose(imu.from), motion(imu.from),
                              pose(imu.to), motion(imu.to),
                              gravity(static_cast<std::size_t>(structure.component[imu.from])));
    for (std::size_t k = 0; k < poses_; ++k)
      if (structure.begins_motion[k]) ceres_.AddResidualBlock(new MotionPrior(motion(k)), nullptr, motion(k));
    for (std::size_t c = 0; c < gravities_; ++c)
      if (structure.has_gravity[c]) ceres_.AddResidualBlock(new GravityCost, nullptr, gravity(c));
  }

  [[nodiscard]] double* pose(std::size_t k) { return values_.data() + 7 * k; }
  [[nodiscard]] double* motion(std::size_t k) { return values_.data() + 7 * poses_ + 9 * k; }
  [[nodiscard]] double* gravity(std::size_t c) { return values_.data() + 16 * poses_ + 3 * c; }
  [[nodiscard]] double* landmark(std::size_t l) { return gravity(gravities_ + l); }

  PoseManifold manifold_;
  Loss view_loss_, odometry_loss_;
  std::size_t poses_, gravities_;
  std::vector<double> values_;  ///< Poses, motion, gravity, landmarks.
  std::size_t reduced_size_;    ///< Numbers of poses and motion.
  ceres::Problem ceres_;
};

estimation::Termination termination_of(const ceres::Solver::Summary& summary) {
  switch (summary.termination_type) {
    case ceres::CONVERGENCE:
      return estimation::Termination::converged;
    case ceres::NO_CONVERGENCE:
      return estimation::Termination::max_iterations;
    default:
      return estimation::Termination::singular;
  }
}

class CeresBundleAdjuster final : public BundleAdjuster {
 public:
  explicit CeresBundleAdjuster(const BundleConfig& config) : config_(config) {}

  [[nodiscard]] Result<BundleSolution> adjust(const BundleProblem& problem) const override {
    if (const auto status = internal::check_problem(problem); !status) return tl::unexpected(status.error());
    const auto structure = internal::analyse(problem);
    BundleSolution out{.landmarks = problem.landmarks, .component = structure.component};
    for (const auto& keyframe : problem.keyframes) out.T_world_body.push_back(keyframe.T_world_body);
    internal::initialise_motion(problem, structure, out);
    const SingleThread single_thread;
    CeresProblem ceres(problem, structure, config_, out);
    const auto summary = ceres.solve(config_);
    out.summary = {.termination = termination_of(summary),
                   .iterations = static_cast<int>(summary.iterations.size()) - 1,
                   .components = structure.components,
                   .initial_cost = summary.initial_cost,
                   .final_cost = summary.final_cost,
                   .message = summary.message};
    if (summary.IsSolutionUsable()) ceres.read(out);
    return out;
  }

 private:
  BundleConfig config_;
};

}  // namespace

std::unique_ptr<BundleAdjuster> make_ceres_bundle_adjuster(const BundleConfig& config) {
  return std::make_unique<CeresBundleAdjuster>(config);
}

}  // namespace tutti::bundle
