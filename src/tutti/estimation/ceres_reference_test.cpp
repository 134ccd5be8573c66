// SPDX-License-Identifier: BSD-3-Clause
// The same problems solved by Ceres, with its own automatic derivatives, and the public pose-graph sets.
#include <ceres/ceres.h>
#include <ceres/manifold_test_utils.h>
#include <ceres/rotation.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "support/estimation/random_graphs.hpp"
#include "support/shared_data.hpp"
#include "tutti/estimation/pose_graph_solver.hpp"
#include "tutti/formats/g2o.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::estimation {
namespace ceres_reference_test {

using namespace testing;

template <class T>
using Quaternion = Eigen::Quaternion<T>;
template <class T>
using Vector3 = Eigen::Matrix<T, 3, 1>;

/// [tx ty tz qx qy qz qw] with retract() of geometry/pose3.hpp: right perturbation, translation in the pose's own
/// frame.
struct PoseFunctor {
  template <class T>
  bool Plus(const T* x, const T* delta, T* out) const {
    const Eigen::Map<const Quaternion<T>> q(x + 3);
    Eigen::Map<Vector3<T>> t_out(out);
    t_out = Eigen::Map<const Vector3<T>>(x) + q * Eigen::Map<const Vector3<T>>(delta);
    std::array<T, 4> wxyz;
    ceres::AngleAxisToQuaternion(delta + 3, wxyz.data());
    Eigen::Map<Quaternion<T>> q_out(out + 3);
    q_out = q * Quaternion<T>(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
    return true;
  }
  template <class T>
  bool Minus(const T* y, const T* x, T* out) const {
    const Quaternion<T> q_inverse = Eigen::Map<const Quaternion<T>>(x + 3).conjugate();
    Eigen::Map<Vector3<T>> rho(out);
    rho = q_inverse * (Eigen::Map<const Vector3<T>>(y) - Eigen::Map<const Vector3<T>>(x));
    const Quaternion<T> q = q_inverse * Eigen::Map<const Quaternion<T>>(y + 3);
    const std::array<T, 4> wxyz{q.w(), q.x(), q.y(), q.z()};
    ceres::QuaternionToAngleAxis(wxyz.data(), out + 3);
    return true;
  }
};
using PoseManifold = ceres::AutoDiffManifold<PoseFunctor, 7, 6>;

struct BetweenCost {
  Pose3 meas;
  Matrix6d root;  ///< root^T root = information
  template <class T>
  bool operator()(const T* i, const T* j, T* residual) const {
    const Quaternion<T> q_i = Eigen::Map<const Quaternion<T>>(i + 3).conjugate();
    const Quaternion<T> q_meas = meas.rotation.conjugate().template cast<T>();
    Eigen::Matrix<T, 6, 1> r;
    r.template head<3>() = q_meas * (q_i * (Eigen::Map<const Vector3<T>>(j) - Eigen::Map<const Vector3<T>>(i)) -
                                     meas.translation.template cast<T>());
    const Quaternion<T> q = q_meas * (q_i * Eigen::Map<const Quaternion<T>>(j + 3));
    const std::array<T, 4> wxyz{q.w(), q.x(), q.y(), q.z()};
    ceres::QuaternionToAngleAxis(wxyz.data(), r.data() + 3);
    Eigen::Map<Eigen::Matrix<T, 6, 1>> whitened(residual);
    whitened = root.template cast<T>() * r;
    return true;
  }
};

struct CeresSolution {
  std::vector<Pose3> poses;
  double chi2 = -1.0;
};

CeresSolution solve_with_ceres(const PoseGraph& graph) {
  std::vector<std::array<double, 7>> blocks(graph.poses.size());
  ceres::Problem problem;
  auto* manifold = new PoseManifold;  // owned by the problem
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    Eigen::Map<Eigen::Vector3d>(blocks[k].data()) = graph.poses[k].translation;
    Eigen::Map<Eigen::Quaterniond>(blocks[k].data() + 3) = graph.poses[k].rotation;
    problem.AddParameterBlock(blocks[k].data(), 7, manifold);
  }
  problem.SetParameterBlockConstant(blocks[0].data());
  for (const auto& edge : graph.edges) {
    const Matrix6d root = root_of_information(edge.information);
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<BetweenCost, 6, 7, 7>(new BetweenCost{edge.T_from_to, root}), nullptr,
        blocks[edge.from].data(), blocks[edge.to].data());
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.initial_trust_region_radius = 1e12;  // Gauss-Newton
  options.max_trust_region_radius = 1e16;
  options.function_tolerance = 1e-14;
  options.max_num_iterations = 100;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  CeresSolution out{.poses = {}, .chi2 = 2.0 * summary.final_cost};
  for (const auto& block : blocks)
    out.poses.push_back({Eigen::Map<const Eigen::Quaterniond>(block.data() + 3).normalized(),
                         Eigen::Map<const Eigen::Vector3d>(block.data())});
  return out;
}

TEST(CeresReference, ManifoldIsOurs) {
  using namespace ceres;  // for the macro below
  Rng rng(1);
  const PoseManifold manifold;
  for (int k = 0; k < 20; ++k) {
    const Pose3 T = random_pose(rng);
    const Pose3 other = retract(T, random_tangent(rng, 5.0, 0.7));  // same sign of the quaternion
    const Vector6d xi = random_tangent(rng, 1.0, 0.7);
    Eigen::VectorXd x(7), y(7), delta = xi, moved(7);
    x << T.translation, T.rotation.coeffs();
    y << other.translation, other.rotation.coeffs();
    EXPECT_THAT_MANIFOLD_INVARIANTS_HOLD(manifold, x, delta, y, 1e-9);
    manifold.Plus(x.data(), delta.data(), moved.data());
    const Pose3 ours = retract(T, xi);
    EXPECT_LT((moved.head<3>() - ours.translation).norm(), 1e-12);
    EXPECT_LT(ours.rotation.angularDistance(Eigen::Quaterniond(moved.tail<4>().eval())), 1e-12);
  }
}

TEST(CeresReference, SameOptimumWithFullInformation) {
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    Rng rng(seed);
    PoseGraph graph = random_graph(rng, 80, 60, 1.0).graph;
    const auto ours = solve_pose_graph(graph, {.relative_cost_tolerance = 1e-14});
    const auto theirs = solve_with_ceres(graph);
    EXPECT_NEAR(ours.summary.final_cost, theirs.chi2, 1e-8 * theirs.chi2);
    EXPECT_LT(largest_position_difference(ours.poses, theirs.poses), 1e-5);
    EXPECT_LT(largest_rotation_difference(ours.poses, theirs.poses), 1e-5);
  }
}

PoseGraph read(const std::string& name) {
  const auto file = formats::read_g2o(tutti::test::shared_path("data/g2o/" + name).string());
  EXPECT_TRUE(file.has_value()) << (file ? "" : file.error().message);
  return file ? file->graph : PoseGraph{};
}

void expect_known_optimum(const std::string& name, double chi2_, double tolerance) {
  const auto solution = solve_pose_graph(read(name), {});
  EXPECT_EQ(solution.summary.termination, Termination::converged);
  EXPECT_NEAR(solution.summary.final_cost, chi2_, tolerance);
}

/// Both from our chordal initialisation.
void expect_same_as_ceres(const std::string& name) {
  PoseGraph graph = read(name);
  const auto ours = solve_pose_graph(graph, {});
  graph.poses = solve_pose_graph(graph, {.max_iterations = 0}).poses;
  const auto theirs = solve_with_ceres(graph);
  EXPECT_NEAR(ours.summary.final_cost, theirs.chi2, 1e-6 * theirs.chi2);
  EXPECT_LT(largest_position_difference(ours.poses, theirs.poses), 1e-2);
}

// Published optima, in the conventions of SE-Sync and GTSAM (docs/results/speed.md).
TEST(PublicSets, Sphere2500) {
  TUTTI_REQUIRE_SHARED("data/g2o/sphere2500.g2o");
  expect_known_optimum("sphere2500.g2o", 1351.36, 0.01);
}
TEST(PublicSets, Torus3D) {
  TUTTI_REQUIRE_SHARED("data/g2o/torus3D.g2o");
  expect_known_optimum("torus3D.g2o", 24233.0, 0.1);
}
TEST(PublicSets, ParkingGarage) {
  TUTTI_REQUIRE_SHARED("data/g2o/parking-garage.g2o");
  expect_known_optimum("parking-garage.g2o", 1.2684, 1e-4);
}
TEST(PublicSets, IntelAsCeres) {
  TUTTI_REQUIRE_SHARED("data/g2o/intel.g2o");
  expect_same_as_ceres("intel.g2o");
}
TEST(PublicSets, ManhattanAsCeres) {
  TUTTI_REQUIRE_SHARED("data/g2o/manhattan.g2o");
  expect_same_as_ceres("manhattan.g2o");
}

}  // namespace ceres_reference_test
}  // namespace tutti::estimation
