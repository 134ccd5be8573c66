// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/robot_images.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "support/mission/asl_folder.hpp"
#include "tutti/base/file.hpp"
#include "tutti/formats/trajectory_file.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/mission/recordings.hpp"
#include "tutti/mission/runner.hpp"
#include "tutti/simulation/camera.hpp"
#include "tutti/simulation/flight.hpp"
#include "tutti/simulation/imu.hpp"

namespace tutti::mission {
namespace robot_images_test {

namespace fs = std::filesystem;

constexpr Timestamp kStart{1'403'636'579'763'555'584};
constexpr double kRate_hz = 8.0;

std::vector<Camera> small_stereo() {
  const CameraModel model = simulation::halved(
      simulation::halved({CameraKind::pinhole, 752, 480, 458.7, 457.3, 367.2, 248.4, {-0.283, 0.074, 2e-4, 1.8e-5}}));
  const Eigen::Quaterniond ahead((Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished());
  return {{model, {ahead, {0.0, 0.055, 0.0}}}, {model, {ahead, {0.0, -0.055, 0.0}}}};
}

/// The simulated hall, written as an ASL folder `hall` and as a list, and the true trajectory as odometry.
class RobotImages : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const simulation::FlightConfig flight{.duration_s = 4.0, .rate_hz = kRate_hz};
    const Trajectory truth = simulation::simulate_flight(flight, kStart);
    const auto scene = std::make_shared<const simulation::HallScene>(simulation::make_hall({}, Rng(1)));
    const ImageStream stream = simulation::simulate_images(scene, small_stereo(), truth, {}, Rng(3));
    const auto imu = simulation::simulate_imu([&](double time_s) { return simulation::flight_motion(flight, time_s); },
                                              kStart, flight.duration_s, {}, Rng(4));
    test::write_asl_folder(folder() / "hall", stream, imu);
    ASSERT_TRUE(formats::write_tum((folder() / "odometry.tum").string(), truth));
    std::ofstream list(folder() / "list.csv");
    for (const Timestamp stamp : stream.stamps) list << fmt::format("{0},hall/mav0/cam0/data/{0}.png\n", stamp.ns);
    const auto& [m, T_body_camera] = stream.cameras[0];
    std::ofstream(folder() / "cameras.yaml") << fmt::format(
        "cameras:\n  - {{width_px: {}, height_px: {}, intrinsics: [{}, {}, {}, {}], distortion: [{}, {}, {}, {}], "
        "T_body_camera: {}}}\n",
        m.width_px, m.height_px, m.fx, m.fy, m.cx, m.cy, m.distortion[0], m.distortion[1], m.distortion[2],
        m.distortion[3], test::matrix_of(T_body_camera));
  }
  static void TearDownTestSuite() { fs::remove_all(folder()); }
  static fs::path folder() { return fs::path(testing::TempDir()) / "tutti_robot_images"; }

  RobotImages() {
    config_.robots = {{.name = "a", .odometry = {.file = "odometry.tum"}, .images = {.euroc_folder = "hall"}}};
    config_.agent.submap.duration_s = 2.0;
    config_.closures.verifier = "visual";
    config_.tracking.tracker.descriptors.kind = "orb";
  }
  [[nodiscard]] MissionRecord run() const {
    auto record = run_mission(config_, {.data = folder()});
    EXPECT_TRUE(record.has_value()) << record.error().message;
    return record ? std::move(*record) : MissionRecord{};
  }
  /// The error of the first sample's images.
  [[nodiscard]] std::string first_error() const {
    auto input = load_input(config_, folder(), 1);
    if (!input) return input.error().message;
    VisualSource& source = *input->robots[0].recording.visual;
    static_cast<void>(source.images(0, true));
    const auto errors = source.take_errors();
    return errors.empty() ? "" : errors[0].message;
  }

  MissionConfig config_;
};

bool has_note(const MissionRecord& record, const std::string& expected) {
  return std::ranges::any_of(record.notes,
                             [&](const std::string& note) { return note.find(expected) != std::string::npos; });
}
std::string all_notes(const MissionRecord& record) { return fmt::format("{}", fmt::join(record.notes, "\n")); }

TEST_F(RobotImages, AnEurocFolderBecomesSubmapsWithLandmarks) {
  for (const int cameras : {1, 2}) {
    config_.robots[0].images.most_cameras = cameras;
    const MissionRecord record = run();
    ASSERT_EQ(record.robots.size(), 1U);
    EXPECT_TRUE(has_note(record, cameras == 1 ? "33 images of one camera" : "33 images of each of two cameras"))
        << all_notes(record);
    EXPECT_FALSE(has_note(record, "refused")) << all_notes(record);
    const auto& images = record.robots[0].images;
    ASSERT_TRUE(images.has_value());
    EXPECT_EQ(images->keyframes, record.robots[0].keyframes);
    EXPECT_GT(images->landmarks_per_keyframe, 20.0 * cameras);
    EXPECT_GT(images->reprojection_rms_px, 0.05);
    EXPECT_LT(images->reprojection_rms_px, 0.6);
  }
}

/// The odometry is the true trajectory; the calibration has the second camera 40 % too far from the first.
TEST_F(RobotImages, ABaselineThatOdometryContradictsIsReported) {
  const fs::path wrong = folder() / "wrong";
  fs::copy(folder() / "hall", wrong, fs::copy_options::recursive);
  const fs::path sensor = wrong / "mav0/cam1/sensor.yaml";
  std::stringstream text;
  text << std::ifstream(sensor).rdbuf();
  std::string yaml = text.str();
  const std::size_t at = yaml.find("-0.055");
  ASSERT_NE(at, std::string::npos) << yaml;
  std::ofstream(sensor) << yaml.replace(at, 6, "-0.099");
  EXPECT_FALSE(has_note(run(), "its cameras together"));
  config_.robots[0].images.euroc_folder = "wrong";
  const MissionRecord record = run();
  EXPECT_TRUE(has_note(record, "a: its cameras together have its trajectory 1.")) << all_notes(record);
}

/// The calibration has the second camera turned by 0.9 degrees about the upright axis, which bends depths.
TEST_F(RobotImages, ASecondCameraThatIsTurnedIsReported) {
  const fs::path wrong = folder() / "turned";
  fs::copy(folder() / "hall", wrong, fs::copy_options::recursive);
  const Camera second = small_stereo()[1];
  const Pose3 given{second.T_body_camera.rotation * so3_exp({0.0, 0.9 * kRadPerDeg, 0.0}),
                    second.T_body_camera.translation};
  const fs::path sensor = wrong / "mav0/cam1/sensor.yaml";
  std::stringstream text;
  text << std::ifstream(sensor).rdbuf();
  std::string yaml = text.str();
  const std::size_t begin = yaml.find('['), end = yaml.find(']') + 1;
  std::ofstream(sensor) << yaml.replace(begin, end - begin, test::matrix_of(given));
  EXPECT_FALSE(has_note(run(), "the second camera is turned"));
  config_.robots[0].images.euroc_folder = "turned";
  const MissionRecord without = run();
  EXPECT_TRUE(has_note(without, "the second camera is turned against its T_body_camera by [")) << all_notes(without);
  config_.tracking.turned_stereo = "correct";
  const MissionRecord corrected = run();
  EXPECT_TRUE(has_note(corrected, "once it is turned; it is turned so")) << all_notes(corrected);
  EXPECT_GT(corrected.robots[0].images->landmarks_per_keyframe, 1.3 * without.robots[0].images->landmarks_per_keyframe);
  EXPECT_FALSE(has_note(corrected, "its cameras together")) << all_notes(corrected);
}

TEST_F(RobotImages, AListWithACamerasFileIsTheSame) {
  config_.robots[0].images.most_cameras = 1;
  const auto folder = load_input(config_, RobotImages::folder(), 1);
  config_.robots[0].images = {.list = "list.csv", .cameras = "cameras.yaml", .imu = "hall/mav0/imu0/data.csv"};
  const auto list = load_input(config_, RobotImages::folder(), 1);
  ASSERT_TRUE(folder && list) << list.error().message;
  const auto images = [](const Result<MissionInput>& input) {
    return input->robots[0].recording.visual->images(0, true).images.at(0);
  };
  EXPECT_EQ(images(folder), images(list));
  EXPECT_EQ(folder->robots[0].recording.imu, list->robots[0].recording.imu);
  EXPECT_FALSE(list->robots[0].recording.imu.empty());
}

/// Depth of the same flight, beside list.csv.
void write_depth(const fs::path& folder, double units_per_m) {
  const Trajectory truth = simulation::simulate_flight({.duration_s = 4.0, .rate_hz = kRate_hz}, kStart);
  const auto scene = std::make_shared<const simulation::HallScene>(simulation::make_hall({}, Rng(1)));
  const ImageStream stream = simulation::simulate_images(scene, {small_stereo()[0]}, truth, {}, Rng(3),
                                                         DepthSensor{.unit_m = 1.0 / units_per_m});
  std::ofstream list(folder / "depth.csv");
  for (std::size_t i = 0; i < stream.stamps.size(); ++i) {
    const std::string file = fmt::format("depth_{}.png", i);
    ASSERT_TRUE(write_file((folder / file).string(), formats::encode_depth(stream.load_depth(i).value())));
    list << fmt::format("{},{}\n", (stream.stamps[i] + 0.01).ns, file);
  }
}

TEST_F(RobotImages, AnRgbdCameraMeasuresDepthWithoutMoving) {
  write_depth(folder(), 5000.0);
  auto& images = config_.robots[0].images;
  images = {.list = "list.csv", .cameras = "cameras.yaml"};
  const MissionRecord without = run();
  images.depth.list = "depth.csv";
  const MissionRecord record = run();
  EXPECT_TRUE(has_note(record, "33 images of one camera with depth")) << all_notes(record);
  EXPECT_FALSE(has_note(record, "refused") || has_note(record, "its cameras together")) << all_notes(record);
  ASSERT_TRUE(record.robots[0].images && without.robots[0].images) << all_notes(record);
  EXPECT_GT(record.robots[0].images->landmarks_per_keyframe, 1.5 * without.robots[0].images->landmarks_per_keyframe);
  EXPECT_LT(record.robots[0].images->reprojection_rms_px, 2.0);
}

TEST_F(RobotImages, DepthImagesThatAreNoneAreReported) {
  auto& images = config_.robots[0].images;
  images = {.list = "list.csv", .cameras = "cameras.yaml", .depth = {.list = "depth.csv"}};
  const auto run_notes = [&] { return all_notes(run()); };
  const auto expect = [](const std::string& notes, const std::string& expected) {
    EXPECT_NE(notes.find(expected), std::string::npos) << "'" << expected << "' in:\n" << notes;
  };
  write_depth(folder(), 5000.0);
  images.depth.scale = 1000.0;
  expect(run_notes(), "are there 1000 of their numbers to a metre?");
  write_depth(folder(), 1000.0);
  images.depth.scale = 1100.0;
  expect(run_notes(), "its cameras together have its trajectory 0.9");
  images.depth.scale = 1000.0;
  const auto replace = [&](const DepthImage& depth) {
    for (std::size_t i = 0; i <= 32; ++i)
      ASSERT_TRUE(write_file((folder() / fmt::format("depth_{}.png", i)).string(), formats::encode_depth(depth)));
  };
  replace({188, 120, std::vector<std::uint16_t>(188U * 120U)});
  expect(run_notes(), "depth is not known (0) at 100 %");
  replace({94, 60, std::vector<std::uint16_t>(94U * 60U, 1000)});
  expect(run_notes(), "a depth image of 94 x 60 pixels, its camera has 188 x 120");
  ASSERT_TRUE(write_file((folder() / "depth_0.png").string(), formats::encode_png(Image(188, 120))));
  expect(first_error(), "depth_0.png: 8 bits of grey, expected a grey PNG image of 16 bits");
  fs::remove(folder() / "depth_0.png");
  expect(first_error(), "depth_0.png");
  std::ofstream(folder() / "depth.csv") << fmt::format("{},depth_1.png\n", (kStart + 3600.0).ns);
  const auto late = load_input(config_, folder(), 1);
  ASSERT_FALSE(late);
  expect(late.error().message, "of 33 images and 1 depth images 0 are within 0.02 s");
}

TEST_F(RobotImages, StampsOfAnotherClockAreReportedAndTheOffsetIsASetting) {
  config_.robots[0].images.time_offset_s = 0.03;
  EXPECT_NE(first_error().find("add -0.0300 "), std::string::npos) << first_error();
  EXPECT_NE(first_error().find("images.time_offset_s is 0.03"), std::string::npos) << first_error();
  config_.robots[0].images.time_offset_s = -1'403'636'000.0;
  EXPECT_NE(first_error().find("begin 1403636000.000 s before"), std::string::npos) << first_error();
  const MissionRecord record = run();  // goes on
  EXPECT_TRUE(has_note(record, "a: 1 times images refused, the first because: images from")) << all_notes(record);
  EXPECT_EQ(record.robots[0].submaps, 2U);
  EXPECT_FALSE(record.robots[0].images.has_value());
  ASSERT_FALSE(record.warnings.empty());
  EXPECT_EQ(record.warnings[0].find("a: none of its images are used: images from"), 0U) << record.warnings[0];
  // Images of a camera that counts from another second.
  auto& images = config_.robots[0].images;
  images = {.list = "late.csv", .cameras = "cameras.yaml", .time_offset_s = -0.03};
  std::ofstream late(folder() / "late.csv");
  for (int i = 0; i <= 4 * kRate_hz; ++i)
    late << fmt::format("{},hall/mav0/cam0/data/{}.png\n", (kStart + (i / kRate_hz + 0.03)).ns,
                        (kStart + i / kRate_hz).ns);
  late.close();
  EXPECT_EQ(first_error(), "");
}

TEST_F(RobotImages, LostImagesAreLostAloneAndNamed) {
  auto& images = config_.robots[0].images;
  images = {.list = "lost.csv", .cameras = "cameras.yaml"};
  std::ofstream lost(folder() / "lost.csv");
  for (int i = 0; i <= 3 * kRate_hz; ++i)  // and stops a second before the end
    lost << fmt::format("{},hall/mav0/cam0/data/{}.png\n", (kStart + i / kRate_hz).ns,
                        i % 8 == 7 ? 0 : (kStart + i / kRate_hz).ns);
  lost.close();
  const MissionRecord record = run();
  EXPECT_TRUE(has_note(record, "a: 3 times images refused, the first because: ")) << all_notes(record);
  EXPECT_TRUE(has_note(record, "a: no image at ")) << all_notes(record);
  EXPECT_TRUE(has_note(record, "hall/mav0/cam0/data/0.png")) << all_notes(record);
  ASSERT_TRUE(record.robots[0].images.has_value());
  EXPECT_GT(record.robots[0].images->landmarks_per_keyframe, 20.0);
}

TEST_F(RobotImages, ARecordingWithoutAReadableImageIsRefused) {
  std::ofstream list(folder() / "nowhere.csv");
  for (int i = 0; i <= 3 * kRate_hz; ++i) list << fmt::format("{},nowhere/{}.png\n", (kStart + i / kRate_hz).ns, i);
  list.close();
  config_.robots[0].images = {.list = "nowhere.csv", .cameras = "cameras.yaml"};
  EXPECT_NE(first_error().find("robot a: images: none of the first can be read: "), std::string::npos) << first_error();
  EXPECT_NE(first_error().find("nowhere/0.png"), std::string::npos) << first_error();
}

TEST_F(RobotImages, MissingRowsAndACameraOnItsSideAreReportedOfEveryRobot) {
  std::ifstream good(folder() / "cameras.yaml");
  std::string text((std::istreambuf_iterator<char>(good)), {});
  const Eigen::Quaterniond ahead((Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished());
  const Eigen::Quaterniond lying(ahead * Eigen::AngleAxisd(0.5 * M_PI, Eigen::Vector3d::UnitZ()));
  text = text.substr(0, text.find("T_body_camera")) + "T_body_camera: " + test::matrix_of({lying, {0.0, 0.055, 0.0}}) +
         "}\n";
  std::ofstream(folder() / "lying.yaml") << text;
  std::ofstream list(folder() / "half.csv");
  for (int i = 0; i <= 4 * kRate_hz; ++i)
    if (i % 4 < 2) list << fmt::format("{0},hall/mav0/cam0/data/{0}.png\n", (kStart + i / kRate_hz).ns);
  list.close();
  config_.robots[0].images = {.list = "list.csv", .cameras = "lying.yaml"};
  config_.robots.push_back(config_.robots[0]);
  config_.robots[1].name = "b";
  for (const MissionRecord record = run(); const char* name : {"a", "b"})
    EXPECT_TRUE(has_note(record, fmt::format("{}: 1 times images refused", name))) << all_notes(record);
  for (RobotConfig& robot : config_.robots) robot.images.list = "half.csv", robot.images.cameras = "cameras.yaml";
  for (const MissionRecord record = run(); const char* name : {"a", "b"}) {
    EXPECT_TRUE(has_note(record, fmt::format("{}: 17 images of one camera, no IMU; at 8.0 Hz", name)))
        << all_notes(record);
  }
}

TEST_F(RobotImages, AWrongCalibrationIsReportedBeforeAnythingIsMerged) {
  std::ifstream good(folder() / "cameras.yaml");
  std::string text((std::istreambuf_iterator<char>(good)), {});
  const std::size_t at = text.find("T_body_camera");
  text = text.substr(0, at) + "T_body_camera: " + test::matrix_of({}) + "}\n";  // looks up
  std::ofstream(folder() / "wrong.yaml") << text;
  config_.robots[0].images = {.list = "list.csv", .cameras = "wrong.yaml"};
  const MissionRecord record = run();
  EXPECT_TRUE(has_note(record, "a: 2 times images refused, the first because: images of submap")) << all_notes(record);
  EXPECT_TRUE(has_note(record, "calibration, camera pose on the body, stamps or odometry are wrong"))
      << all_notes(record);
  EXPECT_EQ(record.robots[0].submaps, 2U);
  EXPECT_FALSE(record.robots[0].images.has_value());
}

TEST_F(RobotImages, WhatIsNotThereIsNamedBeforeTheMission) {
  config_.robots[0].images = {.euroc_folder = "euroc/MH_01"};
  EXPECT_EQ(first_error(),
            fmt::format("robot a: images.euroc_folder: {}/euroc/MH_01: there is no folder cam0, expected EuRoC's "
                        "mav0/cam0 (docs/data.md says where recordings come from)",
                        folder().string()));
  config_.robots[0].images = {.list = "list.csv", .cameras = "nothing.yaml"};
  EXPECT_NE(first_error().find("robot a: images.cameras: "), std::string::npos) << first_error();
  EXPECT_NE(first_error().find("nothing.yaml"), std::string::npos) << first_error();
}

}  // namespace robot_images_test
}  // namespace tutti::mission
