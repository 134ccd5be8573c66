// SPDX-License-Identifier: BSD-3-Clause
// How far an estimated trajectory is from a reference: compare_trajectories ESTIMATE REFERENCE (TUM, EuRoC csv or
// KITTI).
#include <cstdio>

#include "tutti/evaluation/association.hpp"
#include "tutti/evaluation/ate.hpp"
#include "tutti/formats/trajectory_file.hpp"

int main(int argc, char** argv) {
  if (argc != 3) return std::fprintf(stderr, "usage: compare_trajectories ESTIMATE REFERENCE\n"), 2;
  const auto estimate = tutti::formats::read_trajectory(argv[1]);
  const auto reference = tutti::formats::read_trajectory(argv[2]);
  if (!estimate || !reference)
    return std::fprintf(stderr, "%s\n", (estimate ? reference : estimate).error().message.c_str()), 1;
  const auto ate = tutti::evaluation::ate(tutti::evaluation::associate(*estimate, *reference));
  if (!ate) return std::fprintf(stderr, "no pose of the one is at a time of the other\n"), 1;
  std::printf("%zu poses, RMSE %.3f m, %.2f degrees\n", ate->pairs, ate->rmse_m, ate->rmse_deg);
  return 0;
}
