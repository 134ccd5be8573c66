// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/marks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "tutti/base/file.hpp"
#include "tutti/base/utc_text.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/node/marks.hpp"
#include "tutti/server/georeference.hpp"
#include "tutti/server/map_posterior.hpp"

namespace tutti::mapfile {
namespace {

/// The pose that a mark hangs on, and where it is from there.
struct Attached {
  std::uint64_t number;
  std::size_t node;
  Eigen::Vector3d lever;  ///< In that node's frame.
};

std::vector<Attached> attached(const MarkSet& marks, const Content& content, const server::MapEstimate& map) {
  std::vector<Attached> out;
  for (const auto& [number, mark] : marks) {
    const auto submap = content.submaps.find(mark.submap);
    if (submap == content.submaps.end()) continue;
    const std::vector<Keyframe>& keyframes = submap->second->keyframes;
    const Keyframe& middle = keyframes[keyframes.size() / 2];
    const MapNode* const node = find_node(map, {mark.submap.chain, middle.index});
    if (node == nullptr) continue;
    out.push_back({number, static_cast<std::size_t>(node - map.nodes.data()),
                   middle.T_odom_body.inverse() * (keyframes.front().T_odom_body * mark.at)});
  }
  return out;
}

/// The nodes that positions in a component are as sure as seen from.
std::map<std::uint32_t, std::size_t> references(const server::MapEstimate& map) {
  std::map<std::uint32_t, std::size_t> out;
  for (std::size_t i = 0; i < map.nodes.size(); ++i) out.try_emplace(map.nodes[i].component, i);
  if (map.fixes.georeference && !map.fixes.edges.empty()) out[map.fixes.georeference->component] = map.nodes.size();
  return out;
}

std::string quoted(std::string text) {
  if (!text.empty() && std::string_view("=+-@\t\r").find(text.front()) != std::string_view::npos)
    text.insert(0, 1, '\'');  // no formula of a spreadsheet
  std::string out = "\"";
  for (const char letter : text) out += letter == '"' ? std::string("\"\"") : std::string(1, letter);
  return out + '"';
}

std::string row(const PlacedMark& placed, const MapMark& mark, const std::string& submap, const std::string& photo) {
  const auto number = [](double value) { return std::isfinite(value) ? fmt::format("{:.6g}", value) : std::string(); };
  std::string out = fmt::format("{},{},{:.4f},{:.4f},{:.4f}", placed.number, placed.component, placed.at.x(),
                                placed.at.y(), placed.at.z());
  for (const auto& [r, c] : {std::pair{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}})
    out += ',' + (placed.covariance ? number((*placed.covariance)(r, c)) : std::string());
  if (placed.on_earth)
    out += fmt::format(",{:.9f},{:.9f},{:.4f}", placed.on_earth->latitude_deg, placed.on_earth->longitude_deg,
                       placed.on_earth->height_m);
  else
    out += ",,,";
  return out + fmt::format(",{},{},{},{},{}\n", quoted(submap), quoted(mark.by), utc_text(mark.given_ns),
                           quoted(mark.text), quoted(photo));
}

constexpr const char* kHeading =
    "number,component,x_m,y_m,z_m,cov_xx_m2,cov_xy_m2,cov_xz_m2,cov_yy_m2,cov_yz_m2,cov_zz_m2,latitude_deg,"
    "longitude_deg,height_m,submap,by,when,text,photo\n";

}  // namespace

std::vector<PlacedMark> place_marks(const MarkSet& marks, const Content& content, const server::MapEstimate& map) {
  const std::vector<Attached> all = attached(marks, content, map);
  if (all.empty()) return {};
  const auto reference = references(map);
  std::vector<estimation::JointPosterior::Pair> pairs;
  for (const Attached& one : all) pairs.emplace_back(reference.at(map.nodes[one.node].component), one.node);
  const PoseGraph graph = server::graph_on_earth(map);
  const auto covariances = server::posterior_of(map, graph, pairs)->relative_covariances();
  std::vector<PlacedMark> out;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const MapNode& node = map.nodes[all[i].node];
    PlacedMark& placed = out.emplace_back(
        PlacedMark{.number = all[i].number, .component = node.component, .at = node.T_world_body * all[i].lever});
    // The error of a pose is a small motion in its own frame: of the mark, d = t + r x lever.
    Eigen::Matrix<double, 3, 6> J;
    J << Eigen::Matrix3d::Identity(), -skew(all[i].lever);
    const Eigen::Matrix3d R = node.T_world_body.rotation.toRotationMatrix();
    if (covariances[i].allFinite()) placed.covariance = R * J * covariances[i] * J.transpose() * R.transpose();
    if (const auto& earth = map.fixes.georeference; earth && earth->component == node.component)
      placed.on_earth = geodetic_of(enu_in_ecef(earth->origin) * (earth->T_enu_world * placed.at));
  }
  return out;
}

Result<ExportedMarks> export_marks(const storage::TableStore& store, const Content& content,
                                   const server::MapEstimate& map, const std::filesystem::path& file) {
  const auto marks = node::read_marks(store);
  if (!marks) return tl::unexpected(marks.error());
  const server::ClosureNames names = content.closure_names();
  ExportedMarks out;
  std::string text = kHeading;
  for (const PlacedMark& placed : place_marks(*marks, content, map)) {
    const MapMark& mark = marks->at(placed.number);
    std::string photo;
    const auto bytes = node::read_photo(store, placed.number);
    if (!bytes) return tl::unexpected(bytes.error());
    if (*bytes) {
      photo =
          fmt::format("{}_{}{}", file.stem().string(), placed.number, mark.photo_type == "image/png" ? ".png" : ".jpg");
      if (auto ok = write_file((file.parent_path() / photo).string(), **bytes); !ok) return tl::unexpected(ok.error());
      ++out.photos;
    }
    text += row(placed, mark, names.of(mark.submap), photo);
    ++out.marks;
  }
  out.left_out = marks->size() - out.marks;
  if (auto ok = write_file(file.string(), text); !ok) return tl::unexpected(ok.error());
  return out;
}

}  // namespace tutti::mapfile
