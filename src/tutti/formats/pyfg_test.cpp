// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/pyfg.hpp"

#include <gtest/gtest.h>
// RapidCheck after gtest.
#include <rapidcheck/gtest.h>

#include "support/formats/mutations.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::formats {
namespace pyfg_test {

using internal::any_double;
using internal::any_pose;

Matrix6d any_covariance() {
  Matrix6d root;
  for (int i = 0; i < 36; ++i) root(i) = any_double();
  const Matrix6d covariance = root * root.transpose();
  return 0.5 * (covariance + covariance.transpose());
}

Timestamp any_stamp() { return {*rc::gen::inRange<std::int64_t>(-(1LL << 60), 1LL << 60)}; }

PyfgFile any_file() {
  PyfgFile file;
  for (char robot = 'A'; robot < *rc::gen::inRange('B', 'E'); ++robot)
    for (std::uint64_t number = 0; number < *rc::gen::inRange<std::uint64_t>(1, 5); ++number) {
      const std::uint64_t gap = file.vertices.empty() ? 0 : file.vertices.back().name.number;
      PyfgVertex& vertex = file.vertices.emplace_back(PyfgVertex{{robot, number + gap}, any_stamp(), any_pose(), {}});
      if (*rc::gen::inRange(0, 3) == 0) vertex.prior = any_pose();
    }
  std::ranges::sort(file.vertices, {}, &PyfgVertex::name);
  const auto repeated = std::ranges::unique(file.vertices, {}, &PyfgVertex::name);
  file.vertices.erase(repeated.begin(), repeated.end());
  for (std::size_t i = 1; i < file.vertices.size(); ++i)
    file.edges.push_back({any_stamp(), i, i - 1, {any_pose(), any_covariance()}});
  return file;
}

RC_GTEST_PROP(Pyfg, ReadsBackWhatItWrites, ()) {
  const PyfgFile file = any_file();
  const auto read = parse_pyfg(to_pyfg(file), "g.pyfg");
  RC_ASSERT(read.has_value());
  RC_ASSERT(read->vertices == file.vertices);
  RC_ASSERT(read->edges == file.edges);
}

constexpr const char* kUnit = "0 0 0 0 0 0 1";
constexpr const char* kCovariance = "0.01 0 0 0 0 0 0.01 0 0 0 0 0.01 0 0 0 0.04 0 0 0.04 0 0.04";

TEST(Pyfg, ReadsAGraphAsPublished) {
  const std::string text = fmt::format(
      "VERTEX_SE3:QUAT 0.000000000 A0 {0}\nVERTEX_SE3:QUAT 0.000000000 A10 {0}\n"
      "VERTEX_SE3:QUAT 0.000000000 A9 {0}\nVERTEX_SE3:QUAT 0.0 B0 1 2 3 0 0 0 1\n"
      "VERTEX_SE3:QUAT:PRIOR 0.5 B0 1 2 3 0 0 0 1 {1}\nEDGE_SE3:QUAT 1.5 A9 B0 {0} {1}\n",
      kUnit, kCovariance);
  const auto file = parse_pyfg(text, "g.pyfg");
  ASSERT_TRUE(file) << file.error().message;
  ASSERT_EQ(file->vertices.size(), 4U);
  EXPECT_EQ(to_string(file->vertices[1].name), "A9");  // by number, not by letters
  EXPECT_EQ(file->vertices[3].prior->translation, Eigen::Vector3d(1, 2, 3));
  ASSERT_EQ(file->edges.size(), 1U);
  EXPECT_EQ(file->edges[0].from, 1U);
  EXPECT_EQ(file->edges[0].to, 3U);
  EXPECT_EQ(file->edges[0].stamp, Timestamp{1'500'000'000});
  EXPECT_EQ(file->edges[0].measurement.covariance(0, 0), 0.01);  // translation first
  EXPECT_EQ(file->edges[0].measurement.covariance(5, 5), 0.04);
}

std::string message_of(const std::string& text) {
  const auto result = parse_pyfg(text, "g.pyfg");
  return result ? std::string("no error") : result.error().message;
}

TEST(Pyfg, SaysWhatIsWrong) {
  const std::string vertex = fmt::format("VERTEX_SE3:QUAT 0 A0 {}\n", kUnit);
  const auto expect_error = [&](const std::string& text, const std::string& expected) {
    EXPECT_NE(message_of(text).find(expected), std::string::npos) << text << "\n" << message_of(text);
  };
  expect_error("", "no VERTEX_SE3:QUAT line");
  expect_error(vertex + vertex, "vertex A0 comes twice");
  expect_error(vertex + "EDGE_RANGE 0 A0 L0 1 1\n", "g.pyfg:2: tag is 'EDGE_RANGE'");
  expect_error(vertex + fmt::format("EDGE_SE3:QUAT 0 A0 A1 {} {}\n", kUnit, kCovariance), "g.pyfg:2: names vertex A1");
  expect_error(vertex + fmt::format("EDGE_SE3:QUAT 0 A0 A0 {} {}\n", kUnit, kCovariance), "vertex A0 to itself");
  expect_error(vertex + fmt::format("EDGE_SE3:QUAT 0 A0 A1 {} {}\n", kUnit, "1"), "row has 12 columns, expected 32");
  for (const char* bad : {"A", "12", "A-1", "A+1", "A1x"})
    expect_error(fmt::format("VERTEX_SE3:QUAT 0 {} {}\n", bad, kUnit), "expected a letter and a number");
  expect_error(fmt::format("VERTEX_SE3:QUAT now A0 {}\n", kUnit), "stamp is 'now'");
  expect_error("VERTEX_SE3:QUAT 0 A0 0 0 0 0 0 0 2\n", "quaternion has norm 2");
  const std::string negative = "-1 0 0 0 0 0 -1 0 0 0 0 -1 0 0 0 -1 0 0 -1 0 -1";
  expect_error(vertex + fmt::format("VERTEX_SE3:QUAT:PRIOR 0 A0 {} {}\n", kUnit, negative),
               "eigenvalues of the covariance");
}

TEST(Pyfg, WithoutVerticesHasThoseOfItsOdometry) {
  const auto edge = [](const char* stamp, const char* from, const char* to) {
    return fmt::format("EDGE_SE3:QUAT {} {} {} {} {}\n", stamp, from, to, kUnit, kCovariance);
  };
  const std::string odometry = edge("1670403893.500000001", "a0", "a1") + edge("1670403895.1", "a1", "a2");
  const auto file = parse_pyfg(odometry + edge("1670403999.0", "a2", "a0"), "g.pyfg");
  ASSERT_TRUE(file) << file.error().message;
  ASSERT_EQ(file->vertices.size(), 3U);
  EXPECT_FALSE(file->vertices[0].pose);
  const auto times = times_of(*file);
  ASSERT_TRUE(times);
  EXPECT_EQ(times->stamps[1], Timestamp{1'670'403'893'500'000'001});
  EXPECT_EQ(times->stamps[2], Timestamp{1'670'403'895'100'000'000});
  EXPECT_LT(times->stamps[0], times->stamps[1]);
  EXPECT_NE(message_of(odometry + edge("0", "a0", "b0")).find("g.pyfg:3: names vertex b0"), std::string::npos);
}

TEST(Pyfg, StampsThatDoNotIncreaseAreNoTimes) {
  PyfgFile file{.vertices = {{{'a', 0}, {2'000'000'000}, {}, {}}, {{'a', 1}, {1'000'000'000}, {}, {}}}, .edges = {}};
  EXPECT_FALSE(times_of(file));
  file.vertices[1].stamp = {2'000'000'001};  // nor those that count
  EXPECT_FALSE(times_of(file));
  file.vertices[1].stamp = {3'300'000'000};
  EXPECT_EQ(times_of(file)->from, "of the vertices");
}

TEST(Pyfg, TakesTheNearestCovarianceOfOneThatRoundingMadeIndefinite) {
  // No variance along x, yet a covariance with y.
  const auto file = parse_pyfg(fmt::format("VERTEX_SE3:QUAT 0 A0 {0}\nVERTEX_SE3:QUAT 1 A1 {0}\n"
                                           "EDGE_SE3:QUAT 1 A0 A1 {0} 0 0.01 0 0 0 0 0.01 0 0 0 0 0.01 0 0 0 0.04 0 0 "
                                           "0.04 0 0.04\n",
                                           kUnit),
                               "g.pyfg");
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_EQ(file->indefinite, 1U);
  const Matrix6d& of = file->edges[0].measurement.covariance;
  EXPECT_GE(eigen_of(of).values(0), -1e-15);
  EXPECT_EQ(of(2, 2), 0.01);
}

}  // namespace pyfg_test
}  // namespace tutti::formats
