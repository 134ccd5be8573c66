// SPDX-License-Identifier: BSD-3-Clause
// Graphs as other optimisers write them.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <fstream>

#include "tutti/formats/g2o.hpp"

namespace tutti::formats {
namespace g2o_others_test {

TEST(OthersGraphs, LinesOfOtherOptimisersAreLeftOutAndCounted) {
  const std::string poses = "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0\nEDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\n";
  const auto file = parse_g2o("PARAMS_SE2OFFSET 0 0 0 0\n" + poses +
                                  "VERTEX_XY 7 1 2\nEDGE_SE2_XY 0 7 1 2 1 0 1\nEDGE_SE2_XY 1 7 0 2 1 0 1\n"
                                  "EDGE_PRIOR_SE2 0 0 0 0 1 0 0 1 0 1\nROBOTLASER1 0 -1.57 3.14 0.0174\n",
                              "g");
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_EQ(file->graph.poses.size(), 2U);
  EXPECT_EQ(file->graph.edges.size(), 1U);
  EXPECT_EQ(counted(file->left_out),
            "1 x EDGE_PRIOR_SE2, 2 x EDGE_SE2_XY, 1 x PARAMS_SE2OFFSET, 1 x ROBOTLASER1, 1 x VERTEX_XY");
  EXPECT_EQ(parse_g2o(poses, "g")->left_out.size(), 0U);
  EXPECT_EQ(parse_g2o("// made by\n% hand\n" + poses, "g")->left_out.size(), 0U);
  const auto fixed = parse_g2o(poses + "VERTEX_XY 7 1 2\nFIX 7\nFIX 0\n", "g");
  ASSERT_TRUE(fixed) << fixed.error().message;
  EXPECT_EQ(counted(fixed->left_out), "1 x FIX, 1 x VERTEX_XY");
  EXPECT_EQ(fixed->fixed.size(), 1U);
}

TEST(OthersGraphs, SeveralFilesAreOneGraphAndAnEdgeInBothCountsOnce) {
  const auto key = [](char robot, int number) { return std::to_string((std::int64_t{robot} << 56) + number); };
  const auto edge = [](const std::string& from, const std::string& to, double x) {
    return "EDGE_SE2 " + from + " " + to + " " + std::to_string(x) + " 0 0 1 0 0 1 0 1\n";
  };
  const std::string between = edge(key('a', 1), key('b', 0), 5.0);
  const std::vector<std::string> texts = {
      "VERTEX_SE2 " + key('a', 0) + " 0 0 0\nVERTEX_SE2 " + key('a', 1) + " 1 0 0\n" +
          edge(key('a', 0), key('a', 1), 1.0) + between,
      "VERTEX_SE2 " + key('b', 0) + " 6 0 0\n" + between + edge(key('a', 1), key('b', 0), 5.5)};
  std::vector<std::string> paths;
  for (const std::string& text : texts) {
    paths.push_back(testing::TempDir() + "tutti_g2o_robot" + std::to_string(paths.size()) + ".g2o");
    std::ofstream(paths.back()) << text;
  }
  const auto both = read_g2o(paths);
  ASSERT_TRUE(both) << both.error().message;
  EXPECT_EQ(both->graph.poses.size(), 3U);
  EXPECT_EQ(both->graph.edges.size(), 3U);
  EXPECT_EQ(both->repeated_edges, 1U);
  const auto one = read_g2o(paths[0]);
  ASSERT_FALSE(one);
  EXPECT_EQ(one.error().message, paths[0] +
                                     ":4: edge: names vertex b0, which is not in the file; give the file that has "
                                     "robot b, too: several files are one graph");
}

TEST(OthersGraphs, ToroIsTheSameGraph) {
  const auto toro = parse_g2o("VERTEX2 0 0 0 0\nVERTEX2 1 1 2 0.5\nEDGE2 0 1 1 2 0.5 4 0.1 5 6 0.2 0.3\n", "g");
  const auto g2o = parse_g2o("VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 2 0.5\nEDGE_SE2 0 1 1 2 0.5 4 0.1 0.2 5 0.3 6\n", "g");
  ASSERT_TRUE(toro && g2o);
  EXPECT_EQ(toro->graph.poses[1], g2o->graph.poses[1]);
  EXPECT_EQ(toro->graph.edges[0].T_from_to, g2o->graph.edges[0].T_from_to);
  EXPECT_EQ(toro->graph.edges[0].information, g2o->graph.edges[0].information);
  const std::string information = " 1 0 0 0 0 0 2 0 0 0 0 3 0 0 0 4 0 0 5 0 6\n";
  const auto toro_3d =
      parse_g2o("VERTEX3 0 0 0 0 0 0 0\nVERTEX3 1 1 2 3 0.1 -0.2 0.3\nEDGE3 0 1 1 2 3 0.1 -0.2 0.3" + information, "g");
  ASSERT_TRUE(toro_3d) << toro_3d.error().message;
  const Eigen::Matrix3d R =
      (Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(-0.2, Eigen::Vector3d::UnitY()) *
       Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX()))
          .toRotationMatrix();
  EXPECT_LT((toro_3d->graph.poses[1].rotation.toRotationMatrix() - R).norm(), 1e-12);
  EXPECT_EQ(toro_3d->graph.edges[0].information(5, 5), 6.0);
  EXPECT_FALSE(toro_3d->is_2d);
}

TEST(OthersGraphs, WhatIsNoGraphIsNamedWithWhatExports) {
  const std::string path = testing::TempDir() + "tutti_others_graphs_test";
  std::ofstream(path) << "\xdb\x01\xf5\x5b\x7b\x1f\x1d\x7b"
                      << "and so on";
  for (const std::string& message : {read_g2o(path).error().message, read_g2o_edges(path).error().message})
    EXPECT_NE(message.find("is a state of Cartographer (.pbstream), expected a pose graph"), std::string::npos)
        << message;
}

}  // namespace g2o_others_test
}  // namespace tutti::formats
