// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/exports/map_scene.hpp"

#include <algorithm>
#include <map>

#include "tutti/geometry/so3.hpp"
#include "tutti/mapfile/closures.hpp"
#include "tutti/mapfile/export.hpp"
#include "tutti/server/map_components.hpp"

namespace tutti::exports {
namespace {

class Worlds {
 public:
  explicit Worlds(const server::MapEstimate& map) : largest_(server::choose_components(map).largest) {}
  [[nodiscard]] std::string of(std::uint32_t component) const {
    if (component == largest_) return "world";
    return fmt::format("world_{}", component + (component < largest_ ? 2 : 1));
  }

 private:
  std::uint32_t largest_;
};

void add_trajectories(const server::MapEstimate& map, const server::ClosureNames& names, const Worlds& worlds,
                      Scene& out) {
  // A chain whose submaps are missing in between may lie in several components.
  std::map<std::pair<ChainId, std::uint32_t>, std::vector<std::size_t>> segments;
  for (std::size_t i = 0; i < map.nodes.size(); ++i)
    segments[{map.nodes[i].id.chain, map.nodes[i].component}].push_back(i);
  std::map<ChainId, int> count;
  for (const auto& [key, nodes] : segments) {
    const auto& [chain, component] = key;
    const int number = ++count[chain];
    const std::string name = ros_name(names.of(chain)) + (number > 1 ? fmt::format("_piece_{}", number) : "");
    const std::string world = worlds.of(component), odom = name + "/odom";
    Scene::Track server{name + "/server", world, {}}, odometry{name + "/odometry", odom, {}};
    Scene::Motion corrected{world, odom, {}};
    for (const std::size_t i : nodes) {
      const auto& node = map.nodes[i];
      if (!server.poses.empty() && node.stamp <= server.poses.back().stamp) continue;
      server.poses.push_back({node.stamp, node.T_world_body});
      odometry.poses.push_back({node.stamp, node.T_odom_body});
      corrected.poses.push_back({node.stamp, node.T_world_body * node.T_odom_body.inverse()});
    }
    out.motions.push_back({odom, name + "/base_link", odometry.poses});
    out.motions.push_back(std::move(corrected));
    out.tracks.push_back(std::move(server));
    out.tracks.push_back(std::move(odometry));
  }
}

/// Those whose two ends the map joins can be drawn; the others have no place.
void add_closures(const mapfile::Content& content, const server::MapEstimate& map, const Worlds& worlds, Scene& out) {
  for (const mapfile::ClosureInfo& info : mapfile::closures(content, map))
    for (const mapfile::ClosureFit& fit : info.closures) {
      const auto* from = find_node(map, fit.closure.from);
      const auto* to = find_node(map, fit.closure.to);
      if (!fit.misfit || from == nullptr || to == nullptr) continue;
      Scene::Closure closure{.name = info.name, .state = to_string(fit.state), .reason = fit.reason};
      if (closure.reason.empty() && fit.state != mapfile::ClosureState::accepted) closure.reason = info.reason;
      closure.between_robots = fit.closure.from.chain.robot != fit.closure.to.chain.robot;
      closure.frame = worlds.of(from->component);
      closure.stamp = std::max(from->stamp, to->stamp);
      closure.from = from->T_world_body.translation;
      closure.to = to->T_world_body.translation;
      closure.numbers = {{"off_m", fit.misfit->position_m},
                         {"off_deg", 1.0 / kRadPerDeg * fit.misfit->rotation_rad},
                         {"squared_error", fit.misfit->chi2}};
      out.closures.push_back(std::move(closure));
    }
}

}  // namespace

Result<Scene> scene_of_map(const storage::TableStore& store, const mapfile::Content& content,
                           const server::MapEstimate& map) {
  Scene out;
  const Worlds worlds(map);
  const server::ClosureNames names = content.closure_names();
  add_trajectories(map, names, worlds, out);
  add_closures(content, map, worlds, out);
  auto joint = mapfile::joint_cloud(store, content, map);
  if (!joint) return tl::unexpected(joint.error());
  if (!joint->cloud.points.empty()) out.clouds.push_back({"map", worlds.of(joint->component), std::move(joint->cloud)});
  for (const auto& failed : map.failed_odometry)
    if (const auto* node = find_node(map, {failed.chain, failed.to}))
      out.alerts.push_back({node->stamp,
                            true,
                            names.of(failed.chain),
                            "odometry failed",
                            {{"off_m", fmt::format("{:.3f}", failed.jump_m)},
                             {"off_deg", fmt::format("{:.2f}", 1.0 / kRadPerDeg * failed.jump_rad)}}});
  if (const auto& earth = map.fixes.georeference)
    out.earth = {earth->origin, worlds.of(earth->component), earth->T_enu_world};
  return out;
}

}  // namespace tutti::exports
