// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/export.hpp"

#include <fmt/format.h>

#include <map>
#include <utility>

#include "tutti/base/file.hpp"
#include "tutti/base/folder.hpp"
#include "tutti/formats/g2o.hpp"
#include "tutti/formats/graph_stamps.hpp"
#include "tutti/formats/trajectory_file.hpp"
#include "tutti/mapfile/placement.hpp"
#include "tutti/node/submap_frames.hpp"
#include "tutti/perception/lidar/voxel_filter.hpp"
#include "tutti/server/map_components.hpp"

namespace tutti::mapfile {
namespace {

constexpr double kVoxel_m = 0.1;
constexpr std::size_t kThinAt = 1'000'000;  // points, so that a long map's cloud stays small in memory

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
  if (auto made = make_folder(folder); !made) return tl::unexpected(made.error());
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

Result<JointCloud> joint_cloud(const storage::TableStore& store, const Content& content,
                               const server::MapEstimate& map) {
  JointCloud out{.component = component_to_show(content, map)};
  const auto clouds = node::SubmapFrames::of(store);
  std::size_t thin_at = kThinAt;
  for (const auto& [id, size] : content.payload_sizes) {
    if (size.points == 0) continue;
    const auto at = place(*content.submaps.at(id), map);
    if (!at || at->component != out.component) {
      ++out.left_out;
      continue;
    }
    const auto cloud = clouds->cloud(id);
    if (!cloud) return tl::unexpected(cloud.error());
    ++out.submaps;
    const Eigen::Isometry3d T(at->T_world_submap.matrix());
    std::vector<Eigen::Vector3f>& points = out.cloud.points;
    for (const Eigen::Vector3f& p : (*cloud)->points) points.push_back((T * p.cast<double>()).cast<float>());
    if (points.size() < thin_at) continue;
    out.cloud = lidar::voxel_downsample(out.cloud, kVoxel_m);
    thin_at = 2 * out.cloud.points.size() + kThinAt;
  }
  out.cloud = lidar::voxel_downsample(out.cloud, kVoxel_m);
  return out;
}

std::vector<std::string> world_comments(const Pose3& T_level_world) {
  return {"frame: the map's world", in_words(T_level_world) + " takes it to the frame of the map's grids"};
}

Result<ExportedCloud> export_cloud(const storage::TableStore& store, const Content& content,
                                   const server::MapEstimate& map, const std::filesystem::path& file,
                                   formats::CloudFormat format) {
  const auto joint = joint_cloud(store, content, map);
  if (!joint) return tl::unexpected(joint.error());
  const std::vector<Eigen::Vector3f>& points = joint->cloud.points;
  const ExportedCloud out{points.size(), joint->submaps, joint->left_out,
                          joint->component == server::choose_components(map).largest};
  if (points.empty()) return out;
  const auto frame = world_comments(level_frame(map, joint->component));
  if (auto status = formats::write_cloud(file.string(), format, points, frame); !status)
    return tl::unexpected(status.error());
  return out;
}

}  // namespace tutti::mapfile
