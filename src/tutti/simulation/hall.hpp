// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/random.hpp"
#include "tutti/simulation/triangle_mesh.hpp"

namespace tutti::simulation {

/// A hall with boxes along its walls and in its middle, and a way round between them (simulation/flight.hpp).
struct HallConfig {
  double length_m = 20.0;
  double width_m = 14.0;
  double height_m = 5.0;
  int boxes = 40;
  double plain_share = 0.15;  ///< Share of the faces of boxes that have no texture.
  template <class V>
  void describe(V& v) {
    v.field("length_m", length_m, between(12.0, 1000.0), "x, about the origin.");
    v.field("width_m", width_m, between(12.0, 1000.0), "y, about the origin.");
    v.field("height_m", height_m, between(3.0, 100.0), "From the floor, z = 0.");
    v.field("boxes", boxes, between(0, 10000), "A quarter of them in the middle.");
  }
};

/// One flat rectangle: triangles 2 i and 2 i + 1 of the mesh.
struct Face {
  Eigen::Vector3f corner, along, across;  ///< World frame; along and across are unit vectors in it.
  std::uint32_t texture = 0;              ///< What is on it; 0: nothing.
  float light = 1.0F;                     ///< How much of it there is.
};

struct Hall {
  TriangleMesh mesh;
  std::vector<Face> faces;
};

Hall make_hall(const HallConfig& config, Rng rng);

/// How bright a point of the face is, in [0, 1]: patches of random grey of four sizes (0.9 m to 3 cm), each the same
/// wherever it is seen from. `footprint_m` is how much of the face a pixel covers: edges are as wide, and smaller
/// patches are left out, so that images are free of aliasing.
float brightness(const Face& face, const Eigen::Vector3f& point, float footprint_m);

}  // namespace tutti::simulation
