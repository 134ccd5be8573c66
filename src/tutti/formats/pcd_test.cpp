// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/pcd.hpp"

#include <gtest/gtest.h>
// RapidCheck after gtest.
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>

#include "support/formats/mutations.hpp"
#include "support/shared_data.hpp"
#include "tutti/formats/internal/points.hpp"

namespace tutti::formats {
namespace pcd_test {

PointCloud any_cloud() {
  PointCloud cloud;
  const int size = *rc::gen::inRange(0, 20);
  for (int i = 0; i < size; ++i)
    cloud.points.push_back(
        Eigen::Vector3d(internal::any_double(), internal::any_double(), internal::any_double()).cast<float>());
  return cloud;
}

std::string header(const std::string& fields, const std::string& sizes, const std::string& types,
                   const std::string& counts, std::size_t points, const std::string& data) {
  return fmt::format(
      "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS {}\nSIZE {}\nTYPE {}\nCOUNT {}\nWIDTH {}\n"
      "HEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {}\nDATA {}\n",
      fields, sizes, types, counts, points, points, data);
}

std::string to_pcd(const PointCloud& cloud) { return formats::to_pcd(cloud.points); }

Result<PointCloud> parse_pcd(std::string_view bytes, const std::string& name) {
  return parse_timed_pcd(bytes, name).map([](TimedCloud&& timed) { return std::move(timed.cloud); });
}

RC_GTEST_PROP(Pcd, BinaryReadsBackBitForBit, ()) {
  const PointCloud cloud = any_cloud();
  RC_ASSERT(parse_pcd(to_pcd(cloud), "p").value() == cloud);
}

RC_GTEST_PROP(Pcd, AsciiSaysTheSameAsBinary, ()) {
  const PointCloud cloud = any_cloud();
  std::string text = header("i x y z", "4 4 4 4", "F F F F", "1 1 1 1", cloud.points.size(), "ascii");
  for (const auto& p : cloud.points) text += fmt::format("nan {} {} {}\n", p.x(), p.y(), p.z());
  RC_ASSERT(parse_pcd(text, "p").value() == cloud);
}

RC_GTEST_PROP(Pcd, CoordinatesAreFoundAmongAnyOtherFields, ()) {
  const PointCloud cloud = any_cloud();
  std::string bytes = header("t z label x y", "8 8 1 4 8", "F F U F F", "1 1 5 1 1", cloud.points.size(), "binary");
  for (const auto& p : cloud.points) {
    internal::put(bytes, 1e300);
    internal::put(bytes, static_cast<double>(p.z()));
    bytes += "\n#\xff\n ";
    internal::put(bytes, p.x());
    internal::put(bytes, static_cast<double>(p.y()));
  }
  RC_ASSERT(parse_pcd(bytes, "p").value() == cloud);
}

/// PCL's binary_compressed: two sizes, then LZF (here of literals alone) of all values of one field after the other.
std::string compressed(const std::vector<std::string>& columns) {
  std::string values, coded, bytes;
  for (const std::string& column : columns) values += column;
  for (std::size_t at = 0; at < values.size(); at += 32) {
    const std::string literals = values.substr(at, 32);
    coded += static_cast<char>(literals.size() - 1) + literals;
  }
  internal::put(bytes, static_cast<std::uint32_t>(coded.size()));
  internal::put(bytes, static_cast<std::uint32_t>(values.size()));
  return bytes + coded;
}

RC_GTEST_PROP(Pcd, CompressedSaysTheSameAsBinary, ()) {
  const PointCloud cloud = any_cloud();
  std::vector<std::string> columns(5);
  for (const auto& p : cloud.points) {
    internal::put(columns[0], p.z());
    columns[1] += "\x01\x02\xff";
    internal::put(columns[2], static_cast<double>(p.x()));
    internal::put(columns[3], p.y());
    internal::put(columns[4], std::uint32_t{7});
  }
  const std::string bytes =
      header("z rgb x y t", "4 1 8 4 4", "F U F F U", "1 3 1 1 1", cloud.points.size(), "binary_compressed") +
      compressed(columns) + *rc::gen::arbitrary<std::string>();
  const auto read = parse_timed_pcd(bytes, "p");
  RC_ASSERT(read.has_value());
  RC_ASSERT(read->cloud == cloud);
  RC_ASSERT(read->times == std::vector<double>(cloud.points.size(), 7.0));
}

TEST(Pcd, BytesAfterThePointsArePassedOver) {  // PCL fills a file up to a whole page
  const PointCloud cloud{{{1, 2, 3}, {4, 5, 6}}};
  for (const std::size_t more : {1U, 11U, 12U, 4000U})
    EXPECT_EQ(parse_pcd(to_pcd(cloud) + std::string(more, '\0'), "p").value(), cloud) << more;
}

TEST(Pcd, TimesAreThoseOfTheirPoints) {
  const std::string types[] = {"F", "I", "U"};
  const auto put_time = [](std::string& bytes, const std::string& type, int size, double time) {
    if (type == "F") return size == 8 ? internal::put(bytes, time) : internal::put(bytes, static_cast<float>(time));
    const auto whole = static_cast<std::int64_t>(time);
    return size == 8 ? internal::put(bytes, whole) : internal::put(bytes, static_cast<std::int32_t>(whole));
  };
  for (const int size : {4, 8})
    for (const std::string& type : types) {
      const std::string kinds = fmt::format("F F {} F U", type), sizes = fmt::format("4 4 {} 4 1", size);
      std::string bytes = header("x y offset_time z time", sizes, kinds, "1 1 1 1 1", 3, "binary");
      for (const float x : {1.0F, std::numeric_limits<float>::quiet_NaN(), 3.0F}) {
        internal::put(bytes, x);
        internal::put(bytes, 0.0F);
        put_time(bytes, type, size, std::isnan(x) ? 99.0 : x * 1000.0);
        internal::put(bytes, 0.0F);
        bytes += '\x05';  // too small to be a time
      }
      const auto read = parse_timed_pcd(bytes, "p");
      ASSERT_TRUE(read) << read.error().message;
      EXPECT_EQ(read->time_field, "offset_time");
      EXPECT_EQ(read->times, (std::vector<double>{1000.0, 3000.0})) << type << size;
    }
  const auto ascii = parse_timed_pcd(
      header("t x y z", "8 4 4 4", "U F F F", "1 1 1 1", 1, "ascii") + "1700000000000000000 1 2 3\n", "p");
  EXPECT_EQ(ascii->times, (std::vector<double>{1.7e18}));
  EXPECT_EQ(parse_timed_pcd(to_pcd({{{1, 2, 3}}}), "p")->time_field, "");
}

TEST(Pcd, FilesAsPeopleHaveThem) {
  const PointCloud cloud{{{1, 2, 3}, {4, 5, 6}}};
  // Spaces and tabs, Windows line ends, no COUNT, no comment, points that are not there, one column of padding.
  EXPECT_EQ(parse_pcd("VERSION .7\r\nFIELDS x y z _\r\nSIZE 4 4 4 1\r\nTYPE F F F U\r\nWIDTH 3\r\nHEIGHT 1\r\n"
                      "VIEWPOINT 1 2 3 1 0 0 0\r\nPOINTS 3\r\nDATA ascii\r\n  1 2\t3   0 \r\nnan -nan nan 0\r\n"
                      "\r\n4.0e0 +5 6 0\r\n",
                      "p")
                .value(),
            cloud);
  // PCL's own points of 32 bytes, in one row of an organised cloud.
  std::string padded =
      header("x y z _ intensity ring _", "4 4 4 1 4 2 1", "F F F U F U U", "1 1 1 4 1 1 10", 2, "binary");
  for (const auto& p : cloud.points) {
    for (int axis = 0; axis < 3; ++axis) internal::put(padded, p[axis]);
    padded += std::string(20, '\x7f');
  }
  EXPECT_EQ(parse_pcd(padded, "p").value(), cloud);
}

TEST(Pcd, DropsNonFinitePoints) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  const PointCloud cloud{{{1, 2, 3}, {nan, 0, 0}, {0, inf, 0}, {0, 0, -inf}, {4, 5, 6}}};
  EXPECT_EQ(parse_pcd(to_pcd(cloud), "p").value(), (PointCloud{{{1, 2, 3}, {4, 5, 6}}}));
  EXPECT_EQ(parse_pcd(header("x y z", "8 8 8", "F F F", "1 1 1", 3, "ascii") + "1 2 3\n1e300 0 0\nnan nan nan\n", "p")
                .value(),
            (PointCloud{{{1, 2, 3}}}));
}

TEST(Pcd, OrganisedCloudsHaveWidthTimesHeightPoints) {
  std::string text = header("x y z", "4 4 4", "F F F", "1 1 1", 2, "ascii") + "1 2 3\n4 5 6\n";
  text.replace(text.find("WIDTH 2\nHEIGHT 1"), 16, "WIDTH 1\nHEIGHT 2");
  EXPECT_EQ(parse_pcd(text, "p")->points.size(), 2U);
}

TEST(Pcd, ErrorsSayWhatIsWrong) {
  const auto message = [](const std::string& bytes) {
    const auto result = parse_pcd(bytes, "s.pcd");
    return result ? std::string("no error") : result.error().message;
  };
  const std::string good = to_pcd({{{1, 2, 3}, {4, 5, 6}}});
  EXPECT_EQ(message(good.substr(0, good.size() - 1)), "s.pcd: 23 bytes of data, expected 2 points of 12 bytes");
  std::string contradicting = good;
  contradicting.replace(contradicting.find("POINTS 2"), 8, "POINTS 1");
  EXPECT_EQ(message(contradicting), "s.pcd: POINTS is 1, expected WIDTH x HEIGHT = 2");
  EXPECT_EQ(message(""), "s.pcd: no DATA line, expected a PCD v0.7 header");
  EXPECT_EQ(message(header("x y z", "4 4 4", "F F F", "1 1 1", 2, "binary_lzma")),
            "s.pcd:11: DATA is 'binary_lzma', expected ascii, binary or binary_compressed");
  const std::string packed = header("x y z", "4 4 4", "F F F", "1 1 1", 1, "binary_compressed");
  EXPECT_EQ(message(packed + "1234567"), "s.pcd: 7 bytes of data, expected the two sizes of compressed data");
  EXPECT_EQ(message(packed + compressed({"four"}).substr(0, 10)), "s.pcd: 2 bytes of compressed data, expected 5");
  EXPECT_EQ(message(packed + compressed({"four"})),
            "s.pcd: 4 bytes of decompressed data, expected 1 points of 12 bytes");
  EXPECT_EQ(message(packed + std::string("\x01\0\0\0\x0c\0\0\0\x20", 9)),
            "s.pcd: compressed data are damaged, expected 12 bytes");
  EXPECT_EQ(message(header("x y", "4 4", "F F", "1 1", 0, "ascii")),
            "s.pcd: fields x, y and z expected, at least one is not there");
  EXPECT_EQ(message(header("x y z", "2 4 4", "I F F", "1 1 1", 0, "binary")),
            "s.pcd: field x is 1 x I2, expected one F4 or F8");
  EXPECT_EQ(message(header("x y z", "4 4", "F F F", "1 1 1", 0, "binary")),
            "s.pcd:4: SIZE has 2 entries, expected 3 as FIELDS");
  EXPECT_EQ(message(header("x y z", "4 4 4", "F F F", "1 1 1", 2, "ascii") + "1 2 3\n"),
            "s.pcd: ends after 1 points, expected 2 as its header says");
  EXPECT_EQ(message(header("x y z", "4 4 4", "F F F", "1 1 1", 1, "ascii") + "1 2\n"),
            "s.pcd:12: point has 2 columns, expected 3 as the header says");
  EXPECT_EQ(message(header("x y z", "4 4 4", "F F F", "1 1 1", 1, "ascii") + "1 2 3\n4 5 6\n"),
            "s.pcd:13: more lines than the 1 points of the header");
  EXPECT_EQ(message(header("x y z", "4 4 4", "F F F", "1 1 1", 4'000'000'000, "binary")),
            "s.pcd:7: WIDTH is 4000000000, expected 0 to 2147483648");
  EXPECT_EQ(parse_pcd(header("x y z", "4 4 4", "F F F", "1 1 1", 2, "binary_lzma"), "p").error().code,
            ErrorCode::unsupported);
}

TEST(Pcd, SurvivesAnyBytes) {
  const auto all_finite = [](const PointCloud& cloud) {
    return std::all_of(cloud.points.begin(), cloud.points.end(), [](const auto& p) { return p.allFinite(); });
  };
  internal::expect_survives<PointCloud>(to_pcd({{{1, 2, 3}, {4, 5, 6}}}), parse_pcd, all_finite);
  internal::expect_survives<PointCloud>(
      header("x y z i", "8 4 4 2", "F F F U", "1 1 1 3", 2, "ascii") + "1 2 3 0 0 0\n4 5 nan 7 8 9\n", parse_pcd,
      all_finite);
  const auto is_sound = [&](const TimedCloud& timed) {
    return all_finite(timed.cloud) && timed.times.size() == (timed.time_field.empty() ? 0 : timed.cloud.points.size());
  };
  std::string timed = header("t x y z", "8 4 4 4", "U F F F", "1 1 1 1", 2, "binary");
  for (int i = 0; i < 10; ++i) internal::put(timed, 0x3f000000U + i);
  internal::expect_survives<TimedCloud>(timed + std::string(9, '\0'), parse_timed_pcd, is_sound);
  internal::expect_survives<TimedCloud>(
      header("t x y z", "4 4 4 4", "F F F F", "1 1 1 1", 2, "binary_compressed") + compressed({std::string(32, ' ')}),
      parse_timed_pcd, is_sound);
}

TEST(Pcd, RealScans) {
  TUTTI_REQUIRE_SHARED("data/lidar/hku_two_sessions");
  std::size_t files = 0;
  std::size_t points = 0;
  for (const std::string session : {"hku_session1", "hku_session2"})
    for (const auto& entry :
         std::filesystem::directory_iterator(test::shared_path("data/lidar/hku_two_sessions/" + session + "/Scans"))) {
      const auto scan = read_timed_pcd(entry.path());
      ASSERT_TRUE(scan) << scan.error().message;
      ++files;
      points += scan->cloud.points.size();
      for (const auto& p : scan->cloud.points) ASSERT_LT(p.norm(), 500.0F) << entry.path();
    }
  EXPECT_EQ(files, 314U + 266U);
  EXPECT_NEAR(static_cast<double>(points) / static_cast<double>(files), 5100.0, 300.0);  // SOURCES: about 5,100 each
}

TEST(Pcd, ReadsFiles) {
  const PointCloud cloud{{{1, 2, 3}}};
  const std::string path = testing::TempDir() + "tutti_pcd_test.pcd";
  ASSERT_TRUE(write_file(path, to_pcd(cloud)));
  EXPECT_EQ(read_timed_pcd(path)->cloud, cloud);
}

}  // namespace pcd_test
}  // namespace tutti::formats
