// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/camera.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tutti/simulation/flight.hpp"

namespace tutti::simulation {
namespace camera_test {

CameraModel small_camera() {
  return {.kind = CameraKind::pinhole,
          .width_px = 188,
          .height_px = 120,
          .fx = 115.0,
          .fy = 115.0,
          .cx = 93.5,
          .cy = 59.5,
          .distortion = {-0.28, 0.07, 0.0002, 0.00002}};
}

/// T_body_camera of a camera that looks ahead.
const Pose3 kAhead = {Eigen::Quaterniond((Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished()),
                      Eigen::Vector3d::Zero()};

std::shared_ptr<const HallScene> scene() {
  static const auto it = std::make_shared<const HallScene>(make_hall({}, Rng(1)));
  return it;
}

constexpr ImageConfig kIdeal{.noise_sigma = 0.0, .exposure_swing = 0.0};

double mean(const Image& image) {
  double sum = 0.0;
  for (const auto grey : image.grey) sum += grey;
  return sum / static_cast<double>(image.grey.size());
}

TEST(SimulatedCamera, APointLooksAlikeFromElsewhere) {
  const CameraModel model = small_camera();
  const SimulatedCamera camera(scene(), model, kIdeal);
  const Pose3 T_world_a = flight_motion({}, 3.0).T_world_body * kAhead;
  const Pose3 T_world_b = flight_motion({}, 3.2).T_world_body * kAhead;
  const Image a = camera.image(T_world_a, 0.0, Rng(1)), b = camera.image(T_world_b, 0.0, Rng(2));
  int seen = 0, alike = 0, by_chance = 0;
  for (int y = 10; y < 110; y += 3)
    for (int x = 10; x < 178; x += 3) {
      const Eigen::Vector3f ray = (T_world_a.rotation * *unproject(model, {x, y})).cast<float>();
      const auto hit = scene()->surface.cast(T_world_a.translation.cast<float>(), ray, 100.0F);
      ASSERT_TRUE(hit.has_value());  // The hall is closed.
      const Eigen::Vector3d point = T_world_a.translation + (hit->distance * ray).cast<double>();
      const auto pixel = project(model, T_world_b.inverse() * point);
      if (!pixel || !in_image(model, *pixel, 1.0)) continue;
      const auto at = [&](const Image& image, double u, double v) {
        return static_cast<int>(
            image.grey[static_cast<std::size_t>(std::lround(v)) * 188U + static_cast<std::size_t>(std::lround(u))]);
      };
      ++seen;
      alike += std::abs(at(a, x, y) - at(b, pixel->x(), pixel->y())) <= 25 ? 1 : 0;
      by_chance += std::abs(at(a, x, y) - at(b, x, y)) <= 25 ? 1 : 0;
    }
  EXPECT_GE(seen, 1000);
  EXPECT_GE(alike, 0.8 * seen) << alike << " of " << seen;
  EXPECT_LE(by_chance, 0.7 * seen) << by_chance << " of " << seen;
}

TEST(SimulatedCamera, NoiseAndExposureAreAsAsked) {
  const Pose3 T_world_camera = flight_motion({}, 5.0).T_world_body * kAhead;
  const Image clean = SimulatedCamera(scene(), small_camera(), kIdeal).image(T_world_camera, 0.0, Rng(1));
  const SimulatedCamera noisy(scene(), small_camera(), {.noise_sigma = 4.0, .exposure_swing = 0.0});
  const Image image = noisy.image(T_world_camera, 0.0, Rng(1));
  double sum = 0.0, squares = 0.0, n = 0.0;
  for (std::size_t i = 0; i < image.grey.size(); ++i) {
    if (clean.grey[i] < 30 || clean.grey[i] > 225) continue;  // neither black nor white
    const double noise = static_cast<double>(image.grey[i]) - static_cast<double>(clean.grey[i]);
    sum += noise;
    squares += noise * noise;
    n += 1.0;
  }
  EXPECT_NEAR(sum / n, 0.0, 0.15);
  EXPECT_NEAR(std::sqrt(squares / n), 4.0, 0.2);
  EXPECT_EQ(noisy.image(T_world_camera, 0.0, Rng(1)), image);
  EXPECT_NE(noisy.image(T_world_camera, 0.0, Rng(2)), image);

  const SimulatedCamera exposed(scene(), small_camera(),
                                {.noise_sigma = 0.0, .exposure_swing = 0.3, .exposure_period_s = 20.0});
  EXPECT_NEAR(mean(exposed.image(T_world_camera, 15.0, Rng(1))) / mean(clean), 0.7, 0.02);
  EXPECT_GT(mean(exposed.image(T_world_camera, 5.0, Rng(1))), 1.1 * mean(clean));
}

TEST(SimulatedCamera, HalvedSeesTheSame) {
  const Pose3 T_world_camera = flight_motion({}, 5.0).T_world_body * kAhead;
  const CameraModel half = halved(small_camera());
  const Image large = SimulatedCamera(scene(), small_camera(), kIdeal).image(T_world_camera, 0.0, Rng(1));
  const Image small = SimulatedCamera(scene(), half, kIdeal).image(T_world_camera, 0.0, Rng(1));
  ASSERT_EQ(small.grey.size() * 4, large.grey.size());
  int alike = 0;
  for (std::size_t y = 0; y < 60; ++y)
    for (std::size_t x = 0; x < 94; ++x) {
      const auto at = [&](std::size_t dx, std::size_t dy) { return int{large.grey[(2 * y + dy) * 188 + 2 * x + dx]}; };
      const int average = (at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1)) / 4;
      alike += std::abs(average - int{small.grey[y * 94 + x]}) <= 15 ? 1 : 0;
    }
  EXPECT_GE(alike, 0.85 * 94 * 60) << alike;
}

}  // namespace camera_test
}  // namespace tutti::simulation
