// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "tutti/base/result.hpp"

namespace tutti {

/// The formula that maps a direction to a pixel. The numbers are on the wire: they never change.
enum class CameraKind : std::uint8_t {
  pinhole = 0,        ///< Radial-tangential distortion k1 k2 p1 p2 (Brown 1966; what OpenCV and EuRoC call radtan).
  equidistant = 1,    ///< Fisheye, k1 k2 k3 k4 (Kannala and Brandt 2006).
  double_sphere = 2,  ///< xi alpha (Usenko et al. 2018).
  rational = 3,       ///< Pinhole with OpenCV's k1 k2 p1 p2 k3 k4 k5 k6; with its five coefficients k4 k5 k6 are zero.
};

/// Intrinsics of one camera. Camera frame: z forward, x right, y down. Pixel (0, 0) is the centre of the top left
/// pixel.
struct CameraModel {
  CameraKind kind = CameraKind::pinhole;
  int width_px = 0;
  int height_px = 0;
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;  ///< px
  std::array<double, 8> distortion{};  ///< In the order of CameraKind; entries that the kind does not have are zero.
  friend bool operator==(const CameraModel&, const CameraModel&) = default;
};

/// Number of distortion coefficients that files and messages store for a camera of this kind: 8 for rational, 4 for the
/// others.
std::size_t distortion_numbers(CameraKind kind);

/// Accepts a camera whose size and focal lengths are positive and whose numbers are finite and in the range that the
/// formula allows. Errors: unsupported (unknown kind), invalid (all else); they have the value.
Status check_camera(const CameraModel& camera);

/// The pixel that sees a point (camera frame, m), also one outside of the image; no value when no pixel sees the point,
/// because it is behind the camera or where the distortion folds back. `d_pixel_d_point` receives the 2 x 3 Jacobian,
/// px/m, unless it is null.
std::optional<Eigen::Vector2d> project(const CameraModel& camera, const Eigen::Vector3d& point,
                                       Eigen::Matrix<double, 2, 3>* d_pixel_d_point = nullptr);

/// The unit direction, camera frame, that a pixel sees: the inverse of project(). No value for a pixel that sees none.
std::optional<Eigen::Vector3d> unproject(const CameraModel& camera, const Eigen::Vector2d& pixel);

/// Is the pixel in the image, at least `border_px` from its edge? The edge is half a pixel outside the outer centres.
bool in_image(const CameraModel& camera, const Eigen::Vector2d& pixel, double border_px = 0.0);

}  // namespace tutti
