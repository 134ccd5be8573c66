// SPDX-License-Identifier: BSD-3-Clause
// Optimises a pose graph with wrong closures in it: optimise_graph IN.g2o OUT.g2o
#include <algorithm>
#include <cstdio>

#include "tutti/estimation/gnc.hpp"
#include "tutti/formats/g2o.hpp"

int main(int argc, char** argv) {
  if (argc != 3) return std::fprintf(stderr, "usage: optimise_graph IN.g2o OUT.g2o\n"), 2;
  auto file = tutti::formats::read_g2o(argv[1]);
  if (!file) return std::fprintf(stderr, "%s\n", file.error().message.c_str()), 1;

  using namespace tutti::estimation;
  const auto roles = roles_from_numbering(file->graph);  // edges between neighbours are odometry, and trusted
  const GncResult result = solve_pose_graph_gnc(file->graph, GncConfig{}, roles);
  if (!is_usable(result.solution.summary.termination)) return std::fprintf(stderr, "cannot be solved\n"), 1;
  const auto wrong = std::ranges::count_if(result.inlier_weight, [](double weight) { return weight < 0.5; });
  std::printf("%zu poses, %zu edges, %td of them wrong\n", file->graph.poses.size(), file->graph.edges.size(), wrong);

  file->graph.poses = result.solution.poses;
  const auto written = tutti::formats::write_g2o(argv[2], *file);
  return written ? 0 : (std::fprintf(stderr, "%s\n", written.error().message.c_str()), 1);
}
