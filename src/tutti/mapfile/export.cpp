// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/export.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "tutti/base/file.hpp"
#include "tutti/formats/g2o.hpp"
#include "tutti/formats/graph_stamps.hpp"
#include "tutti/formats/ply.hpp"
#include "tutti/formats/trajectory_file.hpp"
#include "tutti/node/submap_frames.hpp"
#include "tutti/perception/lidar/voxel_filter.hpp"
#include "tutti/server/map_components.hpp"

namespace tutti::mapfile {
namespace {

constexpr double kVoxel_m = 0.1;
constexpr std::size_t kThinAt = 1'000'000;  // points, so that a long map's cloud stays small in memory

/// Where a submap lies: T_world_submap, in the world of a component. Nothing: the map does not have it.
struct Place {
  std::uint32_t component = 0;
  Pose3 T_world_submap;
};
std::optional<Place> place(const Submap& submap, const server::MapEstimate& map) {
  const Keyframe& first = submap.keyframes.front();
  const Keyframe& middle = submap.keyframes[submap.keyframes.size() / 2];
  const MapNode* node = find_node(map, {submap.id.chain, middle.index});
  if (node == nullptr) return std::nullopt;
  return Place{node->component, node->T_world_body * middle.T_odom_body.inverse() * first.T_odom_body};
}

/// The largest, or, where nobody there has a cloud, the one with most points.
std::uint32_t component_to_show(const Content& content, const server::MapEstimate& map) {
  const std::uint32_t largest = server::choose_components(map).largest;
  std::map<std::uint32_t, std::size_t> points;
  for (const auto& [id, size] : content.payload_sizes)
    if (const auto at = place(*content.submaps.at(id), map); at && size.points > 0)
      points[at->component] += size.points;
  if (points.empty() || points.contains(largest)) return largest;
  return std::ranges::max_element(points, {}, [](const auto& entry) { return entry.second; })->first;
}

}  // namespace

Status export_g2o(const server::MapEstimate& map, const std::filesystem::path& file) {
  std::vector<formats::VertexStamp> stamps;
  for (const MapNode& node : map.nodes)
    stamps.push_back({static_cast<std::int64_t>(stamps.size()), node.id, node.stamp});
  if (auto status = formats::write_g2o(file.string(), map.graph); !status) return status;
  return formats::write_graph_stamps(formats::stamps_beside(file.string()), stamps);
}

Result<std::vector<std::string>> export_tum(const Content& content, const server::MapEstimate& map,
                                            const std::filesystem::path& folder) {
  std::error_code failure;
  std::filesystem::create_directories(folder, failure);
  if (failure) return fail(ErrorCode::io, "{}: cannot make the folder: {}", folder.string(), failure.message());
  std::map<ChainId, Trajectory> trajectories;
  for (const MapNode& node : map.nodes) trajectories[node.id.chain].push_back({node.stamp, node.T_world_body});
  const server::ClosureNames names = content.closure_names();
  std::vector<std::string> files;
  for (const auto& [chain, trajectory] : trajectories) {
    files.push_back(names.of(chain) + ".tum");
    if (auto status = formats::write_tum((folder / files.back()).string(), trajectory); !status)
      return tl::unexpected(status.error());
  }
  return files;
}

Result<ExportedCloud> export_ply(const storage::TableStore& store, const Content& content,
                                 const server::MapEstimate& map, const std::filesystem::path& file) {
  const std::uint32_t component = component_to_show(content, map);
  const auto clouds = node::SubmapFrames::of(store);
  ExportedCloud out{.of_the_largest = component == server::choose_components(map).largest};
  PointCloud joint;
  std::size_t thin_at = kThinAt;
  for (const auto& [id, size] : content.payload_sizes) {
    if (size.points == 0) continue;
    const auto at = place(*content.submaps.at(id), map);
    if (!at || at->component != component) {
      ++out.left_out;
      continue;
    }
    const auto cloud = clouds->cloud(id);
    if (!cloud) return tl::unexpected(cloud.error());
    ++out.submaps;
    const Eigen::Isometry3d T(at->T_world_submap.matrix());
    for (const Eigen::Vector3f& p : (*cloud)->points) joint.points.push_back((T * p.cast<double>()).cast<float>());
    if (joint.points.size() < thin_at) continue;
    joint = lidar::voxel_downsample(joint, kVoxel_m);
    thin_at = 2 * joint.points.size() + kThinAt;
  }
  joint = lidar::voxel_downsample(joint, kVoxel_m);
  out.points = joint.points.size();
  if (joint.points.empty()) return out;
  if (auto status = formats::write_ply(file.string(), joint.points); !status) return tl::unexpected(status.error());
  return out;
}

}  // namespace tutti::mapfile
