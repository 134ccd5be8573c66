// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/report/svg.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tutti/mission/report/plot.hpp"

namespace tutti::mission {
namespace svg_test {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

double distance_to_polyline(const Eigen::Vector2d& p, const Points2d& line) {
  double best = (p - line.front()).norm();
  for (std::size_t i = 1; i < line.size(); ++i) {
    const Eigen::Vector2d ab = line[i] - line[i - 1];
    const double s = ab.squaredNorm() > 0.0 ? std::clamp((p - line[i - 1]).dot(ab) / ab.squaredNorm(), 0.0, 1.0) : 0.0;
    best = std::min(best, (p - line[i - 1] - s * ab).norm());
  }
  return best;
}

Range range_of(double low, double high) {
  Range range;
  range.include(low);
  range.include(high);
  return range;
}

RC_GTEST_PROP(Simplify, KeepsEndsAndStaysWithinTolerance, ()) {
  const auto steps = *rc::gen::nonEmpty(rc::gen::container<std::vector<int>>(rc::gen::inRange(-50, 50)));
  Points2d points;
  for (std::size_t i = 0; i < steps.size(); ++i) points.emplace_back(static_cast<double>(i), 0.1 * steps[i]);
  const double tolerance = 0.1 * *rc::gen::inRange(1, 30);
  const Points2d simple = simplify(points, tolerance);
  RC_ASSERT(simple.front() == points.front());
  RC_ASSERT(simple.back() == points.back());
  for (const auto& p : simple) RC_ASSERT(std::find(points.begin(), points.end(), p) != points.end());
  for (const auto& p : points) RC_ASSERT(distance_to_polyline(p, simple) <= tolerance + 1e-12);
}

TEST(Simplify, StraightLineBecomesTwoPoints) {
  Points2d points;
  for (int i = 0; i < 100; ++i) points.emplace_back(i, 2.0 * i);
  EXPECT_EQ(simplify(points, 1e-6).size(), 2U);
  EXPECT_TRUE(simplify({}, 1.0).empty());
}

TEST(Svg, LeavesOutWhatIsNotFinite) {
  Svg svg(100.0, 100.0, "test");
  svg.polyline(Points2d{{0.0, 0.0}, {1.0, 5.0}, {kNaN, 1.0}, {3.0, 3.0}, {4.0, 9.0}}, "a");
  svg.segments(Strokes{{{0.0, 0.0}, {kNaN, 1.0}}}, "b");
  svg.arcs(Strokes{{{1.0, 1.0}, {1.0, 1.0}}}, "c");
  svg.circle({kNaN, 0.0}, 3.0, "d");
  svg.rect({0.0, 0.0}, {std::numeric_limits<double>::infinity(), 1.0}, "e");
  svg.text({0.0, kNaN}, "f", "f");
  const std::string out = svg.str();
  EXPECT_EQ(out.find("nan"), std::string::npos) << out;
  EXPECT_EQ(out.find("inf"), std::string::npos) << out;
  EXPECT_NE(out.find("M0 0L1 5M3 3L4 9"), std::string::npos) << out;  // broken in two, not bridged
}

TEST(Svg, EscapesText) {
  Svg svg(10.0, 10.0, "a<b");
  svg.text({1.0, 1.0}, "<script>&\"'", "x");
  svg.circle({1.0, 1.0}, 1.0, "x", "</title>");
  const std::string out = svg.str();
  EXPECT_EQ(out.find("<script>"), std::string::npos);
  EXPECT_NE(out.find("&lt;script&gt;&amp;&quot;&#39;"), std::string::npos);
  EXPECT_NE(out.find("<title>&lt;/title&gt;</title>"), std::string::npos);
  EXPECT_NE(out.find("aria-label=\"a&lt;b\""), std::string::npos);
}

RC_GTEST_PROP(Axis, LinearCoversItsValuesWithFewIncreasingTicks, ()) {
  const double low = *rc::gen::inRange(-100000, 100000) * 1e-3;
  const double high = low + *rc::gen::inRange(0, 100000) * 1e-3;
  const bool widen = *rc::gen::arbitrary<bool>();
  const Axis axis = Axis::linear(range_of(low, high), 0.0, 100.0, 8, widen);
  RC_ASSERT(axis(low) >= -1e-6);
  RC_ASSERT(axis(high) <= 100.0 + 1e-6);
  RC_ASSERT(!axis.ticks().empty());
  RC_ASSERT(axis.ticks().size() <= 11U);
  RC_ASSERT(std::is_sorted(axis.ticks().begin(), axis.ticks().end()));
  for (const double tick : axis.ticks()) RC_ASSERT(axis(tick) >= -1e-6 && axis(tick) <= 100.0 + 1e-6);
}

RC_GTEST_PROP(Axis, LogarithmicCoversItsValues, ()) {
  const double low = std::pow(10.0, *rc::gen::inRange(-400, 300) * 0.01);
  const double high = low * std::pow(10.0, *rc::gen::inRange(0, 500) * 0.01);
  const Axis axis = Axis::logarithmic(range_of(low, high), 0.0, 100.0);
  RC_ASSERT(axis(low) >= -1e-6 && axis(low) <= axis(high));
  RC_ASSERT(axis(high) <= 100.0 + 1e-6);
  RC_ASSERT(axis(high) > axis(0.5 * high));
  RC_ASSERT(!axis.ticks().empty());
}

TEST(Axis, LogarithmicClampsZeroToTheFloor) {
  const Axis axis = Axis::logarithmic(range_of(0.0, 2.0), 100.0, 0.0);
  EXPECT_NEAR(axis(2.0), 0.0, 1e-9);
  EXPECT_NEAR(axis(0.0), 100.0, 1e-9);
  EXPECT_NEAR(axis(-1.0), 100.0, 1e-9);
  EXPECT_TRUE(std::isnan(axis(kNaN)));
}

TEST(Axis, NothingToShowStillWorks) {
  for (const Axis& axis : {Axis::linear({}, 0.0, 10.0, 5, true), Axis::logarithmic({}, 0.0, 10.0),
                           Axis::linear(range_of(3.0, 3.0), 0.0, 10.0, 5, false)}) {
    EXPECT_TRUE(std::isfinite(axis(3.0)));
    EXPECT_FALSE(axis.ticks().empty());
  }
}

RC_GTEST_PROP(PlanView, KeepsShapesAndFitsThem, ()) {
  const auto coordinate = rc::gen::map(rc::gen::inRange(-5000, 5000), [](int v) { return 0.1 * v; });
  const auto xs = *rc::gen::container<std::vector<double>>(5, coordinate);
  const auto ys = *rc::gen::container<std::vector<double>>(5, coordinate);
  Points2d points;
  for (std::size_t i = 0; i < xs.size(); ++i) points.emplace_back(xs[i], ys[i]);
  const PlanView view({points}, 500.0, 400.0);
  const Points2d pixels = view(points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    RC_ASSERT(pixels[i].x() >= 0.0 && pixels[i].x() <= view.width());
    RC_ASSERT(pixels[i].y() >= 0.0 && pixels[i].y() <= view.height());
    const double metres = (points[i] - points[0]).norm();
    RC_ASSERT(std::abs((pixels[i] - pixels[0]).norm() - metres * view.pixels_per_metre()) < 1e-6);
  }
  RC_ASSERT(view({0.0, 1.0}).y() < view({0.0, 0.0}).y());  // y is up
  RC_ASSERT(view.height() <= 400.0 + 1e-9);
}

TEST(Labels, Lengths) {
  EXPECT_EQ(length_label(0.002), "2 mm");
  EXPECT_EQ(length_label(0.05), "5 cm");
  EXPECT_EQ(length_label(0.01), "1 cm");
  EXPECT_EQ(length_label(1.0), "1 m");
  EXPECT_EQ(length_label(0.0), "0");
  EXPECT_EQ(tick_label(-0.0), "0");
}

}  // namespace svg_test
}  // namespace tutti::mission
