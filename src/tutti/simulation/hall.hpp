// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/random.hpp"
#include "tutti/simulation/triangle_mesh.hpp"

namespace tutti::simulation {

/// A hall with boxes along its walls and in its middle, and a free passage between them (flight.hpp).
struct HallConfig {
  double length_m = 20.0;
  double width_m = 14.0;
  double height_m = 5.0;
  int boxes = 40;
  double plain_share = 0.15;  ///< Share of the boxes' faces that have no texture.
};

/// One flat rectangle, which is triangles 2 i and 2 i + 1 of the mesh.
struct Face {
  Eigen::Vector3f corner, along, across;  ///< World frame; along and across are unit vectors within the face.
  std::uint32_t texture = 0;              ///< Which texture is on it; 0: none.
  float light = 1.0F;                     ///< Brightness, as a factor.
};

/// A hall as a mesh, with the textured rectangles that it consists of.
struct Hall {
  TriangleMesh mesh;
  std::vector<Face> faces;
};

/// Makes a hall; boxes and textures are drawn at random.
Hall make_hall(const HallConfig& config, Rng rng);

/// Brightness of a point on the face, in [0, 1]. The texture is patches of random grey in four sizes (0.9 m to 3 cm),
/// which look the same from everywhere. `footprint_m` is the length of the face that a pixel covers: edges are blurred
/// over it and smaller patches left out, so that images have no aliasing.
float brightness(const Face& face, const Eigen::Vector3f& point, float footprint_m);

}  // namespace tutti::simulation
