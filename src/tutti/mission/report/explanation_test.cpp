// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/report/explanation.hpp"

#include <gtest/gtest.h>

namespace tutti::mission {
namespace explanation_test {

TEST(Words, OfAnOrigin) {
  EXPECT_EQ(format_time_s(12.34), "12.3 s");
  EXPECT_EQ(format_time_s(1259.96), "1260.0 s");
  EXPECT_EQ(format_origin_size({.length_m = 3.26, .translation_m = 0.5, .rotation_rad = 0.1}),
            "0.50 m, 5.73 deg over 3.26 m");
  consistency::Explanation e;
  e.scale_length_m = {1280.0, 31.7, 2.04};
  EXPECT_EQ(format_scale(e, 0), "1.28 km");
  EXPECT_EQ(format_scale(e, 1), "32 m");
  EXPECT_EQ(format_scale(e, 2), "2.0 m");
  EXPECT_EQ(format_scale(e, 3), "-");
  EXPECT_EQ(format_significance(1.04), "1.0 x");
  EXPECT_EQ(format_significance(12.6), "13 x");
}

}  // namespace explanation_test
}  // namespace tutti::mission
