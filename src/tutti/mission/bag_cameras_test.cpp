// SPDX-License-Identifier: BSD-3-Clause
// Depth images of a bag.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <functional>

#include "support/bags/robot_bag.hpp"
#include "tutti/bags/ros_encode.hpp"
#include "tutti/base/config_io.hpp"
#include "tutti/formats/image_file.hpp"
#include "tutti/mission/bag_mission.hpp"
#include "tutti/mission/recordings.hpp"

namespace tutti::mission {
namespace bag_cameras_test {

using namespace bags::test;
namespace fs = std::filesystem;

constexpr Timestamp kStart{1'700'000'000'000'000'000};
constexpr std::uint32_t kWidth = 160, kHeight = 120;
constexpr double kImages_s = 0.1;
constexpr int kImages = 20;
const Pose3 kBodyCamera{Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5), {0.1, 0.0, 0.3}};

/// A topic of depth, and how it differs from one that is registered to the camera.
struct Depth {
  std::string name = "/depth", frame = "camera", encoding = "16UC1";
  std::uint32_t width = kWidth, height = kHeight;
  double focal_px = 100.0;
  double period_s = kImages_s, offset_s = 0.0;
  int count = kImages;
  bool is_big = false, has_info = true;
  /// Changes message i, from 0.
  std::function<void(int, bags::RosImage&)> change = [](int, bags::RosImage&) {};
};

/// Depth image i has 1000 + i mm everywhere; of its first pixel nothing is known.
std::string pixels(const Depth& depth, int i) {
  std::string out;
  for (std::uint32_t k = 0; k < depth.width * depth.height; ++k) {
    const double depth_m = k == 0 ? NAN : 1.0 + 0.001 * i;
    std::string bytes;
    if (depth.encoding == "mono8")
      bytes = std::string(1, static_cast<char>(i % 200));
    else if (depth.encoding == "32FC1")
      bytes = little(static_cast<float>(depth_m));
    else
      bytes = little(static_cast<std::uint16_t>(k == 0 ? 0 : 1000 + i));
    if (depth.is_big) std::ranges::reverse(bytes);
    out += bytes;
  }
  return out;
}

class BagCameras : public testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  static std::vector<Sample> robot() {
    Trajectory odometry;
    for (int i = 0; i < 5 * kImages; ++i)
      odometry.push_back({kStart + 0.2 * kImages_s * i, {Eigen::Quaterniond::Identity(), {0.01 * i, 0, 0}}});
    std::vector<Sample> out;
    for (const StampedPose& sample : odometry)
      out.push_back(sample_of("/odom", kOdometry, sample.stamp, odometry_of(sample.stamp, sample.pose)));
    return with_camera(std::move(out), odometry, kBodyCamera, "mono8");
  }
  static void add(std::vector<Sample>& samples, const Depth& depth) {
    const std::uint32_t bytes = depth.encoding == "mono8" ? 1 : depth.encoding == "32FC1" ? 4 : 2;
    for (int i = 0; i < depth.count; ++i) {
      const Timestamp stamp = kStart + (depth.offset_s + depth.period_s * i);
      const std::string data = pixels(depth, i);
      bags::RosImage image{.header = {stamp, depth.frame}, .height = depth.height, .width = depth.width};
      image.encoding = depth.encoding;
      image.is_bigendian = depth.is_big;
      image.step = bytes * depth.width;
      image.data = data;
      depth.change(i, image);
      bags::RosCameraInfo info{.header = image.header, .height = depth.height, .width = depth.width};
      info.distortion_model = "plumb_bob";
      info.k = {depth.focal_px, 0, 80, 0, depth.focal_px, 60, 0, 0, 1};
      samples.push_back(
          sample_of(depth.name + "/image_raw", "sensor_msgs/msg/Image", kStart + 0.1 * i, bags::encode(image)));
      if (depth.has_info)
        samples.push_back(
            sample_of(depth.name + "/camera_info", "sensor_msgs/msg/CameraInfo", kStart + 0.1 * i, bags::encode(info)));
    }
  }

  /// A mission's recording of the robot with these topics of depth.
  Recording load(const std::vector<Depth>& depths, const std::vector<std::string>& topics = {},
                 const std::vector<std::string>& settings = {}) {
    std::vector<Sample> samples = robot();
    for (const Depth& depth : depths) add(samples, depth);
    return load_samples(std::move(samples), topics, settings);
  }
  Recording load_samples(std::vector<Sample> samples, const std::vector<std::string>& topics = {},
                         const std::vector<std::string>& settings = {}) {
    std::ranges::stable_sort(samples, {}, &Sample::ns);
    write_bytes(folder_ / "bag", mcap_of(samples, "zstd", 37));
    auto root = parse_yaml(bag_mission({"alpha=" + (folder_ / "bag").string()}, topics).value(), "--bag").value();
    EXPECT_TRUE(apply_override(root, "closures.verifier=visual"));
    for (const std::string& setting : settings) EXPECT_TRUE(apply_override(root, setting));
    MissionConfig config;
    EXPECT_TRUE(load_config(root, config, "--bag"));
    auto input = load_input(config, "", 1);
    EXPECT_TRUE(input) << input.error().message;
    notes_.clear();
    if (!input) return {};
    for (const std::string& note : input->robots.front().notes) notes_ += note + "\n";
    return input->robots.front().recording;
  }
  void expect_note(const std::string& part) const { EXPECT_NE(notes_.find(part), std::string::npos) << notes_; }
  static std::vector<std::uint16_t> first_two(const Recording& recording, std::size_t instant) {
    const auto depth = recording.images->load_depth(instant);
    if (!depth || depth->empty()) return {};
    return {depth->value[0], depth->value[1]};
  }

  const fs::path folder_ = fs::path(testing::TempDir()) / fmt::format("bag_cameras_{}", getpid());
  std::string notes_;
};

using FirstTwo = std::vector<std::uint16_t>;

TEST_F(BagCameras, ACameraWithRegisteredDepthIsAnRgbdCamera) {
  for (const Depth& depth : {Depth{}, Depth{.encoding = "32FC1"}, Depth{.is_big = true},
                             Depth{.encoding = "32FC1", .is_big = true}, Depth{.focal_px = 100.9}}) {
    const Recording recording = load({depth});
    ASSERT_NE(recording.images, nullptr) << notes_;
    EXPECT_EQ(recording.images->cameras.size(), 1U);
    ASSERT_TRUE(recording.images->load_depth) << notes_;
    EXPECT_EQ(recording.images->depth, DepthSensor{});
    EXPECT_EQ(first_two(recording, 0), (FirstTwo{0, 1000}));
    EXPECT_EQ(first_two(recording, 7), (FirstTwo{0, 1007}));
    expect_note(fmt::format("images of /camera/image_raw, depth of /depth/image_raw ({})", depth.encoding));
    expect_note("20 images of one camera with depth");
    expect_note("20 of them have depth");
  }
  EXPECT_EQ(load({Depth{}}, {}, {"robots.0.images.depth.most_m=4", "robots.0.images.time_offset_s=0.001"})
                .images->depth.most_m,
            4.0);
}

TEST_F(BagCameras, CompressedDepthIsTakenAlike) {
  std::vector<Sample> samples = robot();
  for (int i = 0; i < kImages; ++i) {
    DepthImage depth{kWidth, kHeight,
                     std::vector<std::uint16_t>(kWidth * kHeight, static_cast<std::uint16_t>(900 + i))};
    const std::string file = std::string(12, '\0') + formats::encode_depth(depth);
    const Timestamp stamp = kStart + kImages_s * i;
    samples.push_back(
        sample_of("/camera/image_raw/compressedDepth", "sensor_msgs/msg/CompressedImage", stamp,
                  bags::encode(bags::RosCompressedImage{
                      .header = {stamp, "camera"}, .format = "16UC1; compressedDepth png", .data = file})));
  }
  const Recording recording = load_samples(samples);
  ASSERT_TRUE(recording.images && recording.images->load_depth) << notes_;
  EXPECT_EQ(first_two(recording, 3), (FirstTwo{903, 903}));
}

/// A camera of 333 Hz has three images within 5 ms of a stamp of the other's.
TEST_F(BagCameras, OfASecondCameraTheNearestImageIsTaken) {
  constexpr double kPeriod_s = 0.003, kOffset_s = 0.0005;
  const Recording recording = load({Depth{.name = "/second",
                                          .encoding = "mono8",
                                          .period_s = kPeriod_s,
                                          .offset_s = kOffset_s,
                                          .count = static_cast<int>(kImages * kImages_s / kPeriod_s)}},
                                   {"alpha.images=/camera/image_raw,/second/image_raw"});
  ASSERT_NE(recording.images, nullptr) << notes_;
  ASSERT_EQ(recording.images->cameras.size(), 2U);
  for (std::size_t instant = 0; instant + 1 < kImages; ++instant) {
    const auto image = recording.images->load(instant, 1);
    ASSERT_TRUE(image) << image.error().message;
    ASSERT_FALSE(image->empty()) << instant;
    const long nearest = std::lround((kImages_s * static_cast<double>(instant) - kOffset_s) / kPeriod_s);
    EXPECT_EQ(image->grey.front(), nearest % 200) << instant;
  }
}

/// Depth of any kind is no second camera; what does not fit is reported with what was expected.
TEST_F(BagCameras, DepthThatIsNotRegisteredIsReported) {
  const std::vector<std::pair<Depth, std::string>> cases{
      {{.width = 80}, "/depth/image_raw: 80 x 120 pixels, expected 160 x 120 as of /camera/image_raw"},
      {{.focal_px = 102}, "fx 102.0, fy 102.0, cx 80.0, cy 60.0 in its CameraInfo, expected 100.0, 100.0, 80.0, 60.0"},
      {{.frame = "depth_optical"}, "frame 'depth_optical', expected 'camera' as of /camera/image_raw"},
      {{.frame = "imu"}, "m and"},
      {{.has_info = false},
       "no sensor_msgs/CameraInfo beside it; if its frame and size are the camera's: --topic "
       "alpha.depth=/depth/image_raw"}};
  for (const auto& [depth, why] : cases) {
    const Recording recording = load({depth});
    ASSERT_NE(recording.images, nullptr) << notes_;
    EXPECT_EQ(recording.images->cameras.size(), 1U);
    EXPECT_FALSE(recording.images->load_depth);
    expect_note("no depth is used: ");
    expect_note(why);
  }
  EXPECT_TRUE(load({{.has_info = false}}, {"alpha.depth=/depth/image_raw"}).images->load_depth) << notes_;
  EXPECT_FALSE(load({{.encoding = "64FC1"}}).images->load_depth);
  EXPECT_EQ(notes_.find("no depth"), std::string::npos);  // it is none
}

TEST_F(BagCameras, OfSeveralTopicsTheFlagDecides) {
  const Depth one, other{.name = "/other"}, unfit{.name = "/raw", .width = 80};
  EXPECT_TRUE(load({one, unfit}).images->load_depth);
  EXPECT_FALSE(load({one, other}).images->load_depth);
  expect_note(
      "2 topics are registered to /camera/image_raw, /depth/image_raw and /other/image_raw; say which: --topic "
      "alpha.depth=/depth/image_raw");
  EXPECT_TRUE(load({one, other}, {"alpha.depth=/other/image_raw"}).images->load_depth);
  expect_note("depth of /other/image_raw");
  EXPECT_FALSE(load({one}, {"alpha.depth=none"}).images->load_depth);
  EXPECT_EQ(notes_.find("depth is"), std::string::npos) << notes_;
  EXPECT_FALSE(load({one}, {"alpha.depth=/camera/image_raw"}).images->load_depth);
  expect_note("'/camera/image_raw' is no topic of 16UC1 or 32FC1 in the bag, expected one of: /depth/image_raw");
}

TEST_F(BagCameras, DepthOfAnotherRateAndDepthThatEndsServeWhatTheyCan) {
  const Recording slow = load({{.period_s = 3.07 * kImages_s, .count = 6}});
  EXPECT_EQ(first_two(slow, 0), (FirstTwo{0, 1000}));
  EXPECT_EQ(first_two(slow, 1), FirstTwo{});
  EXPECT_EQ(first_two(slow, 3), (FirstTwo{0, 1001}));  // 7 ms later
  EXPECT_EQ(first_two(slow, 9), FirstTwo{});           // 21 ms
  expect_note("3 of them have depth");
  const Recording fast = load({{.period_s = 0.35 * kImages_s, .offset_s = -0.001, .count = 60}});
  EXPECT_EQ(first_two(fast, 1), (FirstTwo{0, 1003}));
  expect_note("20 of them have depth");
  const Recording half = load({{.count = kImages / 2}});
  EXPECT_EQ(first_two(half, 9), (FirstTwo{0, 1009}));
  EXPECT_EQ(first_two(half, 10), FirstTwo{});
  expect_note("10 of them have depth");
  EXPECT_FALSE(load({{.offset_s = 0.05}}).images->load_depth);
  expect_note("no depth is used: /depth/image_raw: images.depth: of 20 images and 20 depth images 0 are within 0.02 s");
  EXPECT_TRUE(load({{.offset_s = 0.05}}, {}, {"robots.0.images.depth.max_difference_s=0.06"}).images->load_depth);
}

TEST_F(BagCameras, WrongDepthImagesAreLeftOutOneByOne) {
  const Depth depth{.change = [](int i, bags::RosImage& image) {
    if (i == 3) image.header.stamp = kStart;  // jumps back
    if (i == 4) image.encoding = "32FC1";
    if (i == 5) image.step = 10;
    if (i == 6) image.data.remove_suffix(1);
    if (i == 7) image.header.frame_id = "other";
    if (i == 8) image.width = 80;
    if (i == 9) image.height = 0xffffffff;
  }};
  const Recording recording = load({depth});
  ASSERT_TRUE(recording.images->load_depth) << notes_;
  expect_note(
      fmt::format("/depth/image_raw: 7 of 20 messages refused, the first because: message 4: stamp {} ns, "
                  "which another message has, too",
                  kStart.ns));
  expect_note("13 of them have depth");
  for (std::size_t instant = 3; instant < 10; ++instant)
    EXPECT_EQ(first_two(recording, instant), FirstTwo{}) << instant;
  EXPECT_EQ(first_two(recording, 10), (FirstTwo{0, 1010}));
  load({{.change = [](int, bags::RosImage& image) { image.step = 10; }}});
  expect_note(
      "no depth is used: /depth/image_raw: 20 of 20 messages refused, the first because: message 1: 160 x 120 "
      "pixels of 2 bytes, rows of 10 bytes, 38400 bytes in all");
}

/// Before the mission runs, as of a live topic.
TEST_F(BagCameras, ImagesOfTooFewBytesAreRefused) {
  const Depth camera{.name = "/second", .encoding = "mono8", .change = [](int i, bags::RosImage& image) {
                       if (i == 2) image.data.remove_suffix(1);
                     }};
  ASSERT_NE(load({camera}, {"alpha.images=/second/image_raw"}).images, nullptr) << notes_;
  expect_note(
      "/second/image_raw: 1 of 20 messages refused, the first because: message 3: 160 x 120 pixels of 1 bytes, rows "
      "of 160 bytes, 19199 bytes in all");
}

/// As of a live topic.
TEST_F(BagCameras, TheFirstCalibrationThatIsValidCounts) {
  std::vector<Sample> samples = robot();
  bags::RosCameraInfo binned{.header = {kStart, "camera"}, .height = kHeight, .width = kWidth};
  binned.k = {100, 0, 80, 0, 100, 60, 0, 0, 1};
  binned.binning_x = 2;
  samples.insert(samples.begin(),
                 sample_of("/camera/camera_info", "sensor_msgs/msg/CameraInfo", kStart, bags::encode(binned)));
  EXPECT_NE(load_samples(std::move(samples)).images, nullptr) << notes_;
}

TEST_F(BagCameras, AnImuThatNoTransformLeadsToIsNotUsed) {
  std::vector<Sample> samples = robot();
  const bags::RosImu imu{.header = {kStart, "nowhere"}};
  samples.push_back(sample_of("/other", "sensor_msgs/msg/Imu", kStart, bags::encode(imu)));
  EXPECT_TRUE(load_samples(std::move(samples), {"alpha.imu=/other"}).imu.empty());
  expect_note(
      "no IMU is used: /other: no transform from 'nowhere' to 'base_link', frames that do not move are: base_link, "
      "camera, imu");
}

/// A range that is none would make every depth unknown.
TEST_F(BagCameras, ARangeThatIsNoneIsRefused) {
  std::vector<Sample> samples = robot();
  add(samples, {});
  std::ranges::stable_sort(samples, {}, &Sample::ns);
  write_bytes(folder_ / "bag", mcap_of(samples, "zstd", 37));
  MissionConfig config;
  config.closures.verifier = "visual";
  config.robots = {{.name = "alpha", .bag = (folder_ / "bag").string()}};
  config.robots[0].images.depth.sensor.most_m = 0.1;
  const auto input = load_input(config, "", 1);
  ASSERT_FALSE(input);
  EXPECT_NE(input.error().message.find("images.depth: least_m is 0.3, expected less than most_m, 0.1"),
            std::string::npos)
      << input.error().message;
}

}  // namespace bag_cameras_test
}  // namespace tutti::mission
