// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "tutti/base/result.hpp"
#include "tutti/model/point_cloud.hpp"

namespace tutti::formats {

struct Rgb {
  std::uint8_t red = 0;
  std::uint8_t green = 0;
  std::uint8_t blue = 0;
};

using Triangle = std::array<std::uint32_t, 3>;  ///< Indices of the corners among the points.

/// A PLY 1.0 file, binary little endian: vertices x y z (float) and, with colours, red green blue (uchar); with
/// triangles an element `face` with the list vertex_indices (uchar, int). `colours` is empty or has one entry per
/// point; `comments` are lines of the header, without line ends.
std::string to_ply(std::span<const Eigen::Vector3f> points, std::span<const Rgb> colours = {},
                   std::span<const Triangle> triangles = {}, std::span<const std::string> comments = {});
Status write_ply(const std::string& path, std::span<const Eigen::Vector3f> points, std::span<const Rgb> colours = {},
                 std::span<const Triangle> triangles = {}, std::span<const std::string> comments = {});

/// The vertices of an ascii or binary little-endian PLY file. x, y, z are float or double at any position; other scalar
/// properties and elements after `vertex` (faces) are skipped, and points with a non-finite coordinate dropped. List
/// properties in or before the vertices and big-endian files are ErrorCode::unsupported, damage is ErrorCode::parse.
Result<PointCloud> parse_ply(std::string_view bytes, const std::string& name);
Result<PointCloud> read_ply(const std::string& path);

/// A cloud whose points are given from `origin` on, so that those of a survey in UTM keep their digits as floats.
struct PlacedCloud {
  PointCloud cloud;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< Whole metres, beyond 1 km; or zero.
};
/// As parse_ply(), subtracting the origin before coordinates are rounded to float.
Result<PlacedCloud> parse_placed_ply(std::string_view bytes, const std::string& name);

}  // namespace tutti::formats
