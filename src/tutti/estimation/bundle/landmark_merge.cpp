// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/bundle/landmark_merge.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <tuple>

#include "tutti/base/disjoint_sets.hpp"
#include "tutti/estimation/bundle/internal/assembly.hpp"
#include "tutti/estimation/bundle/internal/problem_structure.hpp"
#include "tutti/estimation/bundle/internal/thinning.hpp"
#include "tutti/estimation/bundle/internal/triangulation.hpp"
#include "tutti/estimation/bundle/projection_factor.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::bundle {
namespace {

using internal::Assembly;
using Views = std::vector<BundleObservation>;

/// Joins landmarks that one pixel of one image shows: neighbouring submaps carry the shared keyframe both.
void join_neighbours(const Assembly& assembly, DisjointSets& sets, MergeSummary& summary) {
  using Key = std::tuple<std::size_t, std::size_t, double, double>;
  std::map<Key, std::size_t> seen;
  for (const auto& view : assembly.problem.observations) {
    const auto [it, is_new] =
        seen.try_emplace({view.keyframe, view.camera, view.pixel.x(), view.pixel.y()}, view.landmark);
    if (!is_new && sets.join(it->second, view.landmark)) ++summary.neighbour_joins;
  }
}

/// Matches with submaps that are not here are ignored.
Status join_matches(const Assembly& assembly, std::span<const LandmarkMatch> matches, DisjointSets& sets,
                    MergeSummary& summary) {
  std::map<SubmapId, std::size_t> number;
  for (std::size_t s = 0; s < assembly.submaps.size(); ++s) number[assembly.submaps[s]->submap->id] = s;
  for (const auto& match : matches) {
    std::array<std::size_t, 2> landmark{};
    bool here = true;
    for (const auto& [id, out] : {std::tie(match.one, landmark[0]), std::tie(match.other, landmark[1])}) {
      const auto it = number.find(id.submap);
      here = here && it != number.end();
      if (!here) break;
      out = assembly.first_landmark[it->second] + id.index;
      if (out >= assembly.first_landmark[it->second + 1])
        return fail(ErrorCode::invalid, "a match with landmark {} of submap {}, which has no such one", id.index,
                    to_string(id.submap));
    }
    if (here && sets.join(landmark[0], landmark[1])) ++summary.closure_joins;
  }
  return {};
}

/// Landmarks that are matched as one, with all their views.
struct Group {
  std::vector<std::size_t> members;  ///< Numbers in the assembly.
  Views views;                       ///< BundleObservation::landmark: which member.
};

std::vector<Group> groups_of(const Assembly& assembly, DisjointSets& sets) {
  const auto [label, count] = sets.labels();
  std::vector<Group> out(static_cast<std::size_t>(count));
  for (std::size_t l = 0; l < label.size(); ++l) out[static_cast<std::size_t>(label[l])].members.push_back(l);
  for (const auto& view : assembly.problem.observations)
    out[static_cast<std::size_t>(label[view.landmark])].views.push_back(view);
  return out;
}

/// Puts groups into the merged problem, one by one.
class Merger {
 public:
  Merger(const Assembly& assembly, const MergeConfig& config, MergeSummary& summary)
      : assembly_(assembly), config_(config), summary_(summary) {
    out_.keyframes = assembly.problem.keyframes;
    out_.cameras = assembly.problem.cameras;
    out_.odometry = assembly.problem.odometry;
    out_.imu = assembly.problem.imu;
  }

  void add(const Group& group) {
    if (std::ranges::all_of(group.views, [&](const auto& view) { return out_.keyframes[view.keyframe].is_constant; }))
      return;
    const auto point = triangulate(group);
    if (!point) {
      ++summary_.landmarks_uncertain;
      return;
    }
    if (group.members.size() > 1) {
      if (are_apart(group.members)) ++summary_.two_positions;
      if (take_apart(group, *point)) return;
    }
    add_views(group, *point);
  }

  BundleProblem take() { return std::move(out_); }

 private:
  [[nodiscard]] std::optional<Eigen::Vector3d> triangulate(const Group& group) const {
    if (group.views.size() < 2) return std::nullopt;
    std::vector<Eigen::Vector3d> starts;
    for (const std::size_t l : group.members) starts.push_back(assembly_.problem.landmarks[l]);
    return internal::triangulate(out_, group.views, starts, config_.max_reprojection_px);
  }

  [[nodiscard]] double sigma_m(std::size_t landmark) const {
    const auto& first = assembly_.first_landmark;
    const auto s = static_cast<std::size_t>(std::upper_bound(first.begin(), first.end(), landmark) - first.begin() - 1);
    return assembly_.submaps[s]->submap->visual->landmarks[landmark - first[s]].sigma_m;
  }

  /// Do two of them lie further from each other than both claim to be off?
  [[nodiscard]] bool are_apart(const std::vector<std::size_t>& members) const {
    for (const std::size_t a : members)
      for (const std::size_t b : members)
        if (a < b && (assembly_.problem.landmarks[a] - assembly_.problem.landmarks[b]).norm() >
                         3.0 * std::hypot(sigma_m(a), sigma_m(b)))
          return true;
    return false;
  }

  /// A group with members most of whose views contradict the common point becomes two, these apart from the others.
  bool take_apart(const Group& group, const Eigen::Vector3d& point) {
    std::map<std::size_t, int> votes;
    for (const auto& view : group.views)
      votes[view.landmark] += internal::error_px(out_, view, point) <= config_.max_reprojection_px ? 1 : -1;
    Group agrees, contradicts;
    const auto side = [&](std::size_t l) -> Group& {
      const auto it = votes.find(l);
      return it != votes.end() && it->second < 0 ? contradicts : agrees;
    };
    for (const std::size_t l : group.members) side(l).members.push_back(l);
    for (const auto& view : group.views) side(view.landmark).views.push_back(view);
    if (contradicts.members.empty() || agrees.members.empty()) return false;
    summary_.two_things += contradicts.members.size();
    add(agrees);
    add(contradicts);
    return true;
  }

  void add_views(const Group& group, const Eigen::Vector3d& point) {
    Views kept;
    std::map<std::pair<std::size_t, std::size_t>, std::size_t> by_image;
    for (const auto& view : group.views) {
      const double error = internal::error_px(out_, view, point);
      if (error > config_.max_reprojection_px) {
        ++summary_.views_contradicting;
        continue;
      }
      const auto [it, is_new] = by_image.try_emplace({view.keyframe, view.camera}, kept.size());
      if (is_new) {
        kept.push_back(view);
        continue;
      }
      auto& other = kept[it->second];
      ++(other.pixel == view.pixel ? summary_.views_doubled : summary_.views_contradicting);
      if (error < internal::error_px(out_, other, point)) other = view;
    }
    if (kept.size() < 2 || internal::parallax(out_, kept, point) < config_.min_parallax_deg * kRadPerDeg) {
      ++summary_.landmarks_uncertain;
      return;
    }
    for (auto& view : kept) view.landmark = out_.landmarks.size();
    out_.landmarks.push_back(point);
    out_.observations.insert(out_.observations.end(), kept.begin(), kept.end());
  }

  const Assembly& assembly_;
  const MergeConfig& config_;
  MergeSummary& summary_;
  BundleProblem out_;
};

}  // namespace

Result<MergedMap> merge_landmarks(std::span<const PosedSubmap> submaps, std::span<const LandmarkMatch> matches,
                                  const MergeConfig& config) {
  const auto assembly = internal::assemble(submaps, config);
  if (!assembly) return tl::unexpected(assembly.error());
  if (const auto status = internal::check_problem(assembly->problem); !status) return tl::unexpected(status.error());
  MergedMap out{.odometry = assembly->odometry, .residuals = camera_residuals(assembly->apart)};
  out.summary.landmarks_in = assembly->problem.landmarks.size();
  out.summary.views_in = assembly->problem.observations.size();
  DisjointSets sets(assembly->problem.landmarks.size());
  join_neighbours(*assembly, sets, out.summary);
  if (const auto status = join_matches(*assembly, matches, sets, out.summary); !status)
    return tl::unexpected(status.error());

  Merger merger(*assembly, config, out.summary);
  for (const auto& group : groups_of(*assembly, sets)) merger.add(group);
  out.problem = merger.take();
  if (config.landmarks_per_keyframe > 0)
    out.summary.landmarks_thinned =
        internal::thin_landmarks(out.problem, static_cast<std::size_t>(config.landmarks_per_keyframe));
  if (config.redundant_views > 0)
    out.summary.redundant_keyframes =
        internal::thin_keyframes(out.problem, static_cast<std::size_t>(config.redundant_views));
  out.summary.landmarks_out = out.problem.landmarks.size();
  out.summary.views_out = out.problem.observations.size();
  return out;
}

}  // namespace tutti::bundle
