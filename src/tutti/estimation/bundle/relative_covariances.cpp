// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/bundle/relative_covariances.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <map>
#include <utility>

#include "tutti/base/single_thread.hpp"
#include "tutti/estimation/between_factor.hpp"
#include "tutti/estimation/bundle/imu_factor.hpp"
#include "tutti/estimation/bundle/internal/problem_structure.hpp"
#include "tutti/estimation/bundle/projection_factor.hpp"
#include "tutti/estimation/internal/block_cholesky.hpp"
#include "tutti/estimation/internal/block_structure.hpp"
#include "tutti/estimation/internal/selected_inverse.hpp"
#include "tutti/estimation/robust_loss.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::bundle {
namespace {

using estimation::internal::BlockCholesky;
using estimation::internal::BlockStructure;
using Matrix63d = Eigen::Matrix<double, 6, 3>;
using Node = std::size_t;

/// Nodes of the reduced system, all of six numbers (the solver's block size): every keyframe's pose; where there is an
/// IMU, [velocity; gyro bias] and [accelerometer bias; nothing] of the keyframe, and [gravity; nothing]; of every robot
/// [the scale of its odometry; nothing].
struct Nodes {
  std::vector<Node> motion;   ///< Per keyframe the first of its two.
  std::vector<Node> gravity;  ///< Per component.
  std::vector<Node> padded;   ///< Whose last three numbers are nothing.
  std::map<RobotId, Node> scale;
  Node count = 0;
};

Nodes number_nodes(const BundleProblem& problem, const internal::ProblemStructure& structure) {
  Nodes out{.motion = std::vector<Node>(structure.has_motion.size()),
            .gravity = std::vector<Node>(structure.has_gravity.size()),
            .count = structure.has_motion.size()};
  for (std::size_t k = 0; k < out.motion.size(); ++k) {
    if (!structure.has_motion[k]) continue;
    out.motion[k] = out.count;
    out.padded.push_back(out.count + 1);
    out.count += 2;
  }
  for (std::size_t c = 0; c < out.gravity.size(); ++c) {
    if (!structure.has_gravity[c]) continue;
    out.padded.push_back(out.count);
    out.gravity[c] = out.count++;
  }
  for (const auto& odometry : problem.odometry)
    if (out.scale.try_emplace(problem.keyframes[odometry.from].id.chain.robot, out.count).second) ++out.count;
  return out;
}

/// H += J^T J of a factor over some nodes, collected block by block: the lower node first.
class Blocks {
 public:
  template <int Rows>
  using Derivative = std::pair<Node, Eigen::Matrix<double, Rows, 6>>;

  template <std::size_t N, int Rows>
  void add(const std::array<Derivative<Rows>, N>& factor) {
    for (const auto& [a, J_a] : factor)
      for (const auto& [b, J_b] : factor)
        if (a <= b) at(a, b) += J_a.transpose() * J_b;
  }
  Matrix6d& at(Node a, Node b) { return blocks_.try_emplace({a, b}, Matrix6d::Zero()).first->second; }
  [[nodiscard]] const std::map<std::pair<Node, Node>, Matrix6d>& all() const { return blocks_; }

 private:
  std::map<std::pair<Node, Node>, Matrix6d> blocks_;
};

/// One landmark's views, eliminated: U - E V^-1 E^T.
void add_landmark(std::span<const BundleObservation* const> views, const BundleProblem& problem,
                  const BundleSolution& solution, const estimation::RobustLoss& loss, double variance, Blocks& blocks) {
  Eigen::Matrix3d V = Eigen::Matrix3d::Zero();
  std::map<Node, std::pair<Matrix6d, Matrix63d>> by_keyframe;
  for (const auto* view : views) {
    const auto at = linearise_projection(problem.cameras[view->camera].camera, solution.T_world_body[view->keyframe],
                                         solution.landmarks[view->landmark], view->pixel, view->sigma_px);
    if (!at) continue;
    const double weight = loss.weight(at->residual.squaredNorm()) / variance;
    auto& [U, E] = by_keyframe.try_emplace(view->keyframe, Matrix6d::Zero(), Matrix63d::Zero()).first->second;
    U += weight * at->J_pose.transpose() * at->J_pose;
    E += weight * at->J_pose.transpose() * at->J_landmark;
    V += weight * at->J_landmark.transpose() * at->J_landmark;
  }
  const Eigen::LLT<Eigen::Matrix3d> llt(V);
  if (llt.info() != Eigen::Success) return;  // it has no information
  for (const auto& [i, of_i] : by_keyframe) {
    blocks.at(i, i) += of_i.first;
    const Matrix63d E_V = llt.solve(of_i.second.transpose()).transpose();
    for (const auto& [j, of_j] : by_keyframe)
      if (i <= j) blocks.at(i, j) -= E_V * of_j.second.transpose();
  }
}

void add_views(const BundleProblem& problem, const BundleSolution& solution, const BundleConfig& config,
               Blocks& blocks) {
  const double variance = std::max(1.0, view_variance(problem, solution));
  std::vector<std::vector<const BundleObservation*>> views(problem.landmarks.size());
  for (const auto& view : problem.observations) views[view.landmark].push_back(&view);
  for (const auto& of_landmark : views)
    add_landmark(of_landmark, problem, solution, config.view_loss, variance, blocks);
}

/// The lengths of a robot's steps err by one share beside what each errs by itself.
void add_odometry(const BundleProblem& problem, const BundleSolution& solution, const BundleConfig& config,
                  const Nodes& nodes, Blocks& blocks) {
  for (const auto& odometry : problem.odometry) {
    const auto at = estimation::linearise_between(solution.T_world_body[odometry.from],
                                                  solution.T_world_body[odometry.to], odometry.measurement.T_a_b);
    const Matrix6d root = root_of_inverse(odometry.measurement.covariance);
    const double weight = std::sqrt(config.odometry_loss.weight((root * at.residual).squaredNorm()));
    const Pose3& T_from_to = odometry.measurement.T_a_b;
    Matrix6d J_scale = Matrix6d::Zero();  // the residual's translation is in the frame of the step's end
    J_scale.col(0).head<3>() = -(T_from_to.rotation.conjugate() * T_from_to.translation);
    blocks.add<3, 6>({{{odometry.from, weight * root * at.J_i},
                       {odometry.to, weight * root * at.J_j},
                       {nodes.scale.at(problem.keyframes[odometry.from].id.chain.robot), weight * root * J_scale}}});
  }
  Vector6d prior = Vector6d::Ones();
  prior[0] = 1.0 / (config.odometry_scale_sigma * config.odometry_scale_sigma);
  for (const auto& [robot, node] : nodes.scale) blocks.at(node, node).diagonal() += prior;
}

void add_imu(const BundleProblem& problem, const BundleSolution& solution, const BundleConfig& config,
             const internal::ProblemStructure& structure, const Nodes& nodes, Blocks& blocks) {
  using Matrix156d = Eigen::Matrix<double, 15, 6>;
  const auto padded = [](const auto& columns) {
    Matrix156d out = Matrix156d::Zero();
    out.leftCols<3>() = columns;
    return out;
  };
  for (const auto& imu : problem.imu) {
    const auto c = static_cast<std::size_t>(structure.component[imu.from]);
    const auto at =
        linearise_imu(solution.T_world_body[imu.from], solution.motion[imu.from], solution.T_world_body[imu.to],
                      solution.motion[imu.to], solution.gravity[c], imu.measurement);
    const Matrix15d W =
        imu_root_information(imu.measurement, config.gyro_random_walk, config.accelerometer_random_walk);
    const Eigen::Matrix<double, 15, 9> motion_i = W * at.J_motion_i, motion_j = W * at.J_motion_j;
    blocks.add<7, 15>({{{imu.from, W * at.J_pose_i},
                        {imu.to, W * at.J_pose_j},
                        {nodes.motion[imu.from], motion_i.leftCols<6>()},
                        {nodes.motion[imu.from] + 1, padded(motion_i.rightCols<3>())},
                        {nodes.motion[imu.to], motion_j.leftCols<6>()},
                        {nodes.motion[imu.to] + 1, padded(motion_j.rightCols<3>())},
                        {nodes.gravity[c], padded(W * at.J_gravity)}}});
  }
  const Vector9d information = motion_prior_sigma().cwiseAbs2().cwiseInverse();
  for (std::size_t k = 0; k < structure.begins_motion.size(); ++k) {
    if (!structure.begins_motion[k]) continue;
    blocks.at(nodes.motion[k], nodes.motion[k]).diagonal() += information.head<6>();
    blocks.at(nodes.motion[k] + 1, nodes.motion[k] + 1).diagonal().head<3>() += information.tail<3>();
  }
  for (std::size_t c = 0; c < structure.has_gravity.size(); ++c) {
    if (!structure.has_gravity[c]) continue;
    const Eigen::Vector3d J = solution.gravity[c].normalized() / kGravitySigma_mps2;
    blocks.at(nodes.gravity[c], nodes.gravity[c]).topLeftCorner<3, 3>() += J * J.transpose();
  }
  for (const Node node : nodes.padded) blocks.at(node, node).diagonal().tail<3>().setOnes();
}

/// Where the blocks lie in the sparse matrix: a graph with an edge for each.
BlockStructure structure_of(const Blocks& blocks, Node nodes, const std::vector<std::size_t>& anchors) {
  PoseGraph pattern;
  pattern.poses.resize(nodes);
  for (const auto& [pair, block] : blocks.all()) pattern.edges.push_back({.from = pair.first, .to = pair.second});
  return estimation::internal::analyse_blocks(pattern, {}, anchors);
}

}  // namespace

double view_variance(const BundleProblem& problem, const BundleSolution& solution) {
  constexpr double kMedianOfChi2 = 1.3863;  // two degrees of freedom: 2 log 2
  std::vector<double> squares;
  for (const auto& view : problem.observations) {
    const auto error = reprojection_error(problem.cameras[view.camera].camera, solution.T_world_body[view.keyframe],
                                          solution.landmarks[view.landmark], view.pixel);
    if (error) squares.push_back(error->squaredNorm() / (view.sigma_px * view.sigma_px));
  }
  const double equations = 2.0 * static_cast<double>(squares.size());
  const double left = equations - 3.0 * static_cast<double>(problem.landmarks.size());
  if (left <= 0.0) return 1.0;
  const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
  std::nth_element(squares.begin(), middle, squares.end());
  return *middle / kMedianOfChi2 * equations / left;
}

struct Posterior::State {
  State(const BundleProblem& problem, const BundleSolution& solution, const Blocks& blocks, Nodes n,
        const std::vector<std::size_t>& anchors)
      : nodes(std::move(n)), slots(structure_of(blocks, nodes.count, anchors)), hessian(slots, 6) {
    for (const auto& odometry : problem.odometry) steps.emplace_back(odometry.from, odometry.to);
    T_world_body = solution.T_world_body;
  }
  Nodes nodes;
  BlockStructure slots;
  BlockCholesky hessian;
  std::vector<std::pair<Node, Node>> steps;
  std::vector<Pose3> T_world_body;
};

Posterior::Posterior(std::unique_ptr<State> state) : state_(std::move(state)) {}
Posterior::Posterior(Posterior&&) noexcept = default;
Posterior::~Posterior() = default;

std::optional<Posterior> Posterior::of(const BundleProblem& problem, const BundleSolution& solution,
                                       const BundleConfig& config) {
  const auto structure = internal::analyse(problem);
  const Nodes nodes = number_nodes(problem, structure);
  Blocks blocks;
  add_views(problem, solution, config, blocks);
  add_odometry(problem, solution, config, nodes, blocks);
  add_imu(problem, solution, config, structure, nodes, blocks);

  const SingleThread single_thread;
  auto state = std::make_unique<State>(problem, solution, blocks, nodes, structure.anchors);
  BlockCholesky& hessian = state->hessian;
  hessian.set_zero();
  std::size_t e = 0;
  for (const auto& [pair, block] : blocks.all()) {
    const auto& slot = state->slots.edges[e++];
    if (pair.first != pair.second)
      hessian.add_edge(slot, block);
    else if (slot.from >= 0)
      hessian.add_diagonal(slot.from, block);
  }
  if (!hessian.factorise()) return std::nullopt;
  return Posterior(std::move(state));
}

std::optional<std::vector<Matrix6d>> Posterior::steps() const {
  const SingleThread single_thread;
  const BlockStructure& slots = state_->slots;
  const estimation::internal::SelectedInverse inverse(state_->hessian.factor().copy());
  std::vector<Matrix6d> out;
  for (const auto& [from, to] : state_->steps)
    out.push_back(inverse.relative(slots.variable[from], slots.variable[to],
                                   state_->T_world_body[to].inverse() * state_->T_world_body[from]));
  return out;
}

Eigen::Matrix3d Posterior::accelerometer_bias(std::size_t keyframe) const {
  const SingleThread single_thread;
  const int v = state_->slots.variable[state_->nodes.motion[keyframe] + 1];
  Eigen::MatrixXd b = Eigen::MatrixXd::Zero(6 * state_->slots.variables, 3);
  b.block<3, 3>(6 * v, 0).setIdentity();
  state_->hessian.solve(b);
  return b.block<3, 3>(6 * v, 0);
}

double Posterior::variance_of(const std::vector<std::pair<std::size_t, Vector6d>>& gradient) const {
  const SingleThread single_thread;
  Eigen::MatrixXd b = Eigen::MatrixXd::Zero(6 * state_->slots.variables, 1);
  for (const auto& [keyframe, by_pose] : gradient)
    if (const int v = state_->slots.variable[keyframe]; v >= 0) b.col(0).segment<6>(6 * v) += by_pose;
  const Eigen::VectorXd g = b.col(0);
  state_->hessian.solve(b);
  return g.dot(b.col(0));
}

std::optional<std::vector<Matrix6d>> odometry_posterior(const BundleProblem& problem, const BundleSolution& solution,
                                                        const BundleConfig& config) {
  const auto posterior = Posterior::of(problem, solution, config);
  return posterior ? posterior->steps() : std::nullopt;
}

}  // namespace tutti::bundle
