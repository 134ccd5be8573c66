// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "tutti/base/file.hpp"
#include "tutti/formats/g2o.hpp"
#include "tutti/formats/graph_stamps.hpp"
#include "tutti/formats/ply.hpp"
#include "tutti/formats/trajectory_file.hpp"
#include "tutti/mission/report/file_names.hpp"
#include "tutti/mission/report/report.hpp"
#include "tutti/program/page/colours.hpp"

namespace tutti::mission {
namespace {

namespace fs = std::filesystem;

/// Files that an earlier mission wrote here, by its report.json, are not to be taken for this one's.
Status remove_former(const fs::path& out_dir) {
  const auto former = nlohmann::json::parse(read_file((out_dir / "report.json").string()).value_or(""), nullptr, false);
  if (!former.is_object() || !former.contains("files") || !former["files"].is_array()) return {};
  for (const auto& entry : former["files"]) {
    if (!entry.is_string() || !is_report_file_name(entry.get<std::string>())) continue;
    const fs::path path = out_dir / entry.get<std::string>();
    std::error_code failure;
    if (!fs::is_regular_file(fs::symlink_status(path, failure))) continue;
    fs::remove(path, failure);
    if (failure)
      return fail(ErrorCode::io, "{}: cannot remove what an earlier mission wrote: {}", path.string(),
                  failure.message());
  }
  return {};
}

Status write_trajectories(const MissionRecord& record, const fs::path& out_dir) {
  for (const auto& robot : record.robots) {
    const PolicyRecord* policy = find_policy(robot, record.default_policy);
    const std::pair<const char*, const Trajectory*> files[] = {{"onboard", &robot.odometry},
                                                               {"corrected", policy ? &policy->corrected : nullptr},
                                                               {"server", &robot.server_estimate},
                                                               {"reference", &robot.reference}};
    for (const auto& [estimate, trajectory] : files) {
      if (trajectory == nullptr || trajectory->empty()) continue;
      const fs::path path = out_dir / trajectory_file_name(robot.name, estimate);
      if (auto status = formats::write_tum(path.string(), *trajectory); !status) return status;
    }
  }
  return {};
}

/// Vertex ids are positions in the graph; the side file has each one's robot and time.
Status write_graph(const ServerRecord& server, const fs::path& out_dir) {
  if (auto status = formats::write_g2o((out_dir / "graph.g2o").string(), server.graph); !status) return status;
  std::vector<formats::VertexStamp> stamps;
  for (const NodeRecord& node : server.nodes)
    stamps.push_back({static_cast<std::int64_t>(stamps.size()), node.id, node.stamp});
  return formats::write_graph_stamps((out_dir / "graph_stamps.csv").string(), stamps);
}

Status write_map(const MissionRecord& record, const fs::path& out_dir) {
  std::vector<Eigen::Vector3f> points;
  std::vector<formats::Rgb> colours;
  for (const auto& seen : record.server.clouds) {
    const auto robot = std::find_if(record.robots.begin(), record.robots.end(),
                                    [&](const RobotRecord& r) { return r.id == seen.robot; });
    points.insert(points.end(), seen.cloud.points.begin(), seen.cloud.points.end());
    const page::Colour& of_robot =
        page::kOnLight[static_cast<std::size_t>(robot - record.robots.begin()) % page::kRobotColours];
    colours.resize(points.size(), {of_robot[0], of_robot[1], of_robot[2]});
  }
  if (!points.empty())
    if (auto status = formats::write_ply((out_dir / "map.ply").string(), points, colours); !status) return status;
  return record.survey ? formats::write_ply((out_dir / "survey.ply").string(), record.survey->points) : Status();
}

std::string config_text(const MissionRecord& record) {
  return fmt::format("# Tutti {}; mission {}; seed {}.\n# Every setting this run used, defaults included.\n{}",
                     record.version, record.mission, record.seed, record.effective_config_yaml);
}

}  // namespace

Status write_report(const MissionRecord& record, const fs::path& out_dir) {
  std::error_code error;
  fs::create_directories(out_dir, error);
  if (error) return fail(ErrorCode::io, "{}: cannot make the output folder: {}", out_dir.string(), error.message());
  if (auto status = remove_former(out_dir); !status) return status;
  for (const auto& [name, text] : {std::pair<const char*, std::string>{"report.json", report_json(record)},
                                   {"timing.json", timing_json(record)},
                                   {"report.html", report_html(record)},
                                   {"config.yaml", config_text(record)}})
    if (auto status = write_file((out_dir / name).string(), text); !status) return status;
  if (auto status = write_trajectories(record, out_dir); !status) return status;
  if (auto status = write_graph(record.server, out_dir); !status) return status;
  return write_map(record, out_dir);
}

}  // namespace tutti::mission
