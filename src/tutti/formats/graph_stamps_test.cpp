// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/graph_stamps.hpp"

#include <gtest/gtest.h>

namespace tutti::formats {
namespace graph_stamps_test {

TEST(GraphStamps, ReadsWhatAMissionWrites) {
  const auto stamps = parse_graph_stamps("id,robot,keyframe,stamp_ns\n0,1,0,1700000000123456789\n7,2,3,-5\n", "x");
  ASSERT_TRUE(stamps) << stamps.error().message;
  ASSERT_EQ(stamps->size(), 2U);
  EXPECT_EQ((*stamps)[0], (VertexStamp{0, {RobotId{1}, 0}, {1'700'000'000'123'456'789}}));
  EXPECT_EQ((*stamps)[1], (VertexStamp{7, {RobotId{2}, 3}, {-5}}));
  EXPECT_TRUE(parse_graph_stamps("", "x")->empty());
}

TEST(GraphStamps, WhatIsWrittenIsRead) {
  const std::vector<VertexStamp> stamps{{0, {RobotId{1}, 0}, {1'700'000'000'123'456'789}}, {7, {RobotId{2}, 3}, {-5}}};
  const std::string path = testing::TempDir() + "tutti_graph_stamps.csv";
  ASSERT_TRUE(write_graph_stamps(path, stamps));
  EXPECT_EQ(read_graph_stamps(path), stamps);
}

TEST(GraphStamps, SaysWhatIsWrongAndWhere) {
  for (const char* bad : {"0,1,2\n", "0,1,2,3,4\n", "0,one,2,3\n", "0,-1,2,3\n", "0,4294967296,2,3\n", "0,1,2.5,3\n",
                          "0,1,2,9223372036854775807\n", "0,1,2,nan\n"}) {
    const auto stamps = parse_graph_stamps(std::string("id,robot,keyframe,stamp_ns\n") + bad, "graph_stamps.csv");
    ASSERT_FALSE(stamps) << bad;
    EXPECT_NE(stamps.error().message.find("graph_stamps.csv:2: "), std::string::npos) << stamps.error().message;
  }
  EXPECT_FALSE(read_graph_stamps("/nonexistent/graph_stamps.csv"));
}

}  // namespace graph_stamps_test
}  // namespace tutti::formats
