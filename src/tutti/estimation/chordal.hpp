// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "tutti/estimation/termination.hpp"
#include "tutti/model/pose_graph.hpp"

namespace tutti::estimation {

struct InitialisationSummary {
  Termination termination = Termination::not_run;  ///< converged, singular or invalid_input.
  int components = 0;
};

struct Initialisation {
  std::vector<Pose3> poses;
  InitialisationSummary summary;
};

/// Poses from the measurements alone (Martinec & Pajdla 2007; Carlone et al., "Initialization techniques for 3D SLAM",
/// ICRA 2015, section III-B): rotations minimise sum kappa ||R_j - R_i R_ij||_F^2 without the constraint R in SO(3) and
/// are then projected; given them, translations minimise their part of the pose graph's cost exactly (full 3x3
/// information). kappa is the mean rotational information of the edge.
/// The first node of each connected component keeps its given pose; no other given pose is read.
/// On failure the given poses come back unchanged.
Initialisation initialise_chordal(const PoseGraph& graph);

/// The poses of `initialise_chordal` alone.
std::vector<Pose3> chordal_initialisation(const PoseGraph& graph);

}  // namespace tutti::estimation
