// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "support/program/feed/node_target.hpp"
#include "support/robot/drifting_robot.hpp"
#include "tutti/program/feed/feed_front.hpp"

namespace tutti::program {
namespace feed_front_images_test {

const Trajectory kOdometry = robot::test::drifting_odometry(20);

OdometrySample sample(std::size_t i) { return {kOdometry[i].stamp, kOdometry[i].pose, robot::test::kStepCovariance}; }

/// One camera of 8 x 4 pixels, with an IMU.
Sensors eyes() {
  Sensors out;
  out.cameras.resize(1);
  out.cameras[0].model = {.width_px = 8, .height_px = 4, .fx = 5.0, .fy = 5.0, .cx = 3.5, .cy = 1.5};
  out.imu = ImuNoise{};
  return out;
}
EncodedImages images(Timestamp stamp) { return {stamp, {{0, true, std::string(32, 'x')}}, {}}; }
std::vector<ImuSample> imu(Timestamp stamp) { return {{.stamp = stamp}}; }

/// The robot's next input: o, i, s (by what is fed), or a space if there is none.
char next(FeedFront& front) {
  const auto input = front.take(0.0);
  if (!input) return ' ';
  front.note_heard();
  return sample_in<OdometrySample>(*input) ? 'o' : sample_in<EncodedImages>(*input) ? 'i' : 's';
}

/// The lock that odometry's answer needs is held for no copy of what an image set has.
TEST(FeedFrontImages, AreNotCopied) {
  FeedFront front(test::NodeTarget().state(), {});
  front.set_sensors(eyes());
  EXPECT_EQ(next(front), 's');
  EXPECT_TRUE(front.add(sample(0)));
  EXPECT_EQ(next(front), 'o');
  EncodedImages fed = images(kOdometry[0].stamp);
  const char* const bytes = fed.images[0].bytes.data();
  EXPECT_TRUE(front.add(std::move(fed)));
  EXPECT_TRUE(front.add(imu(kOdometry[0].stamp)));
  const auto taken = front.take(0.0);
  ASSERT_TRUE(taken && sample_in<EncodedImages>(*taken));
  EXPECT_EQ(sample_in<EncodedImages>(*taken)->images[0].bytes.data(), bytes);
  front.note_heard();
  front.begin_again(kOdometry[0].stamp);  // the robot fails, and is handed them again
  EXPECT_EQ(next(front), 's');
  const auto again = front.take(0.0);
  ASSERT_TRUE(again && sample_in<EncodedImages>(*again));
  EXPECT_EQ(sample_in<EncodedImages>(*again)->images[0].bytes.data(), bytes);
}

TEST(FeedFrontImages, ImagesComeWhenOdometryAndTheImuHaveReachedThem) {
  FeedFront front(test::NodeTarget().state(), {});
  front.set_sensors(eyes());
  EXPECT_EQ(next(front), 's');
  EXPECT_FALSE(front.add(images(kOdometry[0].stamp)));  // nobody knows yet where that is
  EXPECT_TRUE(front.add(sample(0)));
  EXPECT_EQ(next(front), 'o');
  const Timestamp between = kOdometry[1].stamp + -0.05;
  EXPECT_TRUE(front.add(images(between)));
  EXPECT_EQ(next(front), ' ');
  EXPECT_TRUE(front.add(imu(kOdometry[0].stamp)));
  EXPECT_TRUE(front.add(sample(1)));
  EXPECT_EQ(next(front), 'o');
  EXPECT_EQ(next(front), ' ');
  EXPECT_TRUE(front.add(imu(between + 0.001)));
  EXPECT_EQ(next(front), 'i');
  EXPECT_EQ(front.imu(kOdometry[0].stamp, between).size(), 2U);
  EXPECT_FALSE(front.add(images(between)));  // again
  EXPECT_TRUE(front.add(images(kOdometry[1].stamp)));
  std::size_t i = 2;  // the IMU is not heard any more: it is not waited for
  for (; kOdometry[i].stamp - kOdometry[1].stamp < waiting::kImu_s; ++i) {
    EXPECT_TRUE(front.add(sample(i)));
    EXPECT_EQ(next(front), 'o');
    EXPECT_EQ(next(front), ' ');
  }
  EXPECT_TRUE(front.add(sample(i)));
  EXPECT_EQ(next(front), 'o');
  EXPECT_EQ(next(front), 'i');
}

TEST(FeedFrontImages, StampsThatJumpBackOrFarAheadAreRefusedAndDoNoHarm) {
  FeedFront front(test::NodeTarget().state(), {});
  front.set_sensors(eyes());
  EXPECT_TRUE(front.add(sample(0)));
  const Timestamp now = kOdometry[0].stamp;
  const auto ahead =
      front.add(ImuSamples{{.stamp = now + 0.1}, {.stamp = now + 3600.0}, {.stamp = now + 0.05}, {.stamp = now + 0.2}});
  ASSERT_FALSE(ahead);
  EXPECT_NE(ahead.error().message.find("of 4 IMU samples"), std::string::npos) << ahead.error().message;
  EXPECT_EQ(front.figures().imu, 2U);
  EXPECT_EQ(front.figures().imu_left_out, 2U);
  EXPECT_FALSE(front.add(images(now + 3600.0)));
  EXPECT_TRUE(front.add(images(now + 0.1)));
  EXPECT_FALSE(front.add(images(now + 0.05)));
  EXPECT_EQ(front.figures().images, 1U);
  EXPECT_EQ(front.figures().images_left_out, 2U);
}

TEST(FeedFrontImages, ImagesThatComeTooLateAreRefusedAndSayHowLate) {
  FeedFront front(test::NodeTarget().state(), {});
  front.set_sensors(eyes());
  std::size_t i = 0;
  for (; i == 0 || kOdometry[i - 1].stamp - kOdometry[0].stamp <= waiting::kLate_s; ++i)
    EXPECT_TRUE(front.add(sample(i)));
  const Timestamp now = kOdometry[i - 1].stamp;
  const Status late = front.add(images(now + -waiting::kLate_s - 0.1));
  ASSERT_FALSE(late);
  EXPECT_NE(late.error().message.find("0.6 s after odometry of their time, expected at most 0.5 s"), std::string::npos)
      << late.error().message;
  EXPECT_TRUE(front.add(images(now + -waiting::kLate_s)));
  EXPECT_EQ(front.figures().images_left_out, 1U);
}

/// While images wait for odometry, what comes later is not behind them.
TEST(FeedFrontImages, OdometryPassesImagesThatWaitAndIsJoinedAsWithoutThem) {
  const Trajectory odometry = robot::test::fine_odometry(3);
  const auto run = [&](bool with_images) {
    FeedFront front(test::NodeTarget().state(), {.inputs = 8});
    front.set_sensors(eyes());
    EXPECT_EQ(next(front), 's');
    front.note_stored();
    const auto add = [&](const StampedPose& at) {
      EXPECT_TRUE(front.add(OdometrySample{at.stamp, at.pose, robot::test::kStepCovariance}));
    };
    add(odometry[0]);
    for (std::size_t i = 1; with_images && i <= 3; ++i)
      EXPECT_TRUE(front.add(images(odometry[19].stamp + 0.001 * static_cast<double>(i))));
    std::for_each(odometry.begin() + 1, odometry.begin() + 19, add);
    std::vector<std::int64_t> stamps;
    while (const auto input = front.take(0.0)) {
      front.note_heard();
      stamps.push_back(stamp_of(*input).ns);
    }
    EXPECT_TRUE(front.is_drained());
    front.note_stored();
    EXPECT_EQ(front.load(), FeedFront::Load{});
    EXPECT_TRUE(front.finish());
    EXPECT_EQ(next(front), with_images ? 'i' : 's');
    return stamps;
  };
  const auto alone = run(false);
  EXPECT_LE(alone.size(), 8U);
  EXPECT_EQ(run(true), alone);
}

TEST(FeedFrontImages, WhatWaitsInImagesIsBoundedAndCounted) {
  FeedFront front(test::NodeTarget().state(), {.image_bytes = 1000, .imu = 50});
  Sensors sensors = eyes();
  sensors.imu.reset();
  front.set_sensors(sensors);
  EXPECT_TRUE(front.add(sample(0)));
  for (std::size_t i = 1; i <= 100; ++i) {  // at 60 Hz
    const Timestamp stamp = kOdometry[0].stamp + static_cast<double>(i) / 200.0;
    const auto taken = front.add(images(stamp));
    EXPECT_EQ(taken.has_value(), i <= 31) << i;
    if (!taken) {
      EXPECT_NE(taken.error().message.find("left out"), std::string::npos);
    }
  }
  EXPECT_EQ(front.figures().images_left_out, 69U);
  EXPECT_EQ(front.figures().image_bytes, 31U * 32U);
  ASSERT_EQ(front.state().alerts.size(), 1U);
  EXPECT_NE(front.state().alerts[0].text.find("images are left out"), std::string::npos);
  for (std::size_t i = 1; i <= 10; ++i) EXPECT_TRUE(front.add(sample(i)));
  while (next(front) != ' ') {
  }
  front.note_stored();
  EXPECT_EQ(front.figures().image_bytes, 0U);
  EXPECT_TRUE(front.state().alerts.empty());
  sensors.imu = ImuNoise{};
  front.set_sensors(sensors);
  for (std::size_t i = 1; i <= 100; ++i)
    EXPECT_TRUE(front.add(imu(kOdometry[0].stamp + static_cast<double>(i) / 200.0)));
  EXPECT_EQ(front.imu(kFirstTimestamp, kLastTimestamp).size(), 50U);
}

}  // namespace feed_front_images_test
}  // namespace tutti::program
