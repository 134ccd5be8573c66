// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/g2o.hpp"

#include <gtest/gtest.h>
// RapidCheck after gtest.
#include <rapidcheck/gtest.h>

#include <Eigen/Eigenvalues>

#include "support/formats/mutations.hpp"
#include "support/shared_data.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::formats {
namespace g2o_test {

using internal::any_double;
using internal::any_pose;

Matrix6d any_information() {
  Matrix6d root;
  for (int i = 0; i < 36; ++i) root(i) = any_double();
  const Matrix6d information = root * root.transpose();
  return 0.5 * (information + information.transpose());
}

G2oFile any_file() {
  G2oFile file;
  const auto size = *rc::gen::inRange<std::size_t>(1, 6);
  std::int64_t id = *rc::gen::inRange<std::int64_t>(std::numeric_limits<std::int64_t>::min(), 1'000'000);
  for (std::size_t i = 0; i < size; ++i, id += *rc::gen::inRange<std::int64_t>(1, 1'000'000'000'000)) {
    file.vertex_ids.push_back(id);
    file.graph.poses.push_back(any_pose());
    if (i > 0) file.graph.edges.push_back({i, i - 1, any_pose(), any_information()});
    if (*rc::gen::inRange(0, 3) == 0) file.fixed.push_back(i);
  }
  return file;
}

bool same(const G2oFile& a, const G2oFile& b) {
  const auto same_edge = [](const PoseGraphEdge& x, const PoseGraphEdge& y) {
    return x.from == y.from && x.to == y.to && x.T_from_to == y.T_from_to && x.information == y.information;
  };
  return a.vertex_ids == b.vertex_ids && a.is_2d == b.is_2d && a.has_vertices == b.has_vertices &&
         a.graph.poses == b.graph.poses && a.fixed == b.fixed &&
         std::equal(a.graph.edges.begin(), a.graph.edges.end(), b.graph.edges.begin(), b.graph.edges.end(), same_edge);
}

double chi2(const PoseGraph& graph) {
  double sum = 0.0;
  for (const auto& edge : graph.edges) {
    const Vector6d r = local(edge.T_from_to, graph.poses[edge.from].inverse() * graph.poses[edge.to]);
    sum += r.dot(edge.information * r);
  }
  return sum;
}

std::string message_of(const std::string& text) {
  const auto result = parse_g2o(text, "g.g2o");
  return result ? std::string("no error") : result.error().message;
}

constexpr const char* kIdentity6 = " 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1";

std::string edge_se3(std::int64_t from, std::int64_t to, const Pose3& T) {
  const auto& [q, t] = T;
  return fmt::format("EDGE_SE3:QUAT {} {} {} {} {} {} {} {} {}{}\n", from, to, t.x(), t.y(), t.z(), q.x(), q.y(), q.z(),
                     q.w(), kIdentity6);
}

RC_GTEST_PROP(G2o, Se3ReadsBackBitForBit, ()) {
  const G2oFile file = any_file();
  const auto back = parse_g2o(to_g2o(file), "g");
  RC_ASSERT(back.has_value());
  RC_ASSERT(same(*back, file));
}

TEST(G2o, InformationIsTheUpperTriangleTranslationFirst) {
  const auto file = parse_g2o(
      "EDGE_SE3:QUAT 4 9 1 2 3 0 0 0 1"
      " 11 .12 .13 .14 .15 .16 22 .23 .24 .25 .26 33 .34 .35 .36 44 .45 .46 55 .56 66",
      "g");
  ASSERT_TRUE(file) << file.error().message;
  const Matrix6d& information = file->graph.edges[0].information;
  EXPECT_EQ(information, information.transpose());
  for (int i = 0; i < 6; ++i)
    for (int j = i; j < 6; ++j)
      EXPECT_DOUBLE_EQ(information(i, j), i == j ? 11.0 * (i + 1) : (10 * (i + 1) + j + 1) / 100.0);
  EXPECT_EQ(file->vertex_ids, (std::vector<std::int64_t>{4, 9}));
  EXPECT_EQ(file->graph.poses[1].translation, Eigen::Vector3d(1, 2, 3));
}

/// A turn by 0.1 rad under rotation information k costs k * 0.1^2 (in g2o's own half-angle tangent: a quarter).
TEST(G2o, RotationInformationIsPerRadian) {
  auto file = parse_g2o(
      "EDGE_SE3:QUAT 0 1 0 0 0 0 0 0 1 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 400\nVERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\n"
      "VERTEX_SE3:QUAT 1 0 0 0 0 0 0 1",
      "g");
  ASSERT_TRUE(file) << file.error().message;
  file->graph.poses[1].rotation = so3_exp({0, 0, 0.1});
  EXPECT_NEAR(chi2(file->graph), 4.0, 1e-12);
}

/// A random planar loop with hand-made SE(2) residuals: the lift has the same chi2, and nothing pulls out of the plane.
RC_GTEST_PROP(G2o, LiftedPlanarGraphsKeepTheirCostAndTheirOptimum, ()) {
  constexpr int kSize = 4;
  std::string text;
  std::vector<Eigen::Vector3d> poses;  // x y theta
  for (int i = 0; i < kSize; ++i) {
    poses.emplace_back(any_double(), any_double(), any_double());
    text += fmt::format("VERTEX_SE2 {} {} {} {}\n", i, poses.back().x(), poses.back().y(), poses.back().z());
  }
  double planar_chi2 = 0.0;
  for (int i = 0; i < kSize; ++i) {
    const int j = (i + 1) % kSize;
    const Eigen::Vector3d z(any_double(), any_double(), any_double());
    Eigen::Matrix3d root;
    for (int k = 0; k < 9; ++k) root(k) = any_double(0.1);
    const Eigen::Matrix3d W = root * root.transpose();
    text += fmt::format("EDGE_SE2 {} {} {} {} {} {} {} {} {} {} {}\n", i, j, z.x(), z.y(), z.z(), W(0, 0), W(0, 1),
                        W(0, 2), W(1, 1), W(1, 2), W(2, 2));
    const Eigen::Rotation2Dd R_i(poses[i].z());
    const Eigen::Vector2d t_ij = R_i.inverse() * (poses[j] - poses[i]).head<2>();
    Eigen::Vector3d r;
    r.head<2>() = Eigen::Rotation2Dd(z.z()).inverse() * (t_ij - z.head<2>());
    r.z() = std::remainder(poses[j].z() - poses[i].z() - z.z(), 2.0 * M_PI);
    RC_PRE(std::abs(r.z()) < 3.1);  // not across the cut
    planar_chi2 += r.dot(W * r);
  }
  const auto file = parse_g2o(text, "g");
  RC_ASSERT(file.has_value());
  RC_ASSERT(file->is_2d);
  RC_ASSERT(std::abs(chi2(file->graph) - planar_chi2) <= 1e-9 * (1.0 + planar_chi2));

  for (int axis : {2, 3, 4}) {
    constexpr double kStep = 1e-4;
    Vector6d step = Vector6d::Zero();
    step[axis] = kStep;
    PoseGraph up = file->graph;
    PoseGraph down = file->graph;
    up.poses[1] = retract(up.poses[1], step);
    down.poses[1] = retract(down.poses[1], -step);
    RC_ASSERT(std::abs(chi2(up) - chi2(down)) <= 1e-9 * (1.0 + planar_chi2));
  }
  for (const auto& edge : file->graph.edges)
    for (const int axis : {2, 3, 4}) RC_ASSERT(edge.information(axis, axis) > 0.0);
}

RC_GTEST_PROP(G2o, Se2ReadsBackExceptForTheRoundingOfAngles, ()) {
  const double theta = any_double();
  const std::string text =
      fmt::format("VERTEX_SE2 -3 {} {} {}\nVERTEX_SE2 7 0 0 0\nEDGE_SE2 7 -3 {} {} {} 4 .1 .2 5 .3 6\n", any_double(),
                  any_double(), theta, any_double(), any_double(), -theta);
  const auto first = parse_g2o(text, "g");
  const auto second = parse_g2o(to_g2o(*first), "g");
  RC_ASSERT(second.has_value());
  RC_ASSERT(second->is_2d && second->vertex_ids == first->vertex_ids);
  RC_ASSERT(second->graph.edges[0].information == first->graph.edges[0].information);
  for (int i = 0; i < 2; ++i) RC_ASSERT(local(first->graph.poses[i], second->graph.poses[i]).norm() < 1e-13);
}

/// Any tree of ids, edges in either direction: chaining gives back the poses that made the edges.
RC_GTEST_PROP(G2o, PosesAreChainedOverAnyTree, ()) {
  const auto size = *rc::gen::inRange<std::size_t>(2, 8);
  std::vector<Pose3> truth(size);
  for (std::size_t i = 1; i < size; ++i) truth[i] = any_pose();
  std::string text;
  for (std::size_t i = 1; i < size; ++i) {
    std::size_t from = *rc::gen::inRange<std::size_t>(0, i);
    std::size_t to = i;
    if (*rc::gen::arbitrary<bool>()) std::swap(from, to);
    text += edge_se3(10 * static_cast<std::int64_t>(from), 10 * static_cast<std::int64_t>(to),
                     truth[from].inverse() * truth[to]);
  }
  const auto file = parse_g2o(text, "g");
  RC_ASSERT(file.has_value());
  RC_ASSERT(!file->has_vertices);
  for (std::size_t i = 0; i < size; ++i) RC_ASSERT(local(truth[i], file->graph.poses[i]).norm() < 1e-6);
}

TEST(G2o, OdometryIsPreferredToClosures) {
  const Pose3 step{Eigen::Quaterniond::Identity(), {1, 0, 0}};
  const Pose3 wrong{Eigen::Quaterniond::Identity(), {0, 50, 0}};
  // Two robots, 0..2 and 100..102, one of them with reversed odometry, two wrong closures within a robot.
  const std::string text = edge_se3(0, 2, wrong) + edge_se3(0, 1, step) + edge_se3(1, 2, step) +
                           edge_se3(2, 100, step) + edge_se3(102, 100, wrong) + edge_se3(101, 100, step) +
                           edge_se3(102, 101, step);
  const auto file = parse_g2o(text, "g");
  ASSERT_TRUE(file) << file.error().message;
  const std::vector<double> x = {0, 1, 2, 3, 2, 1};
  for (std::size_t i = 0; i < x.size(); ++i)
    EXPECT_TRUE(file->graph.poses[i].translation.isApprox(Eigen::Vector3d(x[i], 0, 0)) ||
                file->graph.poses[i].translation.norm() + x[i] == 0.0)
        << i << ": " << file->graph.poses[i].translation.transpose();
}

TEST(G2o, ExtremeIdsAreNotNeighbours) {
  const auto file =
      parse_g2o(edge_se3(std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max(),
                         {Eigen::Quaterniond::Identity(), {1, 2, 3}}),
                "g");
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_EQ(file->graph.poses[1].translation, Eigen::Vector3d(1, 2, 3));
}

TEST(G2o, WithVertexLinesSeveralComponentsAndFixAreFine) {
  const auto file = parse_g2o("FIX 5 2\nVERTEX_SE2 5 1 2 0\nVERTEX_SE2 2 3 4 0\n", "g");
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_EQ(file->vertex_ids, (std::vector<std::int64_t>{2, 5}));
  EXPECT_EQ(file->graph.poses[0].translation, Eigen::Vector3d(3, 4, 0));
  EXPECT_EQ(file->fixed, (std::vector<std::size_t>{0, 1}));
}

TEST(G2o, ErrorsSayWhereAndWhat) {
  EXPECT_EQ(message_of(""), "g.g2o: no vertex and no edge, expected a pose graph");
  EXPECT_EQ(message_of("\nVERTEX_XY 0 1 1"),
            "g.g2o: no vertex and no edge, expected a pose graph; lines of other kinds: 1 x VERTEX_XY");
  EXPECT_EQ(message_of("\nhello 0 1 1"),
            "g.g2o:2: tag is 'hello', expected one of g2o or TORO, as VERTEX_SE2, EDGE_SE2, VERTEX_SE3:QUAT, "
            "EDGE_SE3:QUAT or FIX");
  const std::string too_far = " m, expected at most 1e+09 m along each axis";
  EXPECT_EQ(message_of("VERTEX_SE2 0 1 1e300 0"), "g.g2o:1: position is (1, 1e+300, 0)" + too_far);
  EXPECT_EQ(message_of("VERTEX_SE3:QUAT 0 1 2e9 3 0 0 0 1"), "g.g2o:1: position is (1, 2e+09, 3)" + too_far);
  EXPECT_EQ(message_of("EDGE_SE2 0 1 -1e300 0 0 1 0 0 1 0 1"), "g.g2o:1: position is (-1e+300, 0, 0)" + too_far);
  EXPECT_EQ(message_of("VERTEX_SE2 0 1 1 1e308"), "g.g2o:1: angle is 1e+308 rad, expected at most 1e+06");
  EXPECT_EQ(message_of("EDGE_SE2 0 1 1 0 -2e6 1 0 0 1 0 1"), "g.g2o:1: angle is -2e+06 rad, expected at most 1e+06");
  EXPECT_EQ(message_of("VERTEX_SE2 0 1 1"), "g.g2o:1: row has 4 columns, expected 5 (VERTEX_SE2 id x y theta)");
  EXPECT_EQ(message_of("VERTEX_SE2 a 1 1 1"), "g.g2o:1: vertex id in column 2 is 'a', expected a 64-bit integer");
  EXPECT_EQ(message_of("VERTEX_SE2 0 1 inf 1"), "g.g2o:1: column 4 is 'inf', expected a finite number");
  EXPECT_EQ(message_of("VERTEX_SE2 0 0 0 0\nVERTEX_SE2 0 0 0 1"),
            "g.g2o:2: vertex 0 is at g.g2o:1 already, with another pose: expected ids of their own in each file");
  EXPECT_EQ(message_of("VERTEX_SE2 0 0 0 0\nEDGE_SE2 0 1 1 0 0 1 0 0 1 0 1"),
            "g.g2o:2: edge: names vertex 1, which is not in the file");
  EXPECT_EQ(message_of("EDGE_SE2 3 3 1 0 0 1 0 0 1 0 1"), "g.g2o:1: edge from vertex 3 to itself");
  const std::string positive = ", expected a positive one";
  EXPECT_EQ(message_of("EDGE_SE2 0 1 1 0 0 -1 0 0 -3 0 -2"),
            "g.g2o:1: eigenvalues of the information are -3 to -1" + positive);
  EXPECT_EQ(message_of("EDGE_SE2 0 1 1 0 0 0 0 0 0 0 -1"),
            "g.g2o:1: eigenvalues of the information are -1 to 0" + positive);
  EXPECT_EQ(message_of("EDGE_SE2 0 1 1 0 0 1 nan 0 1 0 1"), "g.g2o:1: column 8 is 'nan', expected a finite number");
  EXPECT_EQ(
      message_of("EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\nEDGE_SE2 2 3 1 0 0 1 0 0 1 0 1\nEDGE_SE2 5 4 1 0 0 1 0 0 1 0 1"),
      "g.g2o: no VERTEX lines and 3 connected components, expected 1 to chain poses in");
  EXPECT_EQ(message_of("VERTEX_SE2 0 0 0 0\nVERTEX_SE3:QUAT 1 0 0 0 0 0 0 1"),
            "g.g2o:2: tag is VERTEX_SE3:QUAT after lines of the other dimension, expected one of both");
  EXPECT_EQ(message_of("VERTEX_SE3:QUAT 1 0 0 0 0 0 0 2"), "g.g2o:1: quaternion has norm 2, expected 1 within 0.01");
  EXPECT_EQ(message_of("VERTEX_SE2 0 0 0 0\nFIX 1"), "g.g2o: FIX: names vertex 1, which is not in the file");
}

TEST(G2o, SingularInformationIsFine) {
  const auto file = parse_g2o("EDGE_SE2 0 1 1 0 0 1 1 0 1 0 0", "g");
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_EQ(file->graph.edges[0].information.diagonal(), (Vector6d() << 1, 1, 1, 1, 1, 0).finished());
}

/// Published graphs have such matrices. The nearest semidefinite one is taken: nothing is nearer, whatever the
/// direction one goes in from there.
RC_GTEST_PROP(G2o, IndefiniteInformationBecomesTheNearestSemidefinite, ()) {
  const bool is_2d = *rc::gen::arbitrary<bool>();
  const int size = is_2d ? 3 : 6;
  Eigen::MatrixXd given(size, size);
  for (int i = 0; i < given.size(); ++i) given(i) = any_double(1.0);
  given = (given + given.transpose()).eval();
  given(0, 0) = given(1, 1) = 1.0;  // so that its eigenvalues reach from -1 or less to 3 or more
  given(0, 1) = given(1, 0) = 2.0 + std::abs(given(0, 1));
  const Eigen::VectorXd values = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(given).eigenvalues();
  std::string text = is_2d ? "EDGE_SE2 0 1 1 0 0" : "EDGE_SE3:QUAT 0 1 1 0 0 0 0 0 1";
  for (int i = 0; i < size; ++i)
    for (int j = i; j < size; ++j) text += fmt::format(" {}", given(i, j));
  const auto file = parse_g2o(text, "g");
  RC_ASSERT(file.has_value());
  RC_ASSERT(file->indefinite_edges == 1U);
  RC_ASSERT(std::abs(file->worst_indefinite_share + values(0) / values(size - 1)) < 1e-9);
  Eigen::MatrixXd taken = file->graph.edges[0].information;
  if (is_2d) {
    const std::array<int, 3> plane = {0, 1, 5};
    taken = Eigen::MatrixXd(taken(plane, plane));
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(taken);
  RC_ASSERT(eigen.eigenvalues().minCoeff() > 0.0);  // the solver wants every direction determined
  RC_ASSERT(std::abs((taken - given).norm() - values.cwiseMin(0.0).norm()) < 1e-7 * values.norm());
  const auto again = parse_g2o(to_g2o(*file), "g");
  RC_ASSERT(again.has_value());
  RC_ASSERT(again->indefinite_edges == 0U);
}

TEST(G2o, SurvivesAnyBytes) {
  const auto is_sound = [](const G2oFile& file) {
    const auto valid = [](const Pose3& pose) { return is_valid(pose, 1e-9); };
    return file.graph.poses.size() == file.vertex_ids.size() &&
           std::all_of(file.graph.poses.begin(), file.graph.poses.end(), valid) &&
           std::all_of(file.graph.edges.begin(), file.graph.edges.end(), [&](const PoseGraphEdge& edge) {
             return edge.from < file.graph.poses.size() && edge.to < file.graph.poses.size() && edge.from != edge.to &&
                    valid(edge.T_from_to) && edge.information.allFinite();
           });
  };
  internal::expect_survives<G2oFile>(
      "VERTEX_SE2 0 1 2 .5\nVERTEX_SE2 1 2 2 .6\nFIX 0\nEDGE_SE2 0 1 1 .5 .1 10 .1 0 10 0 100\n", parse_g2o, is_sound);
  internal::expect_survives<G2oFile>("EDGE_SE2 0 1 1 .5 .1 10 .1 0 10 0 100\nEDGE_SE2 1 2 1 .5 .1 10 .1 0 10 0 100\n",
                                     parse_g2o, is_sound);
  internal::expect_survives<G2oFile>(edge_se3(0, 1, {}) + edge_se3(1, 2, {}) + edge_se3(2, 0, {}), parse_g2o, is_sound);
}

TEST(G2o, WritesPoseGraphs) {
  const G2oFile file = {.graph = {.poses = {{}, {Eigen::Quaterniond(0.6, 0, 0.8, 0), {1, 2, 3}}},
                                  .edges = {{0, 1, {Eigen::Quaterniond(0.6, 0, 0.8, 0), {1, 2, 3}}}}},
                        .vertex_ids = {0, 1}};
  const std::string path = testing::TempDir() + "tutti_g2o_test.g2o";
  ASSERT_TRUE(write_g2o(path, file.graph));
  EXPECT_TRUE(same(read_g2o(path).value(), file));
}

struct RealGraph {
  const char* path;
  std::size_t poses, edges, closures;
  bool is_2d, has_vertices;
  std::size_t repeated = 0;
};

/// Counts of data/SOURCES-lidar-kitti-graphs-bags.md, where an edge that is there twice counts twice.
TEST(G2o, RealFiles) {
  TUTTI_REQUIRE_SHARED("data/g2o");
  const std::vector<RealGraph> graphs = {
      {"g2o/sphere2500.g2o", 2500, 4949, 2450, false, true},
      {"g2o/torus3D.g2o", 5000, 9048, 4049, false, true},
      {"g2o/parking-garage.g2o", 1661, 6275, 4615, false, true},
      {"g2o/smallGrid3D.g2o", 125, 297, 173, false, true},
      {"g2o/intel.g2o", 1728, 2512, 785, true, true},
      {"g2o/manhattan.g2o", 3500, 5453, 1954, true, false},
      {"g2o/kitti_00.g2o", 4541, 4676, 136, true, false, 1},
      {"multi_robot/csail_two_robots/CSAIL.g2o", 1045, 1171, 127, true, false, 1},
      {"multi_robot/csail_two_robots/CSAIL_robot1.g2o", 523, 522, 0, true, false},
      {"multi_robot/csail_two_robots/CSAIL_robot2.g2o", 522, 521, 0, true, false},
  };
  for (const RealGraph& expected : graphs) {
    const auto file = read_g2o(test::shared_path(std::string("data/") + expected.path));
    ASSERT_TRUE(file) << file.error().message;
    EXPECT_EQ(file->graph.poses.size(), expected.poses) << expected.path;
    EXPECT_EQ(file->graph.edges.size(), expected.edges) << expected.path;
    EXPECT_EQ(file->repeated_edges, expected.repeated) << expected.path;
    EXPECT_EQ(file->is_2d, expected.is_2d) << expected.path;
    EXPECT_EQ(file->has_vertices, expected.has_vertices) << expected.path;
    std::size_t closures = 0;
    for (const auto& edge : file->graph.edges) {
      const bool is_closure = file->vertex_ids[edge.to] != file->vertex_ids[edge.from] + 1;
      closures += is_closure ? 1 : 0;
      if (!is_closure && !file->has_vertices) {  // chained along its odometry
        EXPECT_LT(local(edge.T_from_to, file->graph.poses[edge.from].inverse() * file->graph.poses[edge.to]).norm(),
                  1e-6);
      }
    }
    EXPECT_EQ(closures, expected.closures) << expected.path;
    if (!expected.is_2d) {
      EXPECT_TRUE(same(parse_g2o(to_g2o(*file), "g").value(), *file)) << expected.path;
    }
  }
}

TEST(G2o, ClosuresAloneAreNotOneGraph) {
  TUTTI_REQUIRE_SHARED("data/multi_robot");
  const auto file = read_g2o(test::shared_path("data/multi_robot/csail_two_robots/CSAIL_interrobot_loop_closures.g2o"));
  ASSERT_FALSE(file);
  EXPECT_NE(file.error().message.find("connected components, expected 1"), std::string::npos) << file.error().message;
}

TEST(G2o, EdgesAreReadOfGraphsThatAreNotConnected) {
  const std::string apart = "EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\nEDGE_SE2 7 6 2 0 0 1 0 0 1 0 1";
  EXPECT_FALSE(parse_g2o(apart, "g.g2o"));
  const auto file = parse_g2o_edges(apart, "g.g2o");
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_EQ(file->vertex_ids, (std::vector<std::int64_t>{0, 1, 6, 7}));
  EXPECT_FALSE(file->has_vertices);
  EXPECT_EQ(file->graph.edges[1].from, 3U);
  EXPECT_EQ(file->graph.edges[1].T_from_to.translation.x(), 2.0);
  EXPECT_EQ(file->graph.poses, std::vector<Pose3>(4));
}

}  // namespace g2o_test
}  // namespace tutti::formats
