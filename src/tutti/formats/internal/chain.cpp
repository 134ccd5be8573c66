// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/internal/chain.hpp"

#include <deque>
#include <vector>

namespace tutti::formats::internal {
namespace {

/// An edge as seen from one of its ends.
struct Step {
  std::size_t to = 0;
  std::size_t edge = 0;
  bool forward = true;
};

bool are_consecutive(std::int64_t a, std::int64_t b) {
  const std::uint64_t difference = static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b);  // wraps, defined
  return difference == 1 || difference == std::uint64_t(-1);
}

std::vector<std::vector<Step>> steps_of(const PoseGraph& graph) {
  std::vector<std::vector<Step>> steps(graph.poses.size());
  for (std::size_t e = 0; e < graph.edges.size(); ++e) {
    steps[graph.edges[e].from].push_back({graph.edges[e].to, e, true});
    steps[graph.edges[e].to].push_back({graph.edges[e].from, e, false});
  }
  return steps;
}

}  // namespace

std::size_t chain_poses(PoseGraph& graph, std::span<const std::int64_t> ids) {
  const auto steps = steps_of(graph);
  std::vector<bool> reached(graph.poses.size(), false);
  std::size_t components = 0;
  for (std::size_t root = 0; root < graph.poses.size(); ++root) {
    if (reached[root]) continue;
    const bool first = components++ == 0;
    // Breadth first with weights 0 (odometry, to the front) and 1 (closures, to the back).
    struct Visit {
      std::size_t node = 0;
      Pose3 pose;
    };
    std::deque<Visit> queue{{root, {}}};
    while (!queue.empty()) {
      const Visit here = queue.front();
      queue.pop_front();
      if (reached[here.node]) continue;
      reached[here.node] = true;
      if (first) graph.poses[here.node] = here.pose;
      for (const Step& step : steps[here.node]) {
        if (reached[step.to]) continue;
        const Pose3& T = graph.edges[step.edge].T_from_to;
        const Visit next{step.to, here.pose * (step.forward ? T : T.inverse())};
        if (are_consecutive(ids[here.node], ids[step.to]))
          queue.push_front(next);
        else
          queue.push_back(next);
      }
    }
  }
  return components;
}

}  // namespace tutti::formats::internal
