// SPDX-License-Identifier: BSD-3-Clause
// A robot with two cameras and no LiDAR against its own odometry.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "support/perception/visual/textured_room.hpp"
#include "support/random_pose.hpp"
#include "tutti/geometry/covariance.hpp"
#include "tutti/robot/agent.hpp"

namespace tutti::robot {
namespace fit_images_test {

constexpr Timestamp kStart{1'700'000'000'000'000'000LL};
constexpr double kStep_s = 0.05, kDuration_s = 90.0, kTick_s = 0.5;

Pose3 truth_at(double t) {
  const double u = 0.2 * t;
  return {so3_exp({0, 0, u + 0.3 * std::sin(0.7 * t)}), {4.0 + 2.0 * std::cos(u), 3.0 + 1.2 * std::sin(u), 1.4}};
}

struct Flight {
  double baseline = 1.0;  ///< As stated, of the true one.
  double frozen_from_s = 1e9, frozen_for_s = 4.0;
  std::string fit = "use";

  std::vector<fit::Misfit> said;
  std::vector<Submap> submaps;
  std::uint64_t steps = 0, images = 0;

  [[nodiscard]] Pose3 odometry_at(double t) const {
    if (t < frozen_from_s) return truth_at(t);
    const Pose3 stood = truth_at(frozen_from_s), moved = truth_at(frozen_from_s + frozen_for_s);
    return t < frozen_from_s + frozen_for_s ? stood : stood * moved.inverse() * truth_at(t);
  }
  void fly() {
    const auto room = visual::test::textured_room(900, Rng(1));
    const auto cameras = visual::test::stereo_cameras();
    const auto stated = std::make_shared<const std::vector<Camera>>(visual::test::stereo_cameras(baseline));
    AgentConfig config;
    config.submap.has_images = true;
    config.submap.fit.scans = fit;
    RobotAgent agent(RobotId{0}, 1, config);
    const Matrix6d covariance = diagonal_covariance(1e-3, 1e-4);
    const auto every = static_cast<int>(kTick_s / kStep_s);
    for (int k = 0; k * kStep_s < kDuration_s; ++k) {
      const double t = k * kStep_s;
      ASSERT_TRUE(agent.add(OdometrySample{kStart + t, odometry_at(t), covariance}));
      if (k % every == 0 && agent.wants_images(kStart + t)) {
        TrackedImages seen{.stamp = kStart + t, .cameras = stated, .images = {}, .imu = {}, .imu_noise = {}};
        Rng rng = Rng(2).fork(static_cast<std::uint64_t>(k));
        for (std::uint32_t c = 0; c < 2; ++c)
          seen.images.push_back(visual::test::look(room, cameras[c], c, truth_at(t), {.pixel_noise_px = 0.3}, rng));
        ASSERT_TRUE(agent.add(seen));
        ++images;
      }
      collect(agent);
    }
    agent.finish();
    collect(agent);
    steps = agent.fit().registrations();
  }
  void collect(RobotAgent& agent) {
    for (SubmapMessage& message : agent.take_outgoing()) submaps.push_back(std::move(message.submap));
    for (const fit::Misfit& misfit : agent.take_misfits()) said.push_back(misfit);
  }
  [[nodiscard]] double worst_m() const {
    double worst = 0.0;
    const Keyframe& first = submaps.front().keyframes.front();
    for (const Submap& submap : submaps)
      for (const Keyframe& k : submap.keyframes) {
        const Pose3 moved = first.T_odom_body.inverse() * k.T_odom_body;
        const Pose3 truly = truth_at(first.stamp - kStart).inverse() * truth_at(k.stamp - kStart);
        worst = std::max(worst, (moved.translation - truly.translation).norm());
      }
    return worst;
  }
};

TEST(FitImages, AnHonestRobotIsLeftAloneForOneStepAnImage) {
  Flight run, off{.fit = "off"};
  run.fly();
  off.fly();
  for (const fit::Misfit& misfit : run.said) ADD_FAILURE() << to_string(misfit);
  EXPECT_GT(run.images, 80U);
  EXPECT_GT(run.steps, run.images / 2);
  EXPECT_LE(run.steps, run.images);
  EXPECT_EQ(off.steps, 0U);
  ASSERT_EQ(run.submaps.size(), off.submaps.size());
  for (std::size_t i = 0; i < run.submaps.size(); ++i) EXPECT_EQ(run.submaps[i].keyframes, off.submaps[i].keyframes);
}

TEST(FitImages, ABaselineThatIsStatedWronglyIsSaidWithItsSize) {
  for (const double baseline : {1.05, 0.95}) {
    Flight run{.baseline = baseline};
    run.fly();
    ASSERT_EQ(run.said.size(), 1U) << baseline;
    EXPECT_EQ(run.said[0].kind, fit::MisfitKind::scale);
    EXPECT_EQ(run.said[0].by, fit::Witness::images);
    EXPECT_NEAR(run.said[0].value, baseline, 0.01);
    EXPECT_NE(to_string(run.said[0]).find("times those of its images"), std::string::npos);
    EXPECT_NE(way_on(run.said[0]).find("baseline"), std::string::npos);
  }
}

TEST(FitImages, WhereOdometryStoodStillSubmapsHaveTheImagesMotion) {
  Flight mended{.frozen_from_s = 21.0}, raw{.frozen_from_s = 21.0, .fit = "say"};
  mended.fly();
  raw.fly();
  EXPECT_GT(raw.worst_m(), 0.8);
  EXPECT_LT(mended.worst_m(), 0.15);
  ASSERT_FALSE(mended.said.empty());
  EXPECT_EQ(mended.said[0].kind, fit::MisfitKind::stood_still);
  EXPECT_NE(to_string(mended.said[0]).find("its images moved"), std::string::npos);
}

}  // namespace fit_images_test
}  // namespace tutti::robot
