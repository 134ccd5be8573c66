// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "tutti/base/file.hpp"
#include "tutti/formats/image_file.hpp"
#include "tutti/model/image_stream.hpp"
#include "tutti/model/visual.hpp"

/// Recordings of our own making, written as EuRoC's are.
namespace tutti::mission::test {

inline std::string matrix_of(const Pose3& pose) {
  const Eigen::Matrix3d R = pose.rotation.toRotationMatrix();
  std::string out;
  for (int row = 0; row < 3; ++row)
    out += fmt::format("{:.17g}, {:.17g}, {:.17g}, {:.17g}, ", R(row, 0), R(row, 1), R(row, 2), pose.translation[row]);
  return "[" + out + "0, 0, 0, 1]";
}

/// All cameras are pinholes with radial-tangential distortion.
inline void write_asl_folder(const std::filesystem::path& folder, const ImageStream& stream,
                             const std::vector<ImuSample>& imu) {
  for (std::size_t c = 0; c < stream.cameras.size(); ++c) {
    const std::filesystem::path camera = folder / "mav0" / fmt::format("cam{}", c);
    std::filesystem::create_directories(camera / "data");
    const auto& [m, T_body_camera] = stream.cameras[c];
    std::ofstream(camera / "sensor.yaml") << fmt::format(
        "T_BS:\n  data: {}\nresolution: [{}, {}]\ncamera_model: pinhole\nintrinsics: [{}, {}, {}, {}]\n"
        "distortion_model: radial-tangential\ndistortion_coefficients: [{}]\n",
        matrix_of(T_body_camera), m.width_px, m.height_px, m.fx, m.fy, m.cx, m.cy,
        fmt::format("{}, {}, {}, {}", m.distortion[0], m.distortion[1], m.distortion[2], m.distortion[3]));
    std::ofstream list(camera / "data.csv");
    for (std::size_t i = 0; i < stream.stamps.size(); ++i) {
      const std::string file = fmt::format("{}.png", stream.stamps[i].ns);
      list << fmt::format("{},{}\n", stream.stamps[i].ns, file);
      const Status written =
          write_file((camera / "data" / file).string(), formats::encode_png(stream.load(i, c).value()));
      if (!written) throw std::runtime_error(written.error().message);
    }
  }
  const std::filesystem::path of_imu = folder / "mav0" / "imu0";
  std::filesystem::create_directories(of_imu);
  std::ofstream(of_imu / "sensor.yaml") << fmt::format(
      "T_BS:\n  data: {}\ngyroscope_noise_density: 1.7e-4\ngyroscope_random_walk: 2e-5\n"
      "accelerometer_noise_density: 2e-3\naccelerometer_random_walk: 3e-3\n",
      matrix_of({}));
  std::ofstream samples(of_imu / "data.csv");
  for (const ImuSample& s : imu)
    samples << fmt::format("{},{},{},{},{},{},{}\n", s.stamp.ns, s.gyro.x(), s.gyro.y(), s.gyro.z(),
                           s.accelerometer.x(), s.accelerometer.y(), s.accelerometer.z());
}

}  // namespace tutti::mission::test
