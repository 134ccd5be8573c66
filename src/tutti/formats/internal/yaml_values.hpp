// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/base/config_io.hpp"
#include "tutti/geometry/camera.hpp"
#include "tutti/geometry/pose3.hpp"

namespace tutti::formats::internal {

/// Takes values out of calibration files of other programs, whose further keys are none of our business. The first
/// thing that is not as expected is kept as `status`, with file and line; what is read after it is empty.
class YamlValues {
 public:
  explicit YamlValues(std::string name) : name_(std::move(name)) {}
  [[nodiscard]] const Status& status() const { return status_; }

  const ConfigNode& at(const ConfigNode& map, std::string_view key);
  std::string text(const ConfigNode& map, std::string_view key);
  double positive(const ConfigNode& map, std::string_view key);
  /// A list, or a list of rows, or a matrix with rows, cols and data: row by row. All are finite.
  std::vector<double> numbers(const ConfigNode& map, std::string_view key, std::size_t count);
  /// The same, as many as there are.
  std::vector<double> numbers(const ConfigNode& map, std::string_view key);
  /// A homogeneous 4 x 4 matrix.
  Pose3 pose(const ConfigNode& map, std::string_view key);

  template <class... Args>
  void complain(const ConfigNode& node, ErrorCode code, fmt::format_string<Args...> format, Args&&... args) {
    if (status_) status_ = fail(code, "{}:{}: {}", name_, node.line, fmt::format(format, std::forward<Args>(args)...));
  }

 private:
  std::string name_;
  Status status_;
};

/// A camera as other programs state it.
struct ForeignCamera {
  std::string model, distortion_model;
  std::vector<double> size_px;       ///< Width, height.
  std::vector<double> intrinsics;    ///< fx, fy, cx, cy
  std::vector<double> coefficients;  ///< Four; of radial-tangential also OpenCV's five or eight.
};

/// EuRoC and maplab call the same things by these names: pinhole with radial-tangential or equidistant. Impossible
/// values are complained of, at `where`.
CameraModel to_camera_model(YamlValues& yaml, const ConfigNode& where, const ForeignCamera& camera);

/// Five or eight numbers of a pinhole are OpenCV's, and those of a rational camera.
bool is_rational(CameraKind kind, std::size_t coefficients);

/// Row by row; error when it is no rigid transform within 1e-3.
Result<Pose3> pose_from_matrix(const std::vector<double>& row_major_4x4);

}  // namespace tutti::formats::internal
