// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/report/explanation.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "support/mission/report/explanation_example.hpp"

namespace tutti::mission {
namespace explanation_test {

/// One pose a second along x, 1 m apart.
Trajectory line(std::size_t poses) {
  Trajectory out;
  for (std::size_t i = 0; i < poses; ++i)
    out.push_back(
        {Timestamp{} + static_cast<double>(i), {Eigen::Quaterniond::Identity(), {static_cast<double>(i), 0.0, 0.0}}});
  return out;
}

double lightness(formats::Rgb c) { return 0.2126 * c.red + 0.7152 * c.green + 0.0722 * c.blue; }

formats::Rgb pixel(const RgbaImage& image, std::size_t row, std::size_t column) {
  const std::uint8_t* at = &image.rgba[4 * (row * image.width + column)];
  return {at[0], at[1], at[2]};
}

bool same(formats::Rgb a, formats::Rgb b) { return a.red == b.red && a.green == b.green && a.blue == b.blue; }

TEST(SignificanceColour, BrighterIsMoreAndTheThresholdIsAStepToRed) {
  double before = -1.0;
  for (double s = 0.12; s < kMostShown; s *= 1.07) {
    const double now = lightness(significance_colour(s));
    if (!(s > 1.0 && s < 1.08)) {
      EXPECT_GE(now, before) << s;
    }
    before = now;
  }
  EXPECT_GT(significance_colour(0.99).blue, significance_colour(0.99).red);
  EXPECT_GT(significance_colour(1.01).red, 2 * significance_colour(1.01).blue);
  EXPECT_TRUE(same(significance_colour(10.0), significance_colour(1e9)));
  EXPECT_TRUE(same(significance_colour(0.0), significance_colour(std::numeric_limits<double>::quiet_NaN())));
}

TEST(SignificanceImage, EveryNodeIsWhereItsTimeIs) {
  consistency::Explanation e = test::example_explanation(line(11), {});
  e.significance.setConstant(0.5);
  e.significance(6, 2) = 4.0;
  Range time_s;
  time_s.include(100.0);
  time_s.include(120.0);  // the second half is beyond the last node
  const RgbaImage image = significance_image(e, {Timestamp{}, 100.0}, time_s, 200, 3);
  ASSERT_EQ(image.height, 3U * 6U);
  for (std::size_t row = 0; row < image.height; ++row)
    for (std::size_t column = 0; column < 200; ++column) {
      const bool hot = row / 3 == 2 && column >= 55 && column <= 65;  // 105.5 s to 106.5 s
      if (column <= 100) {
        EXPECT_TRUE(same(pixel(image, row, column), significance_colour(hot ? 4.0 : 0.5))) << row << " " << column;
      }
      EXPECT_EQ(image.rgba[4 * (row * 200 + column) + 3], column <= 100 ? 255 : 0);
    }
}

TEST(SignificanceImage, WhenNodesShareAColumnTheWorstIsSeen) {
  consistency::Explanation e = test::example_explanation(line(1000), {});
  e.significance.setConstant(0.2);
  e.significance(501, 0) = 7.0;
  Range time_s;
  time_s.include(0.0);
  time_s.include(999.0);
  const RgbaImage image = significance_image(e, {}, time_s, 10, 1);
  EXPECT_TRUE(same(pixel(image, 0, 5), significance_colour(7.0)));
  EXPECT_TRUE(same(pixel(image, 0, 4), significance_colour(0.2)));
}

TEST(Overlapping, TheTrueOriginWithTheLongestCommonTime) {
  const auto at = [](double s) { return Timestamp{} + s; };
  const std::vector<DriftOrigin> truth{{DriftOrigin::Kind::slip, at(10), at(11)},
                                       {DriftOrigin::Kind::failure, at(11), at(30)}};
  const consistency::SuspectedOrigin origin{.from = at(9), .until = at(14)};
  EXPECT_EQ(overlapping(origin, truth)->kind, DriftOrigin::Kind::failure);
  EXPECT_FALSE(overlapping({.from = at(31), .until = at(40)}, truth));
  EXPECT_EQ(overlapping({.from = at(5), .until = at(10)}, truth)->kind, DriftOrigin::Kind::slip);  // they touch
}

TEST(Words, OfAnOrigin) {
  EXPECT_EQ(format_moment(12.34), "12.3 s");
  EXPECT_EQ(format_moment(1259.96), "1260.0 s");
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
