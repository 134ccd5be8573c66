// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/geometry/geodesy.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>

namespace tutti::geodesy_test {
namespace {

Geodetic any_position() {
  const auto within = [](double most) {
    return most * static_cast<double>(*rc::gen::inRange(-1'000'000, 1'000'001)) / 1e6;
  };
  return {within(90.0), within(180.0), 44'000.0 + within(56'000.0)};
}

// The ellipsoid's axes, and by hand: at 45 degrees N^2 = a^2 / (1 - e^2 / 2).
TEST(Geodesy, KnowsTheEllipsoid) {
  EXPECT_NEAR((ecef_of({0, 0, 0}) - Eigen::Vector3d(6378137.0, 0, 0)).norm(), 0.0, 1e-9);
  EXPECT_NEAR((ecef_of({0, 90, 10}) - Eigen::Vector3d(0, 6378147.0, 0)).norm(), 0.0, 1e-8);
  EXPECT_NEAR((ecef_of({90, 0, 0}) - Eigen::Vector3d(0, 0, 6356752.314245179)).norm(), 0.0, 1e-8);
  EXPECT_NEAR((ecef_of({-90, 77, 5}) - Eigen::Vector3d(0, 0, -6356757.314245179)).norm(), 0.0, 1e-8);
  EXPECT_NEAR((ecef_of({45, 0, 0}) - Eigen::Vector3d(4517590.878848932, 0, 4487348.408865919)).norm(), 0.0, 1e-6);
}

RC_GTEST_PROP(Geodesy, GoesThereAndBack, ()) {
  const Geodetic position = any_position();
  const Eigen::Vector3d there = ecef_of(position);
  RC_ASSERT((ecef_of(geodetic_of(there)) - there).norm() < 1e-6);
  RC_ASSERT(check_geodetic(geodetic_of(there)).has_value());
}

TEST(Geodesy, PolesAndAntimeridianAreOrdinaryPlaces) {
  for (const double latitude : {90.0, -90.0, 89.9999999, 0.0})
    for (const double longitude : {180.0, -180.0, 179.9999999, 0.0})
      for (const double height : {-400.0, 0.0, 8'848.0}) {
        const Geodetic back = geodetic_of(ecef_of({latitude, longitude, height}));
        EXPECT_NEAR(back.latitude_deg, latitude, 1e-10);
        EXPECT_NEAR(back.height_m, height, 1e-6);
      }
  // 2 cm across the antimeridian are 2 cm.
  EXPECT_LT((ecef_of({10, 179.9999999, 0}) - ecef_of({10, -179.9999999, 0})).norm(), 0.03);
}

// The frame's axes are the derivatives by longitude, latitude and height.
RC_GTEST_PROP(Geodesy, EnuIsEastNorthUp, ()) {
  Geodetic at = any_position();
  at.latitude_deg *= 0.99;
  at.longitude_deg *= 0.99;
  const Pose3 T_enu_ecef = enu_in_ecef(at).inverse();
  const double step = 1e-6;
  const Eigen::Vector3d east = T_enu_ecef * ecef_of({at.latitude_deg, at.longitude_deg + step, at.height_m});
  const Eigen::Vector3d north = T_enu_ecef * ecef_of({at.latitude_deg + step, at.longitude_deg, at.height_m});
  const Eigen::Vector3d up = T_enu_ecef * ecef_of({at.latitude_deg, at.longitude_deg, at.height_m - 2.0});
  RC_ASSERT(east.x() > 0.0 && std::abs(east.y()) + std::abs(east.z()) < 1e-6 + 1e-5 * east.x());
  RC_ASSERT(north.y() > 0.09 && std::abs(north.x()) + std::abs(north.z()) < 1e-6);
  RC_ASSERT((up - Eigen::Vector3d(0, 0, -2)).norm() < 1e-6);
}

TEST(Geodesy, RefusesWhatIsNoPlace) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinite = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(check_geodetic({90, -180, -11'000}).has_value());
  EXPECT_EQ(check_geodetic({91, 0, 0}).error().message, "latitude 91 degrees, expected -90 to 90");
  EXPECT_FALSE(check_geodetic({0, 180.1, 0}).has_value());
  EXPECT_FALSE(check_geodetic({0, 0, 100'001}).has_value());
  for (const double bad : {nan, infinite, -infinite}) {
    EXPECT_FALSE(check_geodetic({bad, 0, 0}).has_value());
    EXPECT_FALSE(check_geodetic({0, bad, 0}).has_value());
    EXPECT_FALSE(check_geodetic({0, 0, bad}).has_value());
  }
}

}  // namespace
}  // namespace tutti::geodesy_test
