// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/bundle/internal/assembly.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <string>

#include "tutti/geometry/so3.hpp"

namespace tutti::bundle::internal {
namespace {

/// Assembles one submap after the other.
class Assembler {
 public:
  explicit Assembler(const MergeConfig& config) : config_(config) { out_.first_landmark.push_back(0); }

  Status add(const PosedSubmap& posed) {
    const Submap& submap = *posed.submap;
    const std::string name = "submap " + to_string(submap.id);
    if (submap.keyframes.empty() || posed.T_world_body.size() != submap.keyframes.size() ||
        submap.odometry.size() + 1 != submap.keyframes.size())
      return fail(ErrorCode::invalid, "{}: {} keyframes, {} poses, {} odometry factors", name, submap.keyframes.size(),
                  posed.T_world_body.size(), submap.odometry.size());
    std::vector<std::size_t> nodes;
    for (std::size_t k = 0; k < submap.keyframes.size(); ++k) nodes.push_back(node(posed, k));
    add_odometry(submap, nodes);
    if (!submap.visual) {
      out_.first_landmark.push_back(out_.first_landmark.back());
      return {};
    }
    if (const auto status = add_views(posed, nodes); !status) return in_context(name, status.error());
    if (config_.use_imu)
      if (const auto status = add_imu(submap, nodes); !status) return in_context(name, status.error());
    return {};
  }

  Assembly take(std::vector<const PosedSubmap*> submaps) {
    out_.submaps = std::move(submaps);
    out_.apart.cameras = out_.problem.cameras;
    return std::move(out_);
  }

 private:
  std::size_t node(const PosedSubmap& posed, std::size_t k) {
    const KeyframeId id{posed.submap->id.chain, posed.submap->keyframes[k].index};
    const auto [it, is_new] = nodes_.try_emplace(id, out_.problem.keyframes.size());
    if (is_new) out_.problem.keyframes.push_back({id, posed.T_world_body[k]});
    if (posed.is_constant) out_.problem.keyframes[it->second] = {id, posed.T_world_body[k], true};
    return it->second;
  }

  void add_odometry(const Submap& submap, const std::vector<std::size_t>& nodes) {
    for (std::size_t k = 0; k + 1 < nodes.size(); ++k) {
      const double dt = std::max(0.0, submap.keyframes[k + 1].stamp - submap.keyframes[k].stamp);
      const double sigma_rad = config_.odometry_sigma_deg * kRadPerDeg;
      RelativePose measurement = submap.odometry[k];
      measurement.covariance.diagonal().head<3>().array() += config_.odometry_sigma_m * config_.odometry_sigma_m * dt;
      measurement.covariance.diagonal().tail<3>().array() += sigma_rad * sigma_rad * dt;
      out_.problem.odometry.push_back({nodes[k], nodes[k + 1], measurement});
      out_.odometry.push_back(submap.odometry[k]);
    }
  }

  std::size_t camera(RobotId robot, std::uint32_t index, const Camera& camera) {
    auto& cameras = out_.problem.cameras;
    const auto same = [&](const BundleCamera& c) { return c.robot == robot && c.index == index && c.camera == camera; };
    const auto it = std::find_if(cameras.begin(), cameras.end(), same);
    const auto at = static_cast<std::size_t>(it - cameras.begin());
    if (it == cameras.end()) cameras.push_back({robot, index, camera});
    return at;
  }

  Status add_views(const PosedSubmap& posed, const std::vector<std::size_t>& nodes) {
    const Submap& submap = *posed.submap;
    const VisualPayload& visual = *submap.visual;
    const std::size_t first = out_.first_landmark.back();
    for (const auto& landmark : visual.landmarks)
      out_.problem.landmarks.push_back(posed.T_world_body.front() * landmark.position.cast<double>());
    out_.first_landmark.push_back(first + visual.landmarks.size());
    const std::size_t first_apart = set_apart(submap);
    for (const auto& frame : visual.frames) {
      const std::uint32_t k = frame.keyframe - submap.keyframes.front().index;  // wraps when it is before them
      if (k >= nodes.size() || frame.camera >= visual.cameras.size())
        return fail(ErrorCode::invalid, "an image of keyframe {} by camera {}, which it does not have", frame.keyframe,
                    frame.camera);
      const std::size_t c = camera(submap.id.chain.robot, frame.camera, visual.cameras[frame.camera]);
      for (const auto& view : frame.observations) {
        if (view.landmark == kNoIndex) continue;
        if (view.landmark >= visual.landmarks.size())
          return fail(ErrorCode::invalid, "a view of landmark {} of {}", view.landmark, visual.landmarks.size());
        out_.problem.observations.push_back(
            {nodes[k], c, first + view.landmark, view.pixel.cast<double>(), double{view.sigma_px}});
        out_.apart.observations.push_back(out_.problem.observations.back());
        out_.apart.observations.back().keyframe = first_apart + k;
      }
    }
    return {};
  }

  /// Number of its first keyframe.
  std::size_t set_apart(const Submap& submap) {
    const std::size_t first = out_.apart.keyframes.size();
    const Pose3 T_submap_odom = submap.keyframes.front().T_odom_body.inverse();
    for (const auto& keyframe : submap.keyframes)
      out_.apart.keyframes.push_back({{submap.id.chain, keyframe.index}, T_submap_odom * keyframe.T_odom_body});
    for (const auto& landmark : submap.visual->landmarks)
      out_.apart.landmarks.push_back(landmark.position.cast<double>());
    return first;
  }

  Status add_imu(const Submap& submap, const std::vector<std::size_t>& nodes) {
    for (const auto& imu : submap.visual->imu) {
      const std::uint32_t k = imu.from_keyframe - submap.keyframes.front().index;
      if (k >= nodes.size())
        return fail(ErrorCode::invalid, "IMU from keyframe {}, which it does not have", imu.from_keyframe);
      if (k + 1 < nodes.size()) out_.problem.imu.push_back({nodes[k], nodes[k + 1], imu});
    }
    return {};
  }

  const MergeConfig& config_;
  std::map<KeyframeId, std::size_t> nodes_;
  Assembly out_;
};

}  // namespace

Result<Assembly> assemble(std::span<const PosedSubmap> submaps, const MergeConfig& config) {
  std::vector<const PosedSubmap*> by_id;
  for (const auto& posed : submaps) by_id.push_back(&posed);
  std::sort(by_id.begin(), by_id.end(),
            [](const PosedSubmap* a, const PosedSubmap* b) { return a->submap->id < b->submap->id; });
  const auto same = [](const PosedSubmap* a, const PosedSubmap* b) { return a->submap->id == b->submap->id; };
  if (const auto twice = std::adjacent_find(by_id.begin(), by_id.end(), same); twice != by_id.end())
    return fail(ErrorCode::invalid, "submap {} is given twice", to_string((*twice)->submap->id));
  Assembler assembler(config);
  for (const auto* posed : by_id)
    if (const auto status = assembler.add(*posed); !status) return tl::unexpected(status.error());
  return assembler.take(std::move(by_id));
}

}  // namespace tutti::bundle::internal
