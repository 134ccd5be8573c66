// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/bundle/internal/thinning.hpp"

#include <algorithm>
#include <numeric>

namespace tutti::bundle::internal {
namespace {

std::vector<std::size_t> views_per_landmark(const BundleProblem& problem) {
  std::vector<std::size_t> out(problem.landmarks.size(), 0);
  for (const auto& view : problem.observations) ++out[view.landmark];
  return out;
}

}  // namespace

std::size_t drop_unseen_landmarks(BundleProblem& problem) {
  const auto views = views_per_landmark(problem);
  std::vector<std::size_t> number(views.size());
  std::size_t kept = 0;
  for (std::size_t l = 0; l < views.size(); ++l) {
    number[l] = kept;
    if (views[l] >= 2) problem.landmarks[kept++] = problem.landmarks[l];
  }
  problem.landmarks.resize(kept);
  std::erase_if(problem.observations, [&](const BundleObservation& view) { return views[view.landmark] < 2; });
  for (auto& view : problem.observations) view.landmark = number[view.landmark];
  return views.size() - kept;
}

std::size_t thin_landmarks(BundleProblem& problem, std::size_t per_keyframe) {
  const auto views = views_per_landmark(problem);
  std::vector<std::vector<std::size_t>> seen_by(views.size());
  for (const auto& view : problem.observations) seen_by[view.landmark].push_back(view.keyframe);
  std::vector<std::size_t> order(views.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return views[a] > views[b]; });
  std::vector<std::size_t> has(problem.keyframes.size(), 0);
  std::vector<bool> kept(views.size(), false);
  for (const std::size_t l : order) {
    kept[l] = std::any_of(seen_by[l].begin(), seen_by[l].end(), [&](std::size_t k) { return has[k] < per_keyframe; });
    if (kept[l])
      for (const std::size_t k : seen_by[l]) ++has[k];
  }
  std::erase_if(problem.observations, [&](const BundleObservation& view) { return !kept[view.landmark]; });
  return drop_unseen_landmarks(problem);
}

std::size_t thin_keyframes(BundleProblem& problem, std::size_t other_views) {
  constexpr double kShare = 0.9;
  auto views = views_per_landmark(problem);
  std::vector<std::vector<std::size_t>> sees(problem.keyframes.size());
  for (const auto& view : problem.observations) sees[view.keyframe].push_back(view.landmark);
  std::vector<bool> gone(sees.size(), false);
  std::size_t count = 0;
  for (std::size_t k = 1; k + 1 < sees.size(); ++k) {
    if (gone[k - 1] || sees[k].empty()) continue;
    const auto spare =
        std::count_if(sees[k].begin(), sees[k].end(), [&](std::size_t l) { return views[l] > other_views; });
    if (static_cast<double>(spare) < kShare * static_cast<double>(sees[k].size())) continue;
    gone[k] = true;
    ++count;
    for (const std::size_t l : sees[k]) --views[l];
  }
  std::erase_if(problem.observations, [&](const BundleObservation& view) { return gone[view.keyframe]; });
  drop_unseen_landmarks(problem);
  return count;
}

}  // namespace tutti::bundle::internal
