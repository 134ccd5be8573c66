// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/geometry/camera.hpp"

#include <gtest/gtest.h>
// gtest first
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "support/random_pose.hpp"

namespace tutti {
namespace camera_test {

using test::matrix_near;
using Matrix23 = Eigen::Matrix<double, 2, 3>;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Real calibrations of all kinds, and hard ones: a lens that folds back, more than half of all directions.
std::vector<CameraModel> cameras() {
  using enum CameraKind;
  return {
      {pinhole, 752, 480, 458.654, 457.296, 367.215, 248.375, {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05}},
      {pinhole, 752, 480, 460.0, 461.0, 380.0, 250.0, {}},
      {equidistant, 512, 512, 190.978, 190.973, 254.932, 256.897, {0.00348238, 0.00071503, -0.00205324, 0.00020294}},
      {equidistant, 800, 800, 230.0, 231.0, 401.0, 398.0, {}},
      {equidistant, 640, 480, 190.0, 190.0, 320.0, 240.0, {-0.05, 0.02, -0.01, 0.002}},
      {double_sphere, 752, 480, 349.726, 348.694, 365.894, 249.330, {-0.24102305, 0.56697041, 0.0, 0.0}},
      {double_sphere, 512, 512, 158.0, 158.0, 254.0, 256.0, {-0.18, 0.59, 0.0, 0.0}},
      {double_sphere, 640, 480, 313.2, 313.1, 638.7 / 2, 236.0, {0.7, 0.4, 0.0, 0.0}},
      // TUM's fr1, five numbers; an Azure Kinect's colour camera, eight, of which most cancels.
      {rational, 640, 480, 517.306, 516.469, 318.643, 255.314, {0.262383, -0.953104, -0.005358, 0.002628, 1.163314}},
      {rational,
       1280,
       720,
       607.8,
       607.5,
       637.8,
       366.9,
       {0.5437, -2.5634, 5.2e-4, -1.4e-4, 1.4863, 0.4196, -2.3956, 1.4166}},
  };
}

/// Any lens at all, most of them no good ones: what they do give must still be true.
CameraModel wild_camera(Rng& rng) {
  CameraModel camera{static_cast<CameraKind>(rng.index(4)), 640, 480, 300.0, 310.0, 320.0, 240.0, {}};
  const bool sphere = camera.kind == CameraKind::double_sphere;
  if (sphere) camera.distortion = {rng.uniform(-0.99, 0.99), rng.uniform(0.0, 1.0), 0.0, 0.0};
  if (!sphere)
    for (double& d : camera.distortion) d = rng.normal(0.2);
  if (camera.kind != CameraKind::rational) std::fill(camera.distortion.begin() + 4, camera.distortion.end(), 0.0);
  if (camera.kind == CameraKind::pinhole || camera.kind == CameraKind::rational)
    for (const std::size_t i : {2, 3}) camera.distortion[i] = 0.0;  // real lenses are nearly centred
  return camera;
}

Eigen::Vector2d random_pixel(Rng& rng, const CameraModel& camera) {
  return {rng.uniform(-0.5, camera.width_px - 0.5), rng.uniform(-0.5, camera.height_px - 0.5)};
}

RC_GTEST_PROP(Camera, EveryPixelOfTheImageHasItsDirection, (std::uint64_t seed)) {
  Rng rng(seed);
  for (const CameraModel& camera : cameras()) {
    RC_ASSERT(check_camera(camera).has_value());
    for (int i = 0; i < 20; ++i) {
      const Eigen::Vector2d pixel = random_pixel(rng, camera);
      const auto direction = unproject(camera, pixel);
      RC_ASSERT(direction.has_value());
      RC_ASSERT(std::abs(direction->norm() - 1.0) < 1e-14);
      const auto back = project(camera, std::exp(rng.normal(3.0)) * *direction);
      RC_ASSERT(back.has_value());
      RC_ASSERT(matrix_near(*back, pixel, 1e-9));
    }
  }
}

TEST(Camera, TheCornersAndThePrincipalPointHaveTheirDirection) {
  for (const CameraModel& camera : cameras()) {
    const double w = camera.width_px - 0.5;
    const double h = camera.height_px - 0.5;
    for (const Eigen::Vector2d& pixel : {Eigen::Vector2d(-0.5, -0.5), {w, -0.5}, {-0.5, h}, {w, h}}) {
      const auto direction = unproject(camera, pixel);
      ASSERT_TRUE(direction.has_value());
      const auto back = project(camera, *direction);
      ASSERT_TRUE(back.has_value());
      EXPECT_TRUE(matrix_near(*back, pixel, 1e-9));
    }
    const auto ahead = unproject(camera, {camera.cx, camera.cy});
    ASSERT_TRUE(ahead.has_value());
    EXPECT_TRUE(matrix_near(*ahead, Eigen::Vector3d::UnitZ(), 1e-15));
  }
}

RC_GTEST_PROP(Camera, NoPixelSeesTwoDirections, (std::uint64_t seed)) {
  Rng rng(seed);
  const CameraModel camera = wild_camera(rng);
  RC_ASSERT(check_camera(camera).has_value());
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d direction = test::random_direction(rng);
    Matrix23 jacobian;
    const auto pixel = project(camera, direction, &jacobian);
    if (!pixel || pixel->norm() > 1e9) continue;
    const double sharpness = (jacobian * jacobian.transpose()).determinant() / std::pow(camera.fx, 4);
    const auto back = unproject(camera, *pixel);
    RC_ASSERT(back.has_value() || sharpness < 1e-4);  // at a fold there is a last radius
    if (back && sharpness > 1e-4) RC_ASSERT(matrix_near(*back, direction, 1e-9));
  }
}

RC_GTEST_PROP(Camera, JacobianIsTheDerivative, (std::uint64_t seed)) {
  Rng rng(seed);
  auto all = cameras();
  all.push_back(wild_camera(rng));
  for (const CameraModel& camera : all) {
    Eigen::Vector3d point = test::random_vector(rng) + 1.5 * Eigen::Vector3d::UnitZ();
    if (seed % 4 == 0) point.head<2>() *= 1e-9;  // next to the axis
    if (seed % 16 == 0) point.head<2>().setZero();
    if (point.norm() < 0.1) continue;
    Matrix23 jacobian;
    if (!project(camera, point, &jacobian)) continue;
    const double h = 1e-6 * point.norm();
    Matrix23 numeric;
    bool inside = true;
    for (int k = 0; k < 3 && inside; ++k) {
      const auto plus = project(camera, point + h * Eigen::Vector3d::Unit(k));
      const auto minus = project(camera, point - h * Eigen::Vector3d::Unit(k));
      inside = plus && minus;
      if (inside) numeric.col(k) = (*plus - *minus) / (2.0 * h);
    }
    const double size = 1.0 + jacobian.cwiseAbs().maxCoeff();
    if (inside && size < 1e5) RC_ASSERT(matrix_near(jacobian, numeric, 1e-6 * size));
    RC_ASSERT((jacobian * point).norm() < 1e-9 * size * point.norm());  // along the ray nothing moves
  }
}

TEST(Camera, KindsAreWhatTheirNamesSay) {
  const double angle = 0.8;
  const Eigen::Vector3d direction(std::sin(angle), 0.0, std::cos(angle));
  const auto u = [&](CameraKind kind, std::array<double, 8> distortion) {
    return project({kind, 10, 10, 1.0, 1.0, 0.0, 0.0, distortion}, direction).value().x();
  };
  EXPECT_NEAR(u(CameraKind::pinhole, {}), std::tan(angle), 1e-15);
  EXPECT_NEAR(u(CameraKind::equidistant, {}), angle, 1e-15);
  EXPECT_NEAR(u(CameraKind::double_sphere, {}), std::tan(angle), 1e-15);
  EXPECT_NEAR(u(CameraKind::double_sphere, {0.0, 0.5, 0.0, 0.0}), 2.0 * std::tan(angle / 2.0), 1e-15);  // stereographic
  EXPECT_NEAR(
      u(CameraKind::equidistant, {0.1, 0.2, 0.3, 0.4}),
      angle + 0.1 * std::pow(angle, 3) + 0.2 * std::pow(angle, 5) + 0.3 * std::pow(angle, 7) + 0.4 * std::pow(angle, 9),
      1e-14);
}

TEST(Camera, RadialTangentialFollowsBrown) {
  const std::array<double, 8> d{-0.2, 0.05, 0.003, -0.002};
  const double x = 0.3;
  const double y = -0.4;
  const double s = x * x + y * y;
  const double radial = 1.0 + d[0] * s + d[1] * s * s;
  const Eigen::Vector2d expected(radial * x + 2.0 * d[2] * x * y + d[3] * (s + 2.0 * x * x),
                                 radial * y + d[2] * (s + 2.0 * y * y) + 2.0 * d[3] * x * y);
  const auto pixel = project({CameraKind::pinhole, 10, 10, 1.0, 1.0, 0.0, 0.0, d}, {2.0 * x, 2.0 * y, 2.0});
  ASSERT_TRUE(pixel.has_value());
  EXPECT_TRUE(matrix_near(*pixel, expected, 1e-15));
}

TEST(Camera, TheRationalOneFollowsOpenCv) {
  const std::array<double, 8> d{0.5437, -2.5634, 5.2e-4, -1.4e-4, 1.4863, 0.4196, -2.3956, 1.4166};
  const double x = 0.3, y = -0.2, s = x * x + y * y;
  const double radial =
      (1.0 + d[0] * s + d[1] * s * s + d[4] * s * s * s) / (1.0 + d[5] * s + d[6] * s * s + d[7] * s * s * s);
  const Eigen::Vector2d expected(radial * x + 2.0 * d[2] * x * y + d[3] * (s + 2.0 * x * x),
                                 radial * y + d[2] * (s + 2.0 * y * y) + 2.0 * d[3] * x * y);
  const auto pixel = project({CameraKind::rational, 10, 10, 1.0, 1.0, 0.0, 0.0, d}, {2.0 * x, 2.0 * y, 2.0});
  ASSERT_TRUE(pixel.has_value());
  EXPECT_TRUE(matrix_near(*pixel, expected, 1e-15));
}

TEST(Camera, ARationalOneEndsAtItsPoleAndWhereItFolds) {
  const auto sees = [](const std::array<double, 8>& d, double x) {
    return project({CameraKind::rational, 640, 480, 300.0, 300.0, 320.0, 240.0, d}, {x, 0.0, 1.0}).has_value();
  };
  const std::array<double, 8> pole{0.0, 0.0, 0.0, 0.0, 0.0, -0.25, 0.0, 0.0};  // 1 / (1 - s / 4): endless at 2
  EXPECT_TRUE(sees(pole, 1.99));
  for (const double x : {2.01, 3.0, 10.0}) EXPECT_FALSE(sees(pole, x)) << x;
  const std::array<double, 8> folds{0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0};  // x / (1 + x^2) grows until 1
  EXPECT_TRUE(sees(folds, 0.99));
  for (const double x : {1.01, 3.0}) EXPECT_FALSE(sees(folds, x)) << x;
  const std::array<double, 8> fifth{0.0, 0.0, 0.0, 0.0, -1.0 / 7.0, 0.0, 0.0, 0.0};  // x - x^7 / 7 grows until 1
  EXPECT_TRUE(sees(fifth, 0.99));
  for (const double x : {1.01, 3.0}) EXPECT_FALSE(sees(fifth, x)) << x;
}

TEST(Camera, NothingIsSeenBehindAPinhole) {
  const CameraModel camera = cameras().front();
  EXPECT_FALSE(project(camera, {0.1, 0.1, 0.0}));
  EXPECT_FALSE(project(camera, {0.1, 0.1, -1.0}));
  EXPECT_FALSE(project(camera, {0.0, 0.0, 0.0}));
}

TEST(Camera, AFisheyeSeesBehindItselfUpToTheAxis) {
  const CameraModel camera = cameras()[3];
  EXPECT_TRUE(project(camera, {1.0, 0.0, -0.5}));
  for (const CameraKind kind : {CameraKind::equidistant, CameraKind::double_sphere})
    EXPECT_FALSE(project({kind, 10, 10, 1.0, 1.0, 0.0, 0.0, {}}, {0.0, 0.0, -1.0}));
  EXPECT_FALSE(project(camera, {0.0, 0.0, 0.0}));
  EXPECT_FALSE(unproject(camera, {camera.cx + 3.2 * camera.fx, camera.cy}));  // more than 180 degrees from the axis
}

TEST(Camera, WhereTheLensFoldsBackThereIsNoPixel) {
  // 1 - 1.5 s + 0.5 s^2 is zero at s = 1 and s = 2: the second rise is refused as well.
  const CameraModel twice{CameraKind::pinhole, 640, 480, 300.0, 300.0, 320.0, 240.0, {-0.5, 0.1, 0.0, 0.0}};
  EXPECT_TRUE(project(twice, {0.99, 0.0, 1.0}));
  for (const double x : {1.01, 1.2, 1.5, 2.0, 5.0}) EXPECT_FALSE(project(twice, {x, 0.0, 1.0})) << x;
  EXPECT_TRUE(unproject(twice, {320.0 + 0.599 * 300.0, 240.0}));
  EXPECT_FALSE(unproject(twice, {320.0 + 0.601 * 300.0, 240.0}));  // w = 0.6 is the largest that it reaches
  const CameraModel fisheye{CameraKind::equidistant, 640, 480, 300.0, 300.0, 320.0, 240.0, {-0.5, 0.1, 0.0, 0.0}};
  EXPECT_TRUE(project(fisheye, {std::sin(0.99), 0.0, std::cos(0.99)}));
  EXPECT_FALSE(project(fisheye, {std::sin(1.6), 0.0, std::cos(1.6)}));
}

TEST(Camera, NonFiniteInputGivesNothing) {
  for (const CameraModel& camera : cameras())
    for (const double bad : {kNan, kInfinity, -kInfinity})
      for (int k = 0; k < 3; ++k) {
        Eigen::Vector3d point(0.1, 0.2, 1.0);
        point(k) = bad;
        EXPECT_FALSE(project(camera, point));
        const bool pixel_is_bad = k < 2;
        EXPECT_NE(unproject(camera, point.head<2>()).has_value(), pixel_is_bad);
      }
}

TEST(Camera, TheImageEndsHalfAPixelOutsideTheOuterCentres) {
  const CameraModel camera{CameraKind::pinhole, 640, 480, 1.0, 1.0, 0.0, 0.0, {}};
  EXPECT_TRUE(in_image(camera, {-0.5, 479.4}));
  EXPECT_FALSE(in_image(camera, {-0.6, 0.0}));
  EXPECT_FALSE(in_image(camera, {639.5, 0.0}));
  EXPECT_TRUE(in_image(camera, {9.5, 9.5}, 10.0));
  EXPECT_FALSE(in_image(camera, {9.4, 20.0}, 10.0));
  EXPECT_FALSE(in_image(camera, {kNan, 0.0}));
}

TEST(Camera, BadCalibrationsAreRefusedByName) {
  const CameraModel pinhole = cameras().front();
  const CameraModel sphere = cameras()[5];
  const auto refusal = [](CameraModel camera, auto change) {
    change(camera);
    const auto status = check_camera(camera);
    return status ? std::string("accepted") : status.error().message;
  };
  const auto has = [](const std::string& text, const char* part) { return text.find(part) != std::string::npos; };
  EXPECT_TRUE(has(refusal(pinhole, [](auto& c) { c.kind = static_cast<CameraKind>(7); }), "camera kind 7"));
  EXPECT_TRUE(has(refusal(pinhole, [](auto& c) { c.width_px = 0; }), "0 x 480 pixels"));
  EXPECT_TRUE(has(refusal(pinhole, [](auto& c) { c.fx = -458.0; }), "focal lengths -458"));
  EXPECT_TRUE(has(refusal(pinhole, [](auto& c) { c.fy = kNan; }), "nan"));
  EXPECT_TRUE(has(refusal(pinhole, [](auto& c) { c.cx = kInfinity; }), "principal point inf"));
  EXPECT_TRUE(has(refusal(pinhole, [](auto& c) { c.distortion[2] = kNan; }), "coefficient 3"));
  EXPECT_TRUE(has(refusal(pinhole, [](auto& c) { c.distortion[4] = 0.1; }), "more than four coefficients"));
  EXPECT_TRUE(has(refusal(sphere, [](auto& c) { c.distortion[0] = 1.0; }), "xi 1"));
  EXPECT_TRUE(has(refusal(sphere, [](auto& c) { c.distortion[1] = 1.1; }), "alpha 1.1"));
  EXPECT_TRUE(has(refusal(sphere, [](auto& c) { c.distortion[3] = 0.1; }), "two coefficients"));
}

}  // namespace camera_test
}  // namespace tutti
