// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/exports/formats.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "tutti/base/folder.hpp"
#include "tutti/exports/map_scene.hpp"
#include "tutti/exports/run_scene.hpp"
#include "tutti/formats/graph_stamps.hpp"
#include "tutti/formats/pcd.hpp"
#include "tutti/formats/ply.hpp"
#include "tutti/mapfile/export.hpp"
#include "tutti/mapfile/marks.hpp"

namespace tutti::exports {

Format::OfMap write_grid, write_voxels;  // grid_formats.cpp

namespace {

namespace fs = std::filesystem;

Result<std::string> write_mcap(const Result<Scene>& scene, const FormatSettings& settings, const fs::path& out) {
  if (!scene) return tl::unexpected(scene.error());
  return write_scene(*scene, out.string(), settings.ros_only).map([&](const WrittenScene& written) {
    return fmt::format("{}: {} messages of {} topics", out.string(), written.messages, written.topics);
  });
}

Result<std::string> mcap_of_map(const MapSource& map, const FormatSettings& settings, const fs::path& out) {
  return write_mcap(scene_of_map(*map.store, map.content, map.estimate), settings, out);
}

Result<std::string> mcap_of_run(const fs::path& folder, const FormatSettings& settings, const fs::path& out) {
  return write_mcap(scene_of_run(folder.string()), settings, out);
}

Status copy_of(const fs::path& from, const fs::path& to) {
  std::error_code failure;
  fs::copy_file(from, to, fs::copy_options::overwrite_existing, failure);
  if (failure)
    return fail(ErrorCode::io, "{}: cannot be copied to {}: {}", from.string(), to.string(), failure.message());
  return {};
}

Result<std::string> g2o_of_map(const MapSource& map, const FormatSettings&, const fs::path& out) {
  const PoseGraph& graph = map.estimate.graph;
  return mapfile::export_g2o(map.estimate, out).map([&] {
    return fmt::format("{}: {} vertices, {} edges", out.string(), graph.poses.size(), graph.edges.size());
  });
}

Result<std::string> g2o_of_run(const fs::path& folder, const FormatSettings&, const fs::path& out) {
  const fs::path graph = folder / "graph.g2o";
  return copy_of(graph, out)
      .and_then([&] { return copy_of(formats::stamps_beside(graph.string()), formats::stamps_beside(out.string())); })
      .map([&] { return out.string() + ": the server's last graph"; });
}

Result<std::string> tum_of_map(const MapSource& map, const FormatSettings&, const fs::path& out) {
  return mapfile::export_tum(map.content, map.estimate, out).map([&](const std::vector<std::string>& files) {
    return fmt::format("{}: {}", out.string(), fmt::join(files, ", "));
  });
}

Result<std::string> tum_of_run(const fs::path& folder, const FormatSettings&, const fs::path& out) {
  if (auto made = make_folder(out); !made) return tl::unexpected(made.error());
  constexpr std::string_view kEnd = "_server.tum";
  std::vector<std::string> files;
  std::error_code failure;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, failure)) {
    std::string name = entry.path().filename().string();
    if (!name.ends_with(kEnd)) continue;
    files.push_back(name.substr(0, name.size() - kEnd.size()) + ".tum");
    if (auto copied = copy_of(entry.path(), out / files.back()); !copied) return tl::unexpected(copied.error());
  }
  if (files.empty())
    return fail(ErrorCode::invalid, "{}: no ROBOT{}, expected what tutti run writes", folder.string(), kEnd);
  std::ranges::sort(files);
  return fmt::format("{}: {}", out.string(), fmt::join(files, ", "));
}

template <formats::CloudFormat format>
Result<std::string> cloud_of_map(const MapSource& map, const FormatSettings&, const fs::path& out) {
  const auto cloud = mapfile::export_cloud(*map.store, map.content, map.estimate, out, format);
  if (!cloud) return tl::unexpected(cloud.error());
  if (cloud->points == 0) return fail(ErrorCode::invalid, "{}: no submap has a cloud", map.file.string());
  return fmt::format(
      "{}: {} points of {} submaps{}{}", out.string(), cloud->points, cloud->submaps,
      cloud->left_out > 0 ? fmt::format("; {} are not tied to these", cloud->left_out) : "",
      cloud->of_the_largest ? "" : "; the largest component of the map has no clouds, this is of another");
}

Result<std::string> ply_of_run(const fs::path& folder, const FormatSettings&, const fs::path& out) {
  return copy_of(folder / "map.ply", out).map([&] { return out.string() + ": the server's map"; });
}

Result<std::string> pcd_of_run(const fs::path& folder, const FormatSettings&, const fs::path& out) {
  const auto cloud = formats::read_ply((folder / "map.ply").string());
  if (!cloud) return tl::unexpected(cloud.error());
  return formats::write_pcd(out.string(), cloud->points).map([&] {
    return fmt::format("{}: the server's map, {} points without the robots' colours", out.string(),
                       cloud->points.size());
  });
}

Result<std::string> marks_of_map(const MapSource& map, const FormatSettings&, const fs::path& out) {
  return mapfile::export_marks(*map.store, map.content, map.estimate, out)
      .map([&](const mapfile::ExportedMarks& written) {
        return fmt::format(
            "{}: {} marks, {} photos{}", out.string(), written.marks, written.photos,
            written.left_out > 0 ? fmt::format("; {} are in no submap of the map", written.left_out) : "");
      });
}

constexpr std::array kFormats{
    Format{"mcap", ".mcap",
           "For Foxglove, Rerun and PlotJuggler: trajectories (nav_msgs/Path, and poses over time), /tf, the cloud,\n"
           "closures (markers by their state), alerts (/diagnostics), and JSON; docs/report.md has the topics.\n"
           "rosbag2 plays it if it is written with --ros-only.",
           mcap_of_map, mcap_of_run},
    Format{"g2o", ".g2o", "The joint pose graph; beside it which keyframe each vertex is.", g2o_of_map, g2o_of_run},
    Format{"tum", "/", "Every session's trajectory in the joint map, as NAME.tum.", tum_of_map, tum_of_run},
    Format{"voxels", ".voxels.ply", "The centre of every cube of space in which anything was seen.", write_voxels,
           nullptr},
    Format{"ply", ".ply", "What all robots saw, thinned to voxels of 0.1 m.", cloud_of_map<formats::CloudFormat::ply>,
           ply_of_run},
    Format{"pcd", ".pcd", "The same for PCL's programs.", cloud_of_map<formats::CloudFormat::pcd>, pcd_of_run},
    Format{"grid", ".yaml",
           "A map to drive on, as nav2's map server reads it, with the image beside it: where something stands\n"
           "between --low and --high above the ground, where nothing does, and what nobody knows.",
           write_grid, nullptr},
    Format{"marks", ".csv",
           "What operators marked on the page: where, with covariance, who, when, and words; photos beside it.",
           marks_of_map, nullptr},
};

}  // namespace

Result<MapSource> open_map(const fs::path& file, bool live) {
  auto store = live ? mapfile::open_copy(file) : mapfile::open(file);
  std::string why_copied;
  if (!store && !live)
    if (auto copy = mapfile::open_copy(file)) {
      why_copied = store.error().message;
      store = std::move(copy);
    }
  if (!store) return tl::unexpected(store.error());
  auto content = mapfile::read(**store);
  if (!content) return tl::unexpected(content.error());
  auto estimate = mapfile::estimate(*content);
  return MapSource{file, std::move(*store), std::move(*content), std::move(estimate), why_copied};
}

std::span<const Format> all_formats() { return kFormats; }

Result<const Format*> format_of(std::string_view path) {
  const auto* format = std::ranges::find_if(kFormats, [&](const Format& one) { return path.ends_with(one.ending); });
  if (format != kFormats.end()) return format;
  std::vector<std::string> known;
  for (const Format& one : kFormats) known.push_back(fmt::format("{} ({})", one.ending, one.name));
  const bool is_las = path.ends_with(".las") || path.ends_with(".laz");
  return fail(ErrorCode::configuration, "'{}' has no ending of a format, expected one of {}{}", path,
              fmt::join(known, ", "),
              is_las ? fmt::format("; pdal translate map.ply {} makes LAS of a .ply", path) : "");
}

}  // namespace tutti::exports
