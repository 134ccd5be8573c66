// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/rgbd.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

namespace tutti::bags {
namespace rgbd_test {

RosCameraInfo info(double focal_px, double x_px = 320.0, std::uint32_t width_px = 640) {
  RosCameraInfo out;
  out.width = width_px;
  out.height = 480;
  out.k = {focal_px, 0, x_px, 0, focal_px, 240, 0, 0, 1};
  return out;
}

/// The topics of a RealSense: depth as its left infrared camera sees it, and aligned to the colour camera.
const ImageTopic kColour{"/color/image_raw", false, ImageLayout{"rgb8", "color_optical", 640, 480}, info(610)},
    kInfra1{"/infra1/image_rect_raw", false, ImageLayout{"mono8", "infra1_optical", 848, 480}, info(420, 320, 848)},
    kInfra2{"/infra2/image_rect_raw", false, ImageLayout{"mono8", "infra2_optical", 848, 480}, info(420, 320, 848)},
    kAligned{"/aligned_depth_to_color/image_raw", false, ImageLayout{"16UC1", "color_optical", 640, 480}, info(610)},
    kDepth{"/depth/image_rect_raw", false, ImageLayout{"16UC1", "depth_optical", 848, 480}, info(420, 320, 848)};

std::optional<Pose3> find(const std::string& a, const std::string& b) {
  const std::map<std::string, Eigen::Vector3d> places{{"color_optical", {0.015, 0, 0}},
                                                      {"infra1_optical", {0, 0, 0}},
                                                      {"infra2_optical", {0.05, 0, 0}},
                                                      {"depth_optical", {0, 0, 0}}};
  if (!places.contains(a) || !places.contains(b)) return std::nullopt;
  return Pose3{Eigen::Quaterniond::Identity(), places.at(b) - places.at(a)};
}

Result<CameraChoice> choose(const std::vector<ImageTopic>& cameras, const std::vector<ImageTopic>& depths,
                            bool are_named = false, int most = 2) {
  return choose_cameras(
      cameras, depths,
      {.are_named = are_named, .most_cameras = most, .images_flag = "--images ", .depth_flag = "--depth "}, find);
}

std::string why(const ImageTopic& depth, const ImageTopic& camera) {
  const Status ok = check_registered(depth, camera, find);
  return ok ? "" : ok.error().message;
}

TEST(Rgbd, DepthIsRegisteredBySizeMatrixAndPlace) {
  EXPECT_EQ(why(kAligned, kColour), "");
  EXPECT_EQ(why(kDepth, kInfra1), "");  // two frames at one place
  EXPECT_EQ(why(kDepth, kColour), "848 x 480 pixels, expected 640 x 480 as of /color/image_raw");
  EXPECT_EQ(why(kDepth, kInfra2),
            "frame 'depth_optical', 0.050 m and 0.0000 rad from 'infra2_optical' of /infra2/image_rect_raw, expected "
            "the same place within 0.001 m and 0.001 rad");
  ImageTopic depth = kAligned;
  depth.info = info(610.9, 319.2);
  EXPECT_EQ(why(depth, kColour), "");
  depth.info = info(612);
  EXPECT_EQ(why(depth, kColour),
            "fx 612.0, fy 612.0, cx 320.0, cy 240.0 in its CameraInfo, expected 610.0, 610.0, 320.0, 240.0 within 1 px "
            "as of /color/image_raw");
  depth.info = info(NAN);
  EXPECT_NE(why(depth, kColour), "");
  depth.info.reset();
  EXPECT_EQ(why(depth, kColour), "");
  depth.first->frame = "elsewhere";
  EXPECT_EQ(
      why(depth, kColour),
      "frame 'elsewhere', expected 'color_optical' as of /color/image_raw, or one at the same place (no transform "
      "links them)");
}

TEST(Rgbd, WhatIsThereRawAndCompressedCountsOnce) {
  ImageTopic colour = kColour, depth = kAligned, rectified = kColour;
  colour.topic += "/compressed";
  depth.topic += "/compressedDepth";
  colour.is_compressed = depth.is_compressed = true;
  const auto choice = choose({kColour, colour}, {kAligned, depth}).value();
  EXPECT_EQ(choice.cameras, std::vector<std::size_t>{0});
  EXPECT_EQ(choice.depth, 0U);
  EXPECT_EQ(choose({colour}, {depth})->depth, 0U);
  rectified.topic = "/color/image_rect";
  EXPECT_EQ(choose({kColour, rectified}, {}).error().message,
            "/color/image_rect shows what /color/camera_info calibrates, and another does too, expected one; say "
            "which: --images /color/image_rect");
}

TEST(Rgbd, OneCameraHasTheDepthThatIsRegisteredToIt) {
  const auto choice = choose({kColour}, {kAligned, kDepth}).value();
  EXPECT_EQ(choice.cameras, std::vector<std::size_t>{0});
  EXPECT_EQ(choice.depth, 0U);
  EXPECT_EQ(choice.note, "");
  EXPECT_EQ(choose({kColour}, {kDepth, kAligned})->depth, 1U);
  EXPECT_EQ(choose({kInfra1}, {kAligned, kDepth})->depth, 1U);
  EXPECT_EQ(choose({kColour}, {})->note, "");
  EXPECT_TRUE(choose({}, {kDepth})->cameras.empty());
}

TEST(Rgbd, NoneOrSeveralAreReportedWithTheFlag) {
  const auto none = choose({kColour}, {kDepth}).value();
  EXPECT_EQ(none.cameras.size(), 1U);
  EXPECT_FALSE(none.depth);
  EXPECT_EQ(none.note,
            "no depth is used: none is registered to /color/image_raw: /depth/image_rect_raw: 848 x 480 "
            "pixels, expected 640 x 480 as of /color/image_raw");
  ImageTopic confidence = kAligned;
  confidence.topic = "/confidence";
  const auto several = choose({kColour}, {kAligned, confidence}).value();
  EXPECT_FALSE(several.depth);
  EXPECT_EQ(several.note,
            "no depth is used: 2 topics are registered to /color/image_raw, /aligned_depth_to_color/image_raw and "
            "/confidence; say which: --depth /aligned_depth_to_color/image_raw");
}

TEST(Rgbd, OfSeveralCamerasTheOneWithDepthIsUsed) {
  const auto one = choose({kColour, kInfra1, kInfra2}, {kAligned}).value();
  EXPECT_EQ(one.cameras, std::vector<std::size_t>{0});
  EXPECT_EQ(one.depth, 0U);
  EXPECT_EQ(choose({kColour, kInfra1}, {kDepth})->cameras, std::vector<std::size_t>{1});
  EXPECT_EQ(
      choose({kColour, kInfra1}, {kAligned, kDepth}).error().message,
      "2 cameras with depth (/color/image_raw with /aligned_depth_to_color/image_raw, /infra1/image_rect_raw with "
      "/depth/image_rect_raw), expected one; say which: --images /color/image_raw");
  EXPECT_EQ(choose({kColour, kInfra1}, {kAligned, kDepth}, false, 1)->depth, 0U);  // of two only the first
  EXPECT_EQ(choose({kColour, kInfra1, kInfra2}, {}).error().message,
            "3 cameras, expected one or two; say which: --images "
            "/color/image_raw,/infra1/image_rect_raw,/infra2/image_rect_raw");
}

TEST(Rgbd, TwoThatAreNamedAreAStereoPair) {
  const auto pair = choose({kInfra1, kInfra2}, {kDepth}, true).value();
  EXPECT_EQ(pair.cameras.size(), 2U);
  EXPECT_FALSE(pair.depth);
  EXPECT_EQ(
      pair.note,
      "no depth is used: it goes with one camera, but /infra1/image_rect_raw and /infra2/image_rect_raw are used; "
      "/depth/image_rect_raw is registered to /infra1/image_rect_raw: --images /infra1/image_rect_raw");
  EXPECT_EQ(
      choose({kInfra1, kInfra2}, {kAligned})->note,
      "no depth is used: it goes with one camera, but /infra1/image_rect_raw and /infra2/image_rect_raw are used");
  EXPECT_EQ(choose({kInfra1, kInfra2}, {}, true)->note, "");
}

}  // namespace rgbd_test
}  // namespace tutti::bags
