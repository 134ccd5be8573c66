// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/camera.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>

namespace tutti::bags {
namespace {

/// Without the zeros at the end, which some drivers write behind a model's coefficients.
std::size_t count_coefficients(const std::vector<double>& d) {
  std::size_t out = d.size();
  while (out > 0 && d[out - 1] == 0.0) --out;
  return out;
}

/// By ROS's name what others write: Kalibr, librealsense, OpenCV, in any letters.
std::string model_name(std::string name) {
  std::ranges::transform(name, name.begin(),
                         [](unsigned char c) { return c == '-' ? '_' : static_cast<char>(std::tolower(c)); });
  if (name == "radtan" || name == "radial_tangential" || name == "brown_conrady") return "plumb_bob";
  if (name == "fisheye" || name == "kannala_brandt4" || name == "kannala_brandt") return "equidistant";
  return name;
}

/// Without any distortion it is a pinhole, whatever the model is called. A model that has some must have it whole.
Result<CameraKind> kind_of(const RosCameraInfo& message) {
  const std::string model = model_name(message.distortion_model);
  const std::size_t given = message.d.size(), numbers = count_coefficients(message.d);
  if (numbers == 0) return CameraKind::pinhole;
  if (model == "plumb_bob" && given >= 4 && numbers <= 4) return CameraKind::pinhole;
  if ((model == "plumb_bob" || model == "rational_polynomial") && given >= 4 && numbers <= 8)
    return CameraKind::rational;  // OpenCV's order, whichever of both it is called
  if (model == "equidistant" && given >= 4 && numbers <= 4) return CameraKind::equidistant;
  if (model == "double_sphere" && given >= 2 && numbers <= 2) return CameraKind::double_sphere;
  return fail(ErrorCode::unsupported,
              "distortion_model '{:.40}' with {} numbers, {} before the last zeros, expected plumb_bob or "
              "rational_polynomial (4 to 8), equidistant (4) or double_sphere (2)",
              message.distortion_model, given, numbers);
}

}  // namespace

Result<CameraModel> to_camera(const RosCameraInfo& message) {
  const auto kind = kind_of(message);
  if (!kind) return tl::unexpected(kind.error());
  constexpr std::uint32_t kMost_px = 1 << 16;
  if (message.width > kMost_px || message.height > kMost_px)
    return fail(ErrorCode::invalid, "{} x {} pixels, expected at most {} each", message.width, message.height,
                kMost_px);
  if (message.binning_x > 1 || message.binning_y > 1)
    return fail(ErrorCode::unsupported, "binning {} x {}, expected none", message.binning_x, message.binning_y);
  CameraModel out{.kind = *kind,
                  .width_px = static_cast<int>(message.width),
                  .height_px = static_cast<int>(message.height),
                  .fx = message.k[0],
                  .fy = message.k[4],
                  .cx = message.k[2],
                  .cy = message.k[5]};
  std::copy_n(message.d.begin(), std::min(count_coefficients(message.d), out.distortion.size()),
              out.distortion.begin());
  if (auto ok = check_camera(out); !ok) return in_context("is the camera calibrated?", ok.error());
  return out;
}

std::string camera_info_topic(std::string images, bool is_compressed) {
  for (int steps = is_compressed ? 2 : 1; steps > 0; --steps) images = images.substr(0, images.rfind('/'));
  return images + "/camera_info";
}

Result<ImuSample> to_imu_sample(const RosImu& message) {
  if (!message.angular_velocity.allFinite() || !message.linear_acceleration.allFinite())
    return fail(ErrorCode::invalid, "not all numbers are finite");
  return ImuSample{message.header.stamp, message.angular_velocity, message.linear_acceleration};
}

ImuSample in_body(const ImuSample& sample, const Pose3& T_body_imu) {
  return {sample.stamp, T_body_imu.rotation * sample.gyro, T_body_imu.rotation * sample.accelerometer};
}

Result<Pose3> check_imu_place(const Pose3& T_body_imu) {
  constexpr double kSamePlace_m = 1e-3;
  if (const double away_m = T_body_imu.translation.norm(); away_m > kSamePlace_m)
    return fail(ErrorCode::unsupported, "is {:.3f} m from the body's origin, expected 0", away_m);
  return T_body_imu;
}

}  // namespace tutti::bags
