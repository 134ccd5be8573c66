// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/image_folder.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace tutti::formats {
namespace image_folder_test {

namespace fs = std::filesystem;

constexpr const char* kCamera = R"(# General sensor definitions.
sensor_type: camera
comment: VI-Sensor cam0 (MT9M034)
T_BS:
  cols: 4
  rows: 4
  data: [0.0148655429818, -0.999880929698, 0.00414029679422, -0.0216401454975,
         0.999557249008, 0.0149672133247, 0.025715529948, -0.064676986768,
        -0.0257744366974, 0.00375618835797, 0.999660727178, 0.00981073058949,
         0.0, 0.0, 0.0, 1.0]
rate_hz: 20
resolution: [752, 480]
camera_model: pinhole
intrinsics: [458.654, 457.296, 367.215, 248.375] #fu, fv, cu, cv
distortion_model: radial-tangential
distortion_coefficients: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]
)";
constexpr const char* kImu = R"(sensor_type: imu
T_BS:
  cols: 4
  rows: 4
  data: [1.0, 0.0, 0.0, 0.0,
         0.0, 1.0, 0.0, 0.0,
         0.0, 0.0, 1.0, 0.0,
         0.0, 0.0, 0.0, 1.0]
rate_hz: 200
gyroscope_noise_density: 1.6968e-04
gyroscope_random_walk: 1.9393e-05
accelerometer_noise_density: 2.0000e-3
accelerometer_random_walk: 3.0000e-3
)";
constexpr const char* kImages = "#timestamp [ns],filename\n1000,1000.png\n2000,2000.png\r\n";

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), by);
}

class ImageFolder : public ::testing::Test {
 protected:
  ImageFolder() {
    write("mav0/cam0/sensor.yaml", kCamera);
    write("mav0/cam0/data.csv", kImages);
    write("mav0/cam1/sensor.yaml", replaced(kCamera, "radial-tangential", "equidistant"));
    write("mav0/cam1/data.csv", kImages);
    write("mav0/imu0/sensor.yaml", kImu);
    write("mav0/imu0/data.csv", "900,0,0,0,0,0,9.81\n1400,0,0,0,0,0,9.81\n");
  }
  ~ImageFolder() override { fs::remove_all(folder_); }

  [[nodiscard]] std::string path(const std::string& relative) const { return (folder_ / relative).string(); }
  void write(const std::string& relative, const std::string& text) const {
    fs::create_directories((folder_ / relative).parent_path());
    std::ofstream(folder_ / relative) << text;
  }
  /// The error on the EuRoC folder once one file states something else.
  [[nodiscard]] std::string error_with(const std::string& file, const std::string& text) const {
    write(file, text);
    const auto result = read_euroc_folder(folder_.string());
    if (result) return "no error";
    return replaced(result.error().message, folder_.string() + "/", "");
  }

  fs::path folder_ =
      fs::path(::testing::TempDir()) /
      ("tutti_image_folder_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
};

TEST_F(ImageFolder, ReadsEurocsLayout) {
  for (const std::string& given : {folder_.string(), path("mav0")}) {
    const auto read = read_euroc_folder(given);
    ASSERT_TRUE(read) << read.error().message;
    ASSERT_EQ(read->cameras.size(), 2U);
    const auto& [camera, images] = read->cameras[0];
    EXPECT_EQ(camera.model.kind, CameraKind::pinhole);
    EXPECT_EQ(camera.model.width_px, 752);
    EXPECT_EQ(camera.model.cy, 248.375);
    EXPECT_EQ(camera.model.distortion[3], 1.76187114e-05);
    EXPECT_NEAR((camera.T_body_camera.rotation * Eigen::Vector3d::UnitX()).y(), 0.999557249008, 1e-9);
    EXPECT_EQ(camera.T_body_camera.translation.y(), -0.064676986768);
    EXPECT_EQ(read->cameras[1].camera.model.kind, CameraKind::equidistant);
    ASSERT_EQ(images.size(), 2U);
    EXPECT_EQ(images[1].stamp.ns, 2000);
    EXPECT_EQ(images[1].path, path("mav0/cam0/data/2000.png"));
    EXPECT_EQ(read->imu.size(), 2U);
    EXPECT_EQ(read->imu_noise.gyro_random_walk, 1.9393e-05);
  }
}

TEST_F(ImageFolder, NoImuIsFine) {
  fs::remove_all(folder_ / "mav0/imu0");
  const auto read = read_euroc_folder(folder_.string());
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_TRUE(read->imu.empty());
}

constexpr const char* kTwoCameras = R"(cameras:
  - model: double_sphere
    width_px: 752
    height_px: 480
    intrinsics: [349.7, 348.7, 365.9, 249.3]
    distortion: [-0.24, 0.57]
    T_body_camera: [0, -1, 0, 0.1, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
    time_offset_s: 1.0e-6
  - width_px: 640
    height_px: 480
    intrinsics: [300, 300, 320, 240]
    T_body_camera: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
)";

TEST_F(ImageFolder, OpenCvsFiveAndEightNumbersAreRead) {
  const std::string four = "[-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]", five = "[0.2, -0.9, 0.1, 0.2, 1.1]",
                    eight = "[0.5, -2.5, 0.1, 0.2, 1.4, 0.4, -2.3, 1.4]";
  for (const std::string& numbers : {five, eight}) {
    write("mav0/cam0/sensor.yaml", replaced(kCamera, four, numbers));
    const auto read = read_euroc_folder(folder_.string());
    ASSERT_TRUE(read) << read.error().message;
    const CameraModel& model = read->cameras[0].camera.model;
    EXPECT_EQ(model.kind, CameraKind::rational);
    EXPECT_EQ(model.distortion[4], numbers == five ? 1.1 : 1.4);
    EXPECT_EQ(model.distortion[7], numbers == five ? 0.0 : 1.4);
    write("cameras.yaml",
          replaced(kTwoCameras, "[300, 300, 320, 240]", "[300, 300, 320, 240]\n    distortion: " + numbers));
    const auto ours = read_cameras(path("cameras.yaml"));
    ASSERT_TRUE(ours) << ours.error().message;
    EXPECT_EQ((*ours)[1].camera.model.kind, CameraKind::rational);
    EXPECT_EQ((*ours)[1].camera.model.distortion, model.distortion);
  }
  EXPECT_EQ(error_with("mav0/cam0/sensor.yaml", replaced(kCamera, four, "[0.2, -0.9, 0.1]")),
            "mav0/cam0/sensor.yaml:2: 3 distortion coefficients, expected 4, 5 or 8");
}

TEST_F(ImageFolder, ErrorsInEurocsFilesSayWhereAndWhat) {
  const std::string cam = "mav0/cam0/sensor.yaml";
  EXPECT_EQ(error_with(cam, replaced(kCamera, "intrinsics: [458.654, ", "intrinsics: [")),
            "mav0/cam0/sensor.yaml:14: intrinsics has 3 numbers, expected 4");
  EXPECT_EQ(error_with(cam, replaced(kCamera, "458.654", ".nan")),
            "mav0/cam0/sensor.yaml:14: intrinsics: '.nan' stands there, expected a finite number");
  EXPECT_EQ(error_with(cam, replaced(kCamera, "458.654", "-458.654")),
            "mav0/cam0/sensor.yaml:2: focal lengths -458.654 and 457.296 px; expected positive ones");
  EXPECT_EQ(error_with(cam, replaced(kCamera, "radial-tangential", "fov")),
            "mav0/cam0/sensor.yaml:2: the camera is 'pinhole' with distortion 'fov', expected pinhole with "
            "radial-tangential or equidistant");
  EXPECT_EQ(error_with(cam, replaced(kCamera, "0.999557249008", "0.5")).substr(0, 53),
            "mav0/cam0/sensor.yaml:4: T_BS: |R^T R - I| is 0.749, ");
  EXPECT_EQ(error_with(cam, replaced(kCamera, "resolution", "size")),
            "mav0/cam0/sensor.yaml:2: there is no 'resolution' here");
  write(cam, kCamera);
  EXPECT_EQ(error_with("mav0/cam0/data.csv", "2000,a.png\n1000,b.png\n"),
            "mav0/cam0/data.csv:2: stamp 1000 ns does not come after the previous 2000 ns, expected increasing stamps");
  EXPECT_EQ(error_with("mav0/cam0/data.csv", "#nothing\n"), "mav0/cam0/data.csv: lists no images");
  write("mav0/cam0/data.csv", kImages);
  EXPECT_EQ(error_with("mav0/imu0/sensor.yaml", replaced(kImu, "2.0000e-3", "0")),
            "mav0/imu0/sensor.yaml:1: accelerometer_noise_density is 0, expected a positive number");
  EXPECT_EQ(error_with("mav0/imu0/sensor.yaml", replaced(kImu, "1.0, 0.0, 0.0, 0.0", "1.0, 0.0, 0.0, 0.1")),
            "mav0/imu0/sensor.yaml:1: T_BS of the IMU is not the identity, expected the body to be the IMU");
  fs::remove_all(folder_ / "mav0/cam0");
  EXPECT_EQ(error_with("mav0/x", ""),
            "mav0: there is no folder cam0, expected EuRoC's mav0/cam0 (docs/data.md says where recordings come from)");
}

TEST_F(ImageFolder, ReadsOurCamerasAndAListOfImages) {
  write("cameras.yaml", kTwoCameras);
  write("list.csv", "#stamp,left,right\n1000,l/1.png,r/1.png\n3000,l/3.png,\n5000,,r/5.png\n");
  const auto cameras = read_cameras(path("cameras.yaml"));
  ASSERT_TRUE(cameras) << cameras.error().message;
  ASSERT_EQ(cameras->size(), 2U);
  EXPECT_EQ((*cameras)[0].camera.model.kind, CameraKind::double_sphere);
  EXPECT_EQ((*cameras)[0].camera.T_body_camera.translation.x(), 0.1);
  EXPECT_EQ((*cameras)[1].camera.model.kind, CameraKind::pinhole);
  const auto images = read_image_list(path("list.csv"), path("data"), *cameras);
  ASSERT_TRUE(images) << images.error().message;
  ASSERT_EQ((*images)[0].images.size(), 2U);
  EXPECT_EQ((*images)[0].images[1].stamp.ns, 4000);  // by the body's clock
  EXPECT_EQ((*images)[0].images[1].path, path("data/l/3.png"));
  ASSERT_EQ((*images)[1].images.size(), 2U);
  EXPECT_EQ((*images)[1].images[1].stamp.ns, 5000);
  EXPECT_FALSE(read_image_list(path("list.csv"), path("data"), {(*cameras)[0]}));
  EXPECT_FALSE(read_image_list(path("nowhere.csv"), path("data"), *cameras));
}

TEST_F(ImageFolder, ReadsTumsLists) {
  write("cameras.yaml", kTwoCameras);
  const CameraCalibration camera{read_cameras(path("cameras.yaml"))->at(1).camera, 0.0};
  write("rgb.txt",
        "# color images\n# file: 'rgbd_dataset_freiburg1_xyz.bag'\n# timestamp filename\n"
        "1305031102.175304 rgb/1305031102.175304.png\n1305031102.211214 rgb/1305031102.211214.png\n");
  const auto images = read_image_list(path("rgb.txt"), path("."), {camera});
  ASSERT_TRUE(images) << images.error().message;
  ASSERT_EQ((*images)[0].images.size(), 2U);
  EXPECT_EQ((*images)[0].images[1].stamp.ns, 1305031102211214000);
  EXPECT_EQ((*images)[0].images[1].path, path("./rgb/1305031102.211214.png"));
  write("rgb.txt", "2.5 a.png\n2.5 b.png\n");
  const auto twice = read_image_list(path("rgb.txt"), path("."), {camera});
  ASSERT_FALSE(twice);
  EXPECT_NE(twice.error().message.find("rgb.txt:2: stamp 2.5 s does not come after the previous 2.500000000 s"),
            std::string::npos)
      << twice.error().message;
  write("rgb.txt", "2.5 a.png\nx.5 b.png\n");
  EXPECT_NE(read_image_list(path("rgb.txt"), path("."), {camera}).error().message.find("expected decimal seconds"),
            std::string::npos);
  EXPECT_NE(read_image_list(path("rgb.txt"), path("."), {camera, camera}).error().message.find("of one camera"),
            std::string::npos);
}

TEST_F(ImageFolder, ErrorsInOurCamerasSayWhereAndWhat) {
  const auto error = [&](const std::string& text) {
    write("cameras.yaml", text);
    const auto result = read_cameras(path("cameras.yaml"));
    return result ? "no error" : replaced(result.error().message, folder_.string() + "/", "");
  };
  EXPECT_EQ(error(replaced(kTwoCameras, "-0.24, 0.57", "-0.24")),
            "cameras.yaml: cameras.0: distortion has 1 numbers, expected 2 for double_sphere");
  EXPECT_EQ(
      error(replaced(kTwoCameras, "-0.24, 0.57", "-0.24, 1.57")),
      "cameras.yaml: cameras.0: double sphere with xi -0.24 and alpha 1.57; expected -1 < xi < 1 and 0 <= alpha <= 1");
  EXPECT_EQ(error(replaced(kTwoCameras, "[0, -1,", "[0, 1,")).substr(0, 40),
            "cameras.yaml: cameras.0: T_body_camera: ");
  EXPECT_EQ(error(replaced(kTwoCameras, "320, 240]", "320]")),
            "cameras.yaml: cameras.1: intrinsics has 3 numbers, expected [fx, fy, cx, cy]");
  EXPECT_EQ(error(replaced(kTwoCameras, "double_sphere", "mei")).substr(0, 15), "cameras.yaml:2:");
  EXPECT_EQ(error(replaced(kTwoCameras, "time_offset_s", "offset_s")).substr(0, 15), "cameras.yaml:8:");
  EXPECT_EQ(error("cameras: []\n"), "cameras.yaml: lists no cameras");
}

}  // namespace image_folder_test
}  // namespace tutti::formats
