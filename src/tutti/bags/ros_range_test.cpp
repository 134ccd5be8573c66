// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/ros_range.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "support/bags/bag_writer.hpp"

namespace tutti::bags {
namespace ros_range_test {

TEST(RosRange, ATopicSaysToWhichRobotItIs) {
  EXPECT_EQ(ranged_robot("/alpha/range_to/bravo"), "bravo");
  EXPECT_EQ(ranged_robot("range_to/bravo"), "bravo");
  for (const char* other : {"/alpha/sonar", "/alpha/range_to", "/alpha/range_to/", "/alpha/range_to/bravo/raw",
                            "/alpha/my_range_to/bravo", ""})
    EXPECT_EQ(ranged_robot(other), "") << other;
}

TEST(RosRange, IsWhatItsSenderStates) {
  const auto range = to_range({{{5}, "uwb"}, 0.1F, 50.0F, 12.5F, 0.04F}, "bravo");
  ASSERT_TRUE(range && *range);
  EXPECT_EQ((*range)->stamp, Timestamp{5});
  EXPECT_EQ((*range)->distance_m, 12.5);
  EXPECT_NEAR((*range)->sigma_m, 0.2, 1e-6);
  EXPECT_EQ((*range)->name, "bravo");
  EXPECT_EQ(to_range({{{5}, ""}, 0.0F, 0.0F, 12.5F, 0.0F}, "bravo").value()->sigma_m, 0.0);
}

/// ROS 2 before Jazzy, and ROS 1, have no variance.
TEST(RosRange, OfEitherDefinitionIsRead) {
  using test::range;
  const std::string whole = range(12.5F, 0.04F), before = whole.substr(0, whole.size() - 4);
  EXPECT_EQ(decode_range(whole).value().variance, 0.04F);
  EXPECT_EQ(decode_range(before).value().variance, 0.0F);
  EXPECT_EQ(decode_range(before).value().range_m, 12.5F);
  for (std::size_t size = 0; size < before.size(); ++size)
    EXPECT_FALSE(decode_range(whole.substr(0, size)).has_value()) << size;
  EXPECT_FALSE(decode_range(whole + std::string(4, '\0')).has_value());
}

TEST(RosRange, BeyondItsLimitsThereIsNone) {
  EXPECT_FALSE(to_range({{{5}, ""}, 0.1F, 50.0F, 60.0F, 0.0F}, "bravo").value());
  EXPECT_FALSE(to_range({{{5}, ""}, 0.1F, 50.0F, std::numeric_limits<float>::infinity(), 0.0F}, "bravo").value());
  EXPECT_FALSE(to_range({{{5}, ""}, 0.1F, 50.0F, std::numeric_limits<float>::quiet_NaN(), 0.0F}, "bravo").has_value());
  EXPECT_FALSE(to_range({{{5}, ""}, 0.0F, 0.0F, -1.0F, 0.0F}, "bravo").has_value());
}

}  // namespace ros_range_test
}  // namespace tutti::bags
