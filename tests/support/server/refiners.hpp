// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>

#include "support/server/world.hpp"
#include "tutti/geometry/covariance.hpp"
#include "tutti/server/map_refiner.hpp"

/// Who refines maps in tests: submaps with a cloud.
namespace tutti::server::test {

/// Knows the truth of world.hpp to a millimetre. Fixed submaps stay where they are.
class Oracle final : public MapRefiner {
 public:
  [[nodiscard]] bool can_refine(const PayloadSize& size) const override { return size.points > 0; }
  [[nodiscard]] Result<Refinement> refine(const RefinementJob& job, const SubmapSet& submaps,
                                          const PayloadStore& payloads) const override {
    Refinement out = answer_to(job);
    const auto fixed = std::ranges::find_if(job.parts, [](const auto& part) { return !part.is_free; });
    const RefinementJob::Part& first = fixed == job.parts.end() ? job.parts.front() : *fixed;
    const Pose3 T_world_truth =
        first.T_world_body.front() *
        true_pose(first.submap.chain.robot, submaps.at(first.submap)->keyframes.front().index).inverse();
    for (const auto& [id, is_free, T_world_body] : job.parts) {
      if (const auto cloud = payloads.cloud(id); !cloud || *cloud == nullptr)
        return fail(ErrorCode::io, "no cloud of submap {}", to_string(id));
      const Submap& submap = *submaps.at(id);
      for (std::size_t k = 0; k < submap.keyframes.size(); ++k) {
        const std::uint32_t index = submap.keyframes[k].index;
        const Pose3 truth = true_pose(id.chain.robot, index);
        out.T_world_body[{id.chain, index}] = is_free ? T_world_truth * truth : T_world_body[k];
        if (!is_free || k + 1 == submap.keyframes.size()) continue;
        const Pose3 step = truth.inverse() * true_pose(id.chain.robot, index + 1);
        out.steps.push_back({{id.chain, index}, {step, diagonal_covariance(1e-3, 1e-4)}});
      }
    }
    return out;
  }
};

/// Finds that the map is one per cent smaller than it was thought to be.
class Shrinker final : public MapRefiner {
 public:
  [[nodiscard]] bool can_refine(const PayloadSize& size) const override { return size.points > 0; }
  [[nodiscard]] Result<Refinement> refine(const RefinementJob& job, const SubmapSet& submaps,
                                          const PayloadStore&) const override {
    Refinement out = answer_to(job);
    for (const auto& [id, is_free, T_world_body] : job.parts) {
      const Submap& submap = *submaps.at(id);
      const auto small = [&](std::size_t k) {
        return Pose3{T_world_body[k].rotation, 0.99 * T_world_body[k].translation};
      };
      for (std::size_t k = 0; k < submap.keyframes.size(); ++k) {
        const KeyframeId here{id.chain, submap.keyframes[k].index};
        out.T_world_body[here] = small(k);
        if (k + 1 < submap.keyframes.size())
          out.steps.push_back({here, {small(k).inverse() * small(k + 1), diagonal_covariance(1e-3, 1e-4)}});
      }
    }
    return out;
  }
};

}  // namespace tutti::server::test
