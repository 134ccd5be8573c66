// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "tutti/base/result.hpp"

namespace tutti {

/// Which formula takes a direction to a pixel; the numbers go over the wire.
enum class CameraKind : std::uint8_t {
  pinhole = 0,        ///< Radial-tangential distortion k1 k2 p1 p2 (Brown 1966; what OpenCV and EuRoC call radtan).
  equidistant = 1,    ///< Fisheye, k1 k2 k3 k4 (Kannala and Brandt 2006).
  double_sphere = 2,  ///< xi alpha (Usenko et al. 2018).
  rational = 3,       ///< Pinhole with OpenCV's k1 k2 p1 p2 k3 k4 k5 k6; its five numbers leave k4 k5 k6 zero.
};

/// Intrinsics of one camera: z looks forward, x right, y down. Pixels are counted from the centre of the first one.
struct CameraModel {
  CameraKind kind = CameraKind::pinhole;
  int width_px = 0;
  int height_px = 0;
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;  ///< px
  std::array<double, 8> distortion{};             ///< As its kind says; the others are zero.
  friend bool operator==(const CameraModel&, const CameraModel&) = default;
};

/// How many numbers of distortion a camera of this kind has where it is stored: four, but for the rational one, eight.
std::size_t distortion_numbers(CameraKind kind);

/// Size and focal lengths are positive, everything is finite and in the range that its formula allows.
Status check_camera(const CameraModel& camera);

/// The pixel that sees a point of the camera frame, m; nothing when no pixel does (behind the camera, or where the
/// distortion folds back). It may lie outside the image. `d_pixel_d_point`, if asked for, is its 2 x 3 Jacobian.
std::optional<Eigen::Vector2d> project(const CameraModel& camera, const Eigen::Vector3d& point,
                                       Eigen::Matrix<double, 2, 3>* d_pixel_d_point = nullptr);

/// The unit direction that a pixel sees, in the camera frame: the inverse of project(); nothing where there is none.
std::optional<Eigen::Vector3d> unproject(const CameraModel& camera, const Eigen::Vector2d& pixel);

/// Is the pixel in the image, at least `border_px` from its edge? The edge is half a pixel outside the outer centres.
bool in_image(const CameraModel& camera, const Eigen::Vector2d& pixel, double border_px = 0.0);

}  // namespace tutti
