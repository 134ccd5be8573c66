// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/drive/driver.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "support/robot/drifting_robot.hpp"
#include "tutti/storage/memory_store.hpp"

namespace tutti::drive {
namespace driver_test {

const Trajectory kOdometry = robot::test::drifting_odometry(100);

class DriverTest : public testing::Test {
 protected:
  static robot::AgentConfig config() {
    robot::AgentConfig out;
    out.submap.has_images = true;
    out.submap.keyframe_distance_m = 2.0;
    out.submap.keyframe_angle_deg = 30.0;
    out.submap.keyframe_time_s = 5.0;
    return out;
  }
  void walk_to(std::size_t i) {
    driver_.add(OdometrySample{kOdometry[i].stamp, kOdometry[i].pose, robot::test::kStepCovariance}, {});
  }
  /// The driver sees sample `i`, in which there is something to see if `shows`.
  void see(std::size_t i, bool shows, const std::vector<Error>& errors = {}) {
    const auto track = [&](bool keyframe) {
      ++tracked_;
      keyframes_ += keyframe ? 1 : 0;
      Driver::Seen seen{{.stamp = kOdometry[i].stamp, .cameras = kCameras, .images = {}}, errors};
      TrackedImage image;
      for (std::uint64_t k = 0; k < 100; ++k) image.keypoints.push_back({{1.0F, static_cast<float>(k)}, 1.0F, k + 1});
      if (shows) seen.images.images.push_back(image);
      return seen;
    };
    driver_.see(kOdometry[i].stamp, track, [](Timestamp) { return std::vector<ImuSample>(); }, {});
  }
  /// Why images were refused, since the last call.
  std::vector<std::string> refused() {
    std::vector<std::string> out;
    for (const node::Event& event : driver_.take_step().events)
      if (const auto* images = std::get_if<node::ImagesRefused>(&event.what)) out.push_back(images->why);
    return out;
  }

  inline static const auto kCameras = std::make_shared<const std::vector<Camera>>(
      1, Camera{.model = {.width_px = 640, .height_px = 480, .fx = 400.0, .fy = 400.0, .cx = 320.0, .cy = 240.0},
                .T_body_camera = {}});
  storage::MemoryStore store_{storage::robot_schema()};
  Driver driver_{node::RobotNode::open(RobotId{1}, 7, {.agent = config()}, store_).value()};
  std::size_t tracked_ = 0, keyframes_ = 0;
};

TEST_F(DriverTest, TracksEveryImageAndGivesTheNodeThoseOfKeyframes) {
  for (std::size_t i = 0; i < kOdometry.size(); ++i) {
    walk_to(i);
    see(i, true);
  }
  EXPECT_TRUE(refused().empty());
  EXPECT_EQ(tracked_, kOdometry.size());
  EXPECT_GT(keyframes_, 5U);
  EXPECT_LT(keyframes_, tracked_);
  EXPECT_EQ(driver_.node().agent().keyframes_without_images(), 0U);
  EXPECT_TRUE(driver_.sight().notes().empty());
}

/// However long a row of errors is, who reads the log sees its begin.
TEST_F(DriverTest, ReportsTheFirstErrorOfARowOfImages) {
  const std::vector<Error> two{{ErrorCode::io, "left"}, {ErrorCode::io, "right"}};
  for (std::size_t i = 0; i < 40; ++i) {
    walk_to(i);
    see(i, true, i % 20 < 10 ? std::vector<Error>() : two);
  }
  EXPECT_EQ(refused(), (std::vector<std::string>{"left", "left"}));
  EXPECT_EQ(driver_.more_image_errors(), 2U * 20U - 2U);
}

TEST_F(DriverTest, ReportsACameraThatStops) {
  for (std::size_t i = 0; i < kOdometry.size(); ++i) {
    walk_to(i);
    see(i, i < 20);
  }
  const std::vector<std::string> all = refused();
  ASSERT_EQ(all.size(), 1U);
  EXPECT_NE(all[0].find("the camera gives no images since"), std::string::npos) << all[0];
  EXPECT_EQ(driver_.sight().notes().size(), 1U);
}

TEST_F(DriverTest, TimesUpdatesOfTheMapAndNothingElse) {
  for (std::size_t i = 0; i < kOdometry.size(); ++i) walk_to(i);
  driver_.receive({bus::Endpoint::server(),
                   bus::Endpoint::of(RobotId{1}),
                   bus::MessageKind::proxy_graph,
                   {},
                   std::make_shared<const std::string>("nonsense")},
                  {});
  EXPECT_TRUE(driver_.take_update_times().empty());
  EXPECT_GT(driver_.cpu_s(), 0.0);
}

}  // namespace driver_test
}  // namespace tutti::drive
