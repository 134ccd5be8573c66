// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/fix_file.hpp"

#include <gtest/gtest.h>

namespace tutti::formats::fix_file_test {
namespace {

TEST(FixFile, ReadsColumnsByTheirNames) {
  const auto plain =
      parse_fixes("stamp_s,latitude_deg,longitude_deg,height_m\n# later\n1.5,46.5,7.9,600\n2.5,-46,180,0\n", "a.csv");
  ASSERT_TRUE(plain.has_value()) << plain.error().message;
  ASSERT_EQ(plain->size(), 2U);
  EXPECT_EQ((*plain)[0].stamp.ns, 1'500'000'000);
  EXPECT_EQ((*plain)[0].antenna, (Geodetic{46.5, 7.9, 600}));
  EXPECT_EQ((*plain)[0].covariance, unknown_fix_covariance());
  const auto sure = parse_fixes(
      "height_m,stamp_s,sigma_up_m,latitude_deg,sigma_east_m,longitude_deg,sigma_north_m\n600,1.5,4,46.5,2,7.9,3\n",
      "a.csv");
  ASSERT_TRUE(sure.has_value()) << sure.error().message;
  EXPECT_EQ((*sure)[0].antenna, (Geodetic{46.5, 7.9, 600}));
  EXPECT_EQ((*sure)[0].covariance.diagonal(), Eigen::Vector3d(4, 9, 16));
}

TEST(FixFile, SaysWhatIsWrongAndWhere) {
  const std::string header = "stamp_s,latitude_deg,longitude_deg,height_m\n";
  const auto error = [](const std::string& text) {
    const auto read = parse_fixes(text, "a.csv");
    return read ? std::string("taken") : read.error().message;
  };
  const auto has = [](const std::string& message, const std::string& part) {
    return message.find(part) != std::string::npos;
  };
  EXPECT_TRUE(has(error(""), "expected the names of columns"));
  EXPECT_TRUE(has(error("1,2,3,4\n"), "column '1'"));
  EXPECT_TRUE(has(error("stamp_s,latitude_deg,height_m\n"), "no column longitude_deg"));
  EXPECT_TRUE(has(error("stamp_s,latitude_deg,longitude_deg,height_m,sigma_up_m\n"), "no column sigma_east_m"));
  EXPECT_EQ(error(header + "1,91,0,0\n"), "a.csv:2: latitude 91 degrees, expected -90 to 90");
  EXPECT_TRUE(has(error(header + "1,nan,0,0\n"), "a.csv:2"));
  EXPECT_TRUE(has(error(header + "2,1,1,1\n2,1,1,1\n"), "a.csv:3: stamp 2.000000000 does not follow"));
  EXPECT_TRUE(has(error(header + "2,1,1\n"), "a.csv:2"));
  EXPECT_TRUE(has(error("stamp_s,latitude_deg,longitude_deg,height_m,sigma_east_m,sigma_north_m,sigma_up_m\n"
                        "1,1,1,1,0,1,1\n"),
                  "variance 0"));
}

}  // namespace
}  // namespace tutti::formats::fix_file_test
