// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/frontend/tracking_source.hpp"

#include <gtest/gtest.h>

#include <set>

#include "support/perception/visual/frontend/blocks.hpp"

namespace tutti::visual {
namespace tracking_source_test {

constexpr int kWidth = 320, kHeight = 240;

Camera camera() {
  return {.model = {CameraKind::pinhole, kWidth, kHeight, 200.0, 200.0, 159.5, 119.5, {}}, .T_body_camera = {}};
}

/// Images every 50 ms, past a wall.
ImageStream wall(std::size_t instants, double offset_s = 0.0) {
  ImageStream out{.cameras = {camera()}, .stamps = {}, .load = {}};
  for (std::size_t i = 0; i < instants; ++i)
    out.stamps.push_back(Timestamp{1'000'000'000} + (0.05 * static_cast<double>(i) + offset_s));
  out.load = [](std::size_t instant, std::size_t) -> Result<Image> {
    return blocks(kWidth, kHeight, 4 * static_cast<int>(instant));
  };
  return out;
}

Trajectory straight(std::size_t samples, double step_s) {
  Trajectory out;
  for (std::size_t i = 0; i < samples; ++i)
    out.push_back({Timestamp{1'000'000'000} + step_s * static_cast<double>(i),
                   {Eigen::Quaterniond::Identity(), {0.1 * static_cast<double>(i), 0.0, 0.0}}});
  return out;
}

std::set<std::uint64_t> tracks(const TrackedImage& image) {
  std::set<std::uint64_t> out;
  for (const TrackedKeypoint& it : image.keypoints)
    if (it.track != 0) out.insert(it.track);
  return out;
}

TEST(TrackingSource, ServesTheImagesOfSamplesAndFollowsThroughAll) {
  const auto source = TrackingSource::open(wall(41), straight(11, 0.2), {}).value();
  std::set<std::uint64_t> last;
  for (std::size_t sample = 0; sample < 11; ++sample) {
    const auto images = source->images(sample, sample % 3 == 0).images;
    ASSERT_EQ(images.size(), 1U) << sample;
    EXPECT_EQ(images[0].descriptors.size() > 0, sample % 3 == 0) << sample;
    EXPECT_TRUE(check_images({Timestamp{0}, std::make_shared<const std::vector<Camera>>(1, camera()), images}));
    std::size_t kept = 0;
    const auto now = tracks(images[0]);
    for (const auto number : now) kept += last.contains(number) ? 1 : 0;
    // Four images on, 16 px away.
    if (sample > 0) {
      EXPECT_GE(kept, 8 * now.size() / 10) << sample;
    }
    last = now;
  }
  EXPECT_TRUE(source->images(3, false).images.empty());  // asked for again
  EXPECT_TRUE(source->take_errors().empty());
}

TEST(TrackingSource, ARestartBeginsInTheMiddle) {
  ImageStream stream = wall(41);
  std::vector<std::size_t> read;
  stream.load = [&](std::size_t instant, std::size_t) -> Result<Image> {
    read.push_back(instant);
    return blocks(kWidth, kHeight, 4 * static_cast<int>(instant));
  };
  const auto source = TrackingSource::open(stream, straight(11, 0.2), {}).value();
  const auto first = tracks(source->images(5, true).images.at(0));
  EXPECT_EQ(read, (std::vector<std::size_t>{20}));
  const auto whole = TrackingSource::open(wall(41), straight(11, 0.2), {}).value();
  for (std::size_t sample = 0; sample < 5; ++sample)  // Up to here before the restart: the numbers are not used again.
    EXPECT_LT(*tracks(whole->images(sample, true).images.at(0)).rbegin(), *first.begin());
  EXPECT_EQ(source->images(6, false).images.size(), 1U);
  EXPECT_EQ(read, (std::vector<std::size_t>{20, 21, 22, 23, 24}));
}

TEST(TrackingSource, ABadImageIsLostAloneAndNamed) {
  ImageStream stream = wall(41);
  stream.load = [](std::size_t instant, std::size_t) -> Result<Image> {
    if (instant == 8) return fail(ErrorCode::parse, "frame_8.png: damaged");
    if (instant == 9) return fail(ErrorCode::io, "frame_9.png: missing");
    if (instant == 16) return Image(64, 64);
    if (instant == 24) return Image();  // none was taken
    return blocks(kWidth, kHeight, 4 * static_cast<int>(instant));
  };
  const auto source = TrackingSource::open(stream, straight(11, 0.2), {}).value();
  const auto before = tracks(source->images(1, false).images.at(0));
  EXPECT_TRUE(source->images(2, false).images.empty());
  EXPECT_EQ(source->take_errors().at(0).message, "frame_8.png: damaged");
  std::size_t kept = 0;
  for (const auto number : tracks(source->images(3, false).images.at(0))) kept += before.contains(number) ? 1 : 0;
  EXPECT_GE(kept, before.size() / 2);  // goes on
  EXPECT_TRUE(source->images(4, false).images.empty());
  const auto errors = source->take_errors();
  ASSERT_EQ(errors.size(), 2U);
  EXPECT_EQ(errors[0].message, "frame_9.png: missing");
  EXPECT_EQ(errors[1].message, "camera 0 at 1800000000 ns: an image of 64 x 64 pixels, camera 0 has 320 x 240");
  EXPECT_EQ(source->images(5, false).images.size(), 1U);
  EXPECT_TRUE(source->images(6, false).images.empty());
  EXPECT_EQ(source->images(10, false).images.size(), 1U);
  EXPECT_TRUE(source->take_errors().empty());
}

TEST(TrackingSource, AStoppedCameraLeavesOdometryAlone) {
  const auto source = TrackingSource::open(wall(9), straight(11, 0.2), {}).value();
  for (std::size_t sample = 0; sample < 11; ++sample)
    EXPECT_EQ(source->images(sample, false).images.size(), sample <= 2 ? 1U : 0U) << sample;
}

TEST(TrackingSource, StampsOfAnotherClockAreRefusedWithTheOffset) {
  const auto shifted = TrackingSource::open(wall(41, 0.02), straight(11, 0.2), {});
  ASSERT_FALSE(shifted.has_value());
  EXPECT_EQ(
      shifted.error().message,
      "of 10 odometry samples that could have an image 0 have one within 0.005 s: to come to the nearest sample, add "
      "-0.0200 or 0.0300 s to the images' stamps (medians; -0.0200 to -0.0200 for the middle half of the former), "
      "which "
      "is the offset of their clocks or none; the stamps do not tell, nor does what moves in the images");
  const auto elsewhere = TrackingSource::open(wall(41, -3600.0), straight(11, 0.2), {});
  ASSERT_FALSE(elsewhere.has_value());
  EXPECT_NE(elsewhere.error().message.find("the images begin 3600.000 s before the odometry"), std::string::npos);
  EXPECT_FALSE(TrackingSource::open(wall(0), straight(11, 0.2), {}).has_value());
  EXPECT_FALSE(TrackingSource::open(wall(41), {}, {}).has_value());

  ImageStream broken = wall(41);
  broken.cameras[0].model.fx = -1.0;
  EXPECT_FALSE(TrackingSource::open(broken, straight(11, 0.2), {}).has_value());
}

}  // namespace tracking_source_test
}  // namespace tutti::visual
