// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/jrl.hpp"

#include <gtest/gtest.h>
// RapidCheck after gtest.
#include <rapidcheck/gtest.h>

#include <algorithm>

#include "support/formats/jrl.hpp"
#include "support/formats/mutations.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::formats {
namespace jrl_test {

constexpr std::int64_t kEpoch = 1'670'403'892'357'527'971;  // as in COSMO-Bench

Matrix6d covariance(double translation, double rotation) {
  Vector6d variance;
  variance << Eigen::Vector3d(1, 2, 3) * translation, Eigen::Vector3d(4, 5, 6) * rotation;
  Matrix6d out = variance.asDiagonal();
  out(0, 5) = out(5, 0) = 1e-3 * std::sqrt(out(0, 0) * out(5, 5));
  return out;
}

/// Two robots of three poses each, a closure within the first and one between both.
PyfgFile fleet() {
  PyfgFile file;
  for (const char robot : {'a', 'b'})
    for (std::uint64_t k = 0; k < 3; ++k) {
      const Pose3 pose{so3_exp({0.1, 0.2 * static_cast<double>(k), -0.3}), {1.0 * static_cast<double>(k), 2.0, 3.0}};
      file.vertices.push_back({{robot, k},
                               {kEpoch + 1'300'000'001 * static_cast<std::int64_t>(k)},
                               pose,
                               k == 0 ? std::optional(Pose3{}) : std::nullopt});
    }
  const auto add = [&](std::size_t from, std::size_t to, double delay_s) {
    const Pose3 step = file.vertices[from].pose->inverse() * *file.vertices[to].pose;
    file.edges.push_back({file.vertices[to].stamp + delay_s, from, to, {step, covariance(1e-4, 1e-6)}});
  };
  for (const std::size_t to : {1U, 2U, 4U, 5U}) add(to - 1, to, 0.0);
  add(0, 2, 0.0);
  add(1, 5, 34.5);
  return file;
}

/// Edges come robot by robot.
bool by_ends(const PyfgEdge& a, const PyfgEdge& b) { return std::pair(a.from, a.to) < std::pair(b.from, b.to); }

TEST(Jrl, HasWhatTheSameGraphHasAsPyfg) {
  PyfgFile expected = fleet();
  auto file = parse_jrl(jrl_files::to_jrl(expected), "g.jrl");
  ASSERT_TRUE(file) << file.error().message;
  ASSERT_EQ(file->vertices.size(), expected.vertices.size());
  for (std::size_t v = 0; v < expected.vertices.size(); ++v) {
    EXPECT_EQ(file->vertices[v].name, expected.vertices[v].name);
    EXPECT_EQ(file->vertices[v].stamp, expected.vertices[v].stamp);  // to the nanosecond
    EXPECT_EQ(file->vertices[v].prior.has_value(), expected.vertices[v].prior.has_value());
    EXPECT_LT(local(*file->vertices[v].pose, *expected.vertices[v].pose).norm(), 1e-15);
  }
  ASSERT_EQ(file->edges.size(), expected.edges.size());  // the one that both have counts once
  std::ranges::sort(file->edges, by_ends);
  std::ranges::sort(expected.edges, by_ends);
  for (std::size_t e = 0; e < expected.edges.size(); ++e) {
    const auto &is = file->edges[e], &was = expected.edges[e];
    EXPECT_EQ(std::tuple(is.from, is.to, is.stamp), std::tuple(was.from, was.to, was.stamp));  // the first report's
    EXPECT_LT(local(is.measurement.T_a_b, was.measurement.T_a_b).norm(), 1e-15);
    EXPECT_EQ(is.measurement.covariance, was.measurement.covariance);  // translation first again
  }
}

TEST(Jrl, TwoClosuresOfOnePairOfKeyframesAreTwo) {
  PyfgFile graph = fleet();
  graph.edges.push_back(graph.edges.back());
  graph.edges.back().measurement.T_a_b.translation.x() += 0.1;
  const auto file = parse_jrl(jrl_files::to_jrl(graph), "g.jrl");
  ASSERT_TRUE(file);
  EXPECT_EQ(file->edges.size(), graph.edges.size());
}

TEST(Jrl, WithoutGroundTruthHasTheSameVerticesAndTimes) {
  const auto with = parse_jrl(jrl_files::to_jrl(fleet()), "g.jrl"),
             without = parse_jrl(jrl_files::to_jrl(fleet(), false), "g.jrl");
  ASSERT_TRUE(without) << without.error().message;
  ASSERT_EQ(without->vertices.size(), with->vertices.size());
  for (const PyfgVertex& vertex : without->vertices) EXPECT_FALSE(vertex.pose);
  EXPECT_EQ(times_of(*without)->stamps, times_of(*with)->stamps);
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), by);
}

TEST(Jrl, SaysWhatIsWrongAndWhere) {
  const std::string good = jrl_files::to_jrl(fleet());
  const auto expect_error = [&](const std::string& text, const std::string& expected) {
    const auto result = parse_jrl(text, "g.jrl");
    const std::string message = result ? "no error" : result.error().message;
    EXPECT_NE(message.find(expected), std::string::npos) << message;
  };
  const auto says_of = [&](const std::string& what, const std::string& by, const std::string& expected) {
    expect_error(replaced(good, what, by), expected);
  };
  expect_error("{", "g.jrl: is no JSON");
  expect_error("{}", "has no 'measurements'");
  expect_error(R"({"measurements": {}})", "no poses");
  expect_error(R"({"measurements": 7})", "is a number, expected a list");
  says_of("\"measurements\": [", "\"measurements\": [[],", "measurements['a'][0].measurements[0]: has no 'type'");
  says_of("BetweenFactorPose3", "RangeFactorPose3", "type is 'RangeFactorPose3', expected BetweenFactorPose3");
  const std::string a0 = fmt::format("{}", jrl_files::jrl_key({'a', 0})),
                    a1 = fmt::format("{}", jrl_files::jrl_key({'a', 1}));
  says_of(a0, "3", "is 3, expected letter << 56 | number");
  says_of(a0, fmt::format("{}", jrl_files::jrl_key({'a', 1'000'000'000})), "is a1000000000, which is no pose");
  says_of("\"key2\": " + a1, "\"key2\": " + a0, "joins a0 to itself");
  says_of("\"key2\": " + a1, "\"key2\": -1", "is '-1', expected a whole number");
  says_of("\"rotation\": [1, 0", "\"rotation\": [2, 0", "quaternion has norm 2");
  says_of("\"rotation\": [1, 0", "\"rotation\": [1, 1, 0", "is no list of 4 numbers");
  says_of("\"covariance\": [1, 0", "\"covariance\": [\"x\", 0", "number 1 is");
  says_of(fmt::format("\"stamp\": {}", kEpoch), "\"stamp\": 3000000000000000000", "expected nanoseconds up to 2^61");
  PyfgFile stray = fleet();
  stray.vertices.push_back({{'b', 77}, {}, {}, {}});
  stray.edges.push_back({stray.edges.back().stamp, 0, 6, stray.edges.back().measurement});
  expect_error(jrl_files::to_jrl(stray), "a closure from a0 to b77: no odometry, prior or ground truth names b77");
}

TEST(Jrl, ListsWithinListsNeedNoStack) {
  std::string deep = R"({"measurements": {"a": [{"stamp": )";
  deep.append(300'000, '[').append(300'000, ']');
  const auto result = parse_jrl(deep + "}]}}", "g.jrl");
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().message.find("stamp: is array"), std::string::npos) << result.error().message;
}

RC_GTEST_PROP(Jrl, SurvivesDamage, ()) {
  static const std::string good = jrl_files::to_jrl(fleet());
  const auto file = parse_jrl(internal::damaged(good), "g.jrl");
  if (!file) RC_ASSERT(file.error().message.starts_with("g.jrl: "));
}

TEST(Jrl, IsKnownByHowItBegins) {
  EXPECT_TRUE(looks_like_jrl("\n {\"name\": 1}"));
  EXPECT_FALSE(looks_like_jrl(to_pyfg(fleet())));
  EXPECT_FALSE(looks_like_pyfg(jrl_files::to_jrl(fleet())));
}

}  // namespace jrl_test
}  // namespace tutti::formats
