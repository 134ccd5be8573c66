// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/maplab_submaps.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include "support/random_pose.hpp"
#include "support/shared_data.hpp"
#include "tutti/base/file.hpp"
#include "tutti/formats/internal/maplab_folder.hpp"
#include "tutti/formats/trajectory_file.hpp"

namespace tutti::formats {
namespace maplab_submaps_test {

namespace fs = std::filesystem;

constexpr const char* kSensors = R"(sensors:
  - id: 01
    sensor_type: IMU
    sigmas:
      gyro_noise_density: 0.0001
      gyro_bias_random_walk_noise_density: 0.0002
      acc_noise_density: 0.003
      acc_bias_random_walk_noise_density: 0.004
  - id: 03
    sensor_type: NCAMERA
    cameras:
      - camera:
          id: 04
          image_height: 480
          image_width: 752
          type: pinhole
          intrinsics:
            rows: 4
            cols: 1
            data: [458, 457, 367, 248]
          distortion:
            type: radial-tangential
            parameters:
              rows: 4
              cols: 1
              data: [-0.28, 0.07, 0.0001, 0.00001]
        T_B_C:
          rows: 4
          cols: 4
          data:
            - [0, -1, 0, 0.1]
            - [1, 0, 0, 0]
            - [0, 0, 1, 0]
            - [0, 0, 0, 1]
extrinsics:
  - sensor_id: 03
    T_B_S: {rows: 4, cols: 4, data: [[1, 0, 0, 0], [0, 1, 0, 2], [0, 0, 1, 0], [0, 0, 0, 1]]}
)";

std::string descriptor(int number) { return fmt::format("{:02x}", number) + std::string(92, '0') + "80"; }

std::string keypoint(int stamp_ns, int index, int u, int track, const std::string& landmark) {
  return fmt::format("{},{},{},20.5,0.80,20.00,{},{},{}\n", stamp_ns, index, u, track, landmark, descriptor(u));
}

/// Two submaps that share keyframe 3000. Landmark a is good in the first and is b in the second; c is bad; d is good in
/// the second alone, seen in the shared keyframe and after it; e is seen once.
class MaplabSubmaps : public ::testing::Test {
 protected:
  MaplabSubmaps() {
    for (const std::string submap : {"s0", "s1"}) write(submap + "/vi_map_raw/sensors.yaml", kSensors);
    write("s0/keyframes.tum", "# M\n0.000001 0 0 0 0 0 0 1\n0.000003 1 0 0 0 0 0 1\n");
    write("s0/landmarks.csv", "a,1000,2,1,2,3,2\nc,1000,1,0,0,0,2\ne,1000,2,1,1,1,1\n");
    write("s0/keypoints.csv", keypoint(3000, 0, 10, 7, "a") + keypoint(3000, 1, 20, 8, "c") +
                                  keypoint(3000, 2, 30, 9, "0") + keypoint(1000, 0, 11, 7, "a") +
                                  keypoint(1000, 1, 40, -1, "e"));
    write("s1/keyframes.tum", "0.000003 1 0 0 0 0 0 1\n0.000005 2 0 0 0 0 0 1\n");
    write("s1/landmarks.csv", "#id\nb,3000,2,1,2,3,2\nd,3000,2,4,5,6,2\n");
    write("s1/keypoints.csv", keypoint(3000, 0, 10, 7, "b") + keypoint(3000, 1, 20, 8, "0") +
                                  keypoint(3000, 2, 30, 9, "d") + keypoint(5000, 0, 31, 9, "d") +
                                  keypoint(5000, 1, 12, 7, "b"));
  }
  ~MaplabSubmaps() override { fs::remove_all(folder_); }

  [[nodiscard]] std::string path(const std::string& relative) const { return (folder_ / relative).string(); }
  [[nodiscard]] Result<MaplabRecording> read() const { return read_maplab_submaps({path("s0"), path("s1")}); }
  void write(const std::string& relative, const std::string& text) const {
    fs::create_directories((folder_ / relative).parent_path());
    std::ofstream(folder_ / relative) << text;
  }
  void write_changed(const std::string& relative, const std::string& what, const std::string& by) const {
    std::string text = read_file(path(relative)).value();
    const std::size_t at = text.find(what);
    ASSERT_NE(at, std::string::npos) << what;
    write(relative, text.replace(at, what.size(), by));
  }
  /// The error once a file is changed; it is put back.
  std::string error_with(const std::string& relative, const std::string& what, const std::string& by) const {
    const std::string before = read_file(path(relative)).value();
    write_changed(relative, what, by);
    const auto result = read();
    write(relative, before);
    if (result) return "no error";
    const std::string& message = result.error().message;
    return message.starts_with(folder_.string()) ? message.substr(folder_.string().size() + 1) : message;
  }

  fs::path folder_ = fs::path(::testing::TempDir()) /
                     ("tutti_maplab_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
};

TEST_F(MaplabSubmaps, LandmarksAreJoinedAtTheSharedKeyframe) {
  const auto recording = read();
  ASSERT_TRUE(recording) << recording.error().message;
  ASSERT_EQ(recording->odometry.size(), 3U);
  EXPECT_EQ(recording->odometry[1].stamp.ns, 3000);
  const auto tracks = [&](std::size_t image) {
    std::vector<std::uint64_t> out;
    for (const auto& keypoint : recording->images[image].keypoints) out.push_back(keypoint.track);
    return out;
  };
  EXPECT_EQ(tracks(0), (std::vector<std::uint64_t>{1, 0}));  // e is seen once
  EXPECT_EQ(tracks(1), (std::vector<std::uint64_t>{1, 0, 2}));
  EXPECT_EQ(tracks(2), (std::vector<std::uint64_t>{2, 1}));
  EXPECT_EQ(recording->summary.keyframes, 3U);
  EXPECT_EQ(recording->summary.keypoints, 7U);
  EXPECT_EQ(recording->summary.good_landmarks, 4U);
  EXPECT_EQ(recording->summary.joined_landmarks, 1U);
  EXPECT_EQ(recording->summary.conflicts, 0U);
}

TEST_F(MaplabSubmaps, KeypointsAndCalibrationAreAsTheFilesSay) {
  const auto recording = read();
  ASSERT_TRUE(recording) << recording.error().message;
  const TrackedImage& image = recording->images[2];
  EXPECT_EQ(image.keypoints[0].pixel, Eigen::Vector2f(31.0F, 20.5F));
  EXPECT_EQ(image.keypoints[0].sigma_px, 0.8F);
  EXPECT_EQ(image.descriptors.kind, DescriptorKind::maplab);
  ASSERT_EQ(image.descriptors.size(), 2U);
  EXPECT_EQ(image.descriptors.row(0)[0], 31U);
  EXPECT_EQ(image.descriptors.row(1)[5], 0x80ULL << 56U);
  ASSERT_EQ(recording->cameras.size(), 1U);
  const Camera& camera = recording->cameras.front();
  EXPECT_EQ(camera.model.height_px, 480);
  EXPECT_EQ(camera.model.distortion, (std::array<double, 8>{-0.28, 0.07, 0.0001, 0.00001}));
  EXPECT_TRUE(test::matrix_near(camera.T_body_camera.translation, Eigen::Vector3d(0.1, 2.0, 0.0), 1e-15));
  EXPECT_TRUE(
      test::matrix_near(camera.T_body_camera.rotation * Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(), 1e-15));
  EXPECT_EQ(recording->imu_noise.accelerometer_random_walk, 0.004);
}

TEST_F(MaplabSubmaps, AnotherFrameMIsContinued) {
  const auto before = read();
  const Pose3 T_other{so3_exp({0.1, 0.2, 0.3}), {5.0, -3.0, 1.0}};
  Trajectory moved = read_trajectory(path("s1/keyframes.tum")).value();
  for (auto& [stamp, pose] : moved) pose = T_other * pose;
  ASSERT_TRUE(write_tum(path("s1/keyframes.tum"), moved));
  const auto after = read();
  ASSERT_TRUE(after) << after.error().message;
  for (std::size_t k = 0; k < 3; ++k)
    EXPECT_TRUE(test::pose_near(after->odometry[k].pose, before->odometry[k].pose, 1e-12));
}

TEST_F(MaplabSubmaps, ConflictsAreCounted) {
  write_changed("s1/keypoints.csv", keypoint(5000, 1, 12, 7, "b"), keypoint(5000, 1, 12, 7, "d"));
  const auto recording = read();
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_EQ(recording->summary.conflicts, 1U);  // d twice in an image
  EXPECT_EQ(recording->images[2].keypoints[1].track, 0U);
  write_changed("s1/keypoints.csv", keypoint(5000, 1, 12, 7, "d"), keypoint(5000, 1, 12, 9, "b"));
  EXPECT_EQ(read()->summary.conflicts, 1U);  // track 9 is d and b
}

TEST_F(MaplabSubmaps, ErrorsSayWhereAndWhat) {
  EXPECT_EQ(error_with("s1/keyframes.tum", "0.000003 1", "0.000004 1"),
            "s1/keypoints.csv:1: stamp 3000 ns is not of a keyframe in keyframes.tum");
  EXPECT_EQ(error_with("s1/keypoints.csv", "3000,0,10,", "3000,0,13,").substr(0, 35),
            "s1: keyframe 0.000003000 has other ");
  EXPECT_EQ(error_with("s1/keypoints.csv", "3000,1,20,", "3000,4,20,"),
            "s1/keypoints.csv:2: keypoint 4 of its keyframe, expected 1");
  EXPECT_EQ(error_with("s1/keypoints.csv", ",b,", ",x,"), "s1/keypoints.csv:1: landmark 'x' is not in landmarks.csv");
  EXPECT_EQ(error_with("s1/keypoints.csv", "20.5", "480.5"),
            "s1/keypoints.csv:1: keypoint at 10, 480.5 px is outside the image of 752 x 480");
  EXPECT_EQ(error_with("s1/keypoints.csv", "20.5", "nan"),
            "s1/keypoints.csv:1: column 4 is 'nan', expected a finite number");
  EXPECT_EQ(error_with("s1/keypoints.csv", "0.80", "0"),
            "s1/keypoints.csv:1: sigma is 0 px, expected a positive one up to 100");
  EXPECT_EQ(error_with("s1/keypoints.csv", "80\n", "8\n").substr(0, 35), "s1/keypoints.csv:1: descriptor is '");
  EXPECT_EQ(error_with("s1/landmarks.csv", "d,3000", "b,3000"), "s1/landmarks.csv:3: landmark 'b' is listed twice");
  EXPECT_EQ(
      error_with("s1/landmarks.csv", "4,5,6,2", "4,5,6"),
      "s1/landmarks.csv:3: row has 6 columns, expected 7 (landmark id,keyframe stamp[ns],quality,x,y,z,observations)");
  const std::string sensors = "s1/vi_map_raw/sensors.yaml";
  EXPECT_EQ(error_with(sensors, "NCAMERA", "LIDAR"), sensors + ":1: there is no NCAMERA here");
  EXPECT_EQ(error_with(sensors, "pinhole", "unified").substr(0, 60), sensors + ":12: the camera is 'unified' with ");
  EXPECT_EQ(error_with(sensors, "458", "459"), "s1: has another camera calibration than " + path("s0"));
  EXPECT_EQ(read_maplab_submaps({path("s0"), path("s0")}).error().message,
            path("s0") + ": begins with keyframe 0.000001000, but " + path("s0") +
                " ends with 0.000003000, expected the same one");
  EXPECT_FALSE(read_maplab_submaps({}));
  EXPECT_FALSE(read_maplab_submaps({path("s2")}));
}

std::vector<std::string> real_submaps() {
  std::vector<std::string> folders;
  for (int i = 0; i < 8; ++i)
    folders.push_back(test::shared_path(fmt::format("data/euroc/V1_01/maplab_submaps/submap_{}", i)).string());
  return folders;
}

TEST(MaplabSubmapsReal, EightSubmapsAreOneRecording) {
  TUTTI_REQUIRE_SHARED("data/euroc/V1_01/maplab_submaps");
  const auto recording = read_maplab_submaps(real_submaps());
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_EQ(recording->summary.keyframes, 152U);
  EXPECT_EQ(recording->summary.keypoints, 72411U);
  EXPECT_EQ(recording->summary.good_landmarks, 18154U);
  EXPECT_EQ(recording->summary.joined_landmarks, 873U);
  EXPECT_EQ(recording->summary.conflicts, 0U);
  const auto known = read_trajectory(test::shared_path("data/euroc/V1_01/rovioli_keyframes.tum"));
  ASSERT_TRUE(known);
  ASSERT_EQ(recording->odometry.size(), known->size());
  for (std::size_t k = 0; k < known->size(); ++k) {
    EXPECT_EQ(recording->odometry[k].stamp, (*known)[k].stamp);
    EXPECT_TRUE(test::pose_near(recording->odometry[k].pose, (*known)[k].pose, 1e-12));
  }
  std::map<std::uint64_t, std::size_t> length;
  for (const TrackedImage& image : recording->images) {
    std::set<std::uint64_t> seen;
    for (const auto& keypoint : image.keypoints) EXPECT_TRUE(keypoint.track == 0 || seen.insert(keypoint.track).second);
    for (const std::uint64_t track : seen) ++length[track];
  }
  for (const auto& [track, images] : length) EXPECT_GE(images, 2U);
}

TEST(MaplabSubmapsReal, GoodLandmarksReprojectAsMeasured) {
  TUTTI_REQUIRE_SHARED("data/euroc/V1_01/maplab_submaps");
  std::vector<double> errors;
  for (const std::string& path : real_submaps()) {
    const auto folder = internal::read_maplab_folder(path);
    ASSERT_TRUE(folder) << folder.error().message;
    for (std::size_t k = 0; k < folder->keyframes.size(); ++k) {
      const Pose3 T_camera_M = (folder->keyframes[k].pose * folder->camera.T_body_camera).inverse();
      for (const auto& keypoint : folder->keypoints[k]) {
        if (keypoint.landmark == kNoIndex) continue;
        const auto pixel = project(folder->camera.model, T_camera_M * folder->landmarks[keypoint.landmark]);
        if (pixel) errors.push_back((*pixel - keypoint.pixel.cast<double>()).norm());
      }
    }
  }
  std::ranges::sort(errors);
  EXPECT_EQ(errors.size(), 39371U);
  EXPECT_NEAR(errors[errors.size() / 2], 1.09, 0.01);
  EXPECT_NEAR(errors[errors.size() * 9 / 10], 3.49, 0.02);
}

}  // namespace maplab_submaps_test
}  // namespace tutti::formats
