// SPDX-License-Identifier: BSD-3-Clause
#include "compare_input.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <set>

#include "tutti/formats/g2o.hpp"
#include "tutti/formats/graph_stamps.hpp"
#include "tutti/formats/trajectory_file.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::app {
namespace {

namespace fs = std::filesystem;
using mission::NamedTrajectory;

Result<Trajectory> load_poses(const std::string& path, std::vector<std::string>& notes) {
  formats::RowReport report;
  auto poses = formats::read_trajectory(path, "auto", 10.0, &report);
  if (poses && poses->empty()) return fail(ErrorCode::invalid, "{}: holds no pose, expected at least one", path);
  for (const std::string& note : report.notes(path)) notes.push_back(note + ".");
  return poses;
}

Result<CompareSide> load_folder(const fs::path& folder, const std::string& estimate) {
  const std::string ending = "_" + estimate + ".tum";
  std::map<std::string, fs::path> files;  // by robot
  std::error_code failure;
  for (fs::directory_iterator entry(folder, failure), end; !failure && entry != end; entry.increment(failure))
    if (const std::string name = entry->path().filename().string();
        name.size() > ending.size() && name.ends_with(ending))
      files[name.substr(0, name.size() - ending.size())] = entry->path();
  if (failure) return fail(ErrorCode::io, "{}: cannot list the folder: {}", folder.string(), failure.message());
  if (files.empty())
    return fail(ErrorCode::io, "{}: holds no *{}, expected the folder that `tutti run --out` wrote", folder.string(),
                ending);
  CompareSide out;
  for (const auto& [robot, path] : files) {
    auto poses = load_poses(path.string(), out.notes);
    if (!poses) return tl::unexpected(poses.error());
    out.robots.push_back({robot, std::move(*poses), {}});
  }
  return out;
}

bool is_graph(const std::string& path) { return fs::path(path).extension() == ".g2o"; }

bool is_there(const std::string& path) {
  std::error_code unreadable;
  return fs::exists(path, unreadable);
}

/// Vertex n of one robot at n seconds.
Result<std::vector<formats::VertexStamp>> numbers_as_stamps(const std::string& path, const formats::G2oFile& file) {
  constexpr double kLatest_s = 2e9;  // as stamps have to fit
  std::vector<formats::VertexStamp> out;
  for (const std::int64_t id : file.vertex_ids) {
    if (std::abs(static_cast<double>(id)) > kLatest_s)
      return fail(ErrorCode::unsupported, "{}: vertex {} cannot stand for a time in seconds, expected {} beside it",
                  path, id, formats::stamps_beside(path));
    out.push_back({id, {}, Timestamp{} + static_cast<double>(id)});
  }
  return out;
}

/// Which robot every vertex of the graph is of, and when. `stamps_path` empty: none are known.
Result<std::vector<formats::VertexStamp>> vertex_stamps(const std::string& path, const formats::G2oFile& file,
                                                        const std::string& stamps_path) {
  if (stamps_path.empty()) return numbers_as_stamps(path, file);
  auto stamps = formats::read_graph_stamps(stamps_path);
  if (!stamps) return tl::unexpected(stamps.error());
  auto out = formats::rows_of(file.vertex_ids, *stamps, stamps_path, path);
  if (!out || stamps_path == formats::stamps_beside(path)) return out;
  std::set<std::int64_t> stated;
  for (const auto& stamp : *stamps) stated.insert(stamp.vertex_id);
  if (stated.size() != out->size())
    return fail(ErrorCode::invalid, "{}: {} vertices, expected the {} of {}, or {} beside it", path, out->size(),
                stated.size(), stamps_path, formats::stamps_beside(path));
  return out;
}

/// Covariance of the motion from one vertex to another as an edge between them, in either direction, states it.
std::optional<Matrix6d> motion_covariance(const std::map<std::pair<std::size_t, std::size_t>, std::size_t>& edge_of,
                                          const PoseGraph& graph, std::size_t from, std::size_t to) {
  for (const bool forward : {true, false}) {
    const auto found = edge_of.find(forward ? std::pair(from, to) : std::pair(to, from));
    if (found == edge_of.end()) continue;
    const PoseGraphEdge& edge = graph.edges[found->second];
    if (!is_definite(edge.information)) continue;
    const RelativePose motion{edge.T_from_to, inverse_of(edge.information)};
    return (forward ? motion : inverse(motion)).covariance;
  }
  return std::nullopt;
}

Result<CompareSide> load_g2o(const std::string& path, const std::string& stamps_path) {
  const auto file = formats::read_g2o(path);
  if (!file) return tl::unexpected(file.error());
  const auto stamps = vertex_stamps(path, *file, stamps_path);
  if (!stamps) return tl::unexpected(stamps.error());
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> edge_of;
  for (std::size_t e = 0; e < file->graph.edges.size(); ++e)
    edge_of.try_emplace({file->graph.edges[e].from, file->graph.edges[e].to}, e);
  std::map<RobotId, std::map<Timestamp, std::size_t>> robots;  // vertex by stamp
  for (std::size_t v = 0; v < stamps->size(); ++v)
    if (!robots[(*stamps)[v].keyframe.chain.robot].try_emplace((*stamps)[v].stamp, v).second)
      return fail(ErrorCode::invalid, "{}: vertex {} has the stamp of another one of its robot", path,
                  file->vertex_ids[v]);
  if (robots.empty()) return fail(ErrorCode::invalid, "{}: holds no vertex, expected at least one", path);
  CompareSide out;
  if (stamps_path.empty())
    out.notes.push_back(fmt::format("{}: no times ({} is not there): vertex n counts as at n seconds.", path,
                                    formats::stamps_beside(path)));
  else if (stamps_path != formats::stamps_beside(path))
    out.notes.push_back(
        fmt::format("{}: no times of its own ({} is not there): its vertices are those of the other "
                    "graph, and so are their times and robots.",
                    path, formats::stamps_beside(path)));
  for (const auto& [robot, vertices] : robots) {
    NamedTrajectory trajectory{robots.size() == 1 ? std::string() : fmt::format("robot {}", robot.value), {}, {}};
    std::optional<std::size_t> before;
    bool complete = true;
    for (const auto& [stamp, v] : vertices) {
      trajectory.poses.push_back({stamp, file->graph.poses[v]});
      if (before) {
        const auto covariance = motion_covariance(edge_of, file->graph, *before, v);
        complete = complete && covariance.has_value();
        trajectory.step_covariance.push_back(covariance.value_or(Matrix6d::Identity()));
      }
      before = v;
    }
    if (!complete) {
      trajectory.step_covariance.clear();
      out.judged_notes.push_back(
          fmt::format("{}{}: not every pose has an edge of full rank to the next one; its odometry counts as "
                      "--odometry-sigma says.",
                      path, trajectory.name.empty() ? "" : ", " + trajectory.name));
    }
    out.robots.push_back(std::move(trajectory));
  }
  return out;
}

std::vector<std::string> names(const CompareSide& side) {
  std::vector<std::string> out;
  for (const auto& robot : side.robots) out.push_back(robot.name.empty() ? "one without a name" : robot.name);
  return out;
}

/// `stamps_path`: of a graph.
Result<CompareSide> load_side(const CompareSource& source, const std::string& stamps_path) {
  const std::string& path = source.path;
  if (is_folder(path)) return load_folder(path, source.estimate);
  if (is_graph(path)) return load_g2o(path, stamps_path);
  CompareSide out;
  auto poses = load_poses(path, out.notes);
  if (!poses) return tl::unexpected(poses.error());
  out.robots.push_back({"", std::move(*poses), {}});
  return out;
}

/// Where a graph's stamps are when the other side is `other`; empty when neither side has times.
Result<std::string> stamps_of(const std::string& path, const std::string& other) {
  if (!is_graph(path) || is_folder(path)) return std::string();
  const std::string own = formats::stamps_beside(path);
  if (is_there(own)) return own;
  const bool other_is_graph = is_graph(other) && !is_folder(other);
  if (other_is_graph && is_there(formats::stamps_beside(other))) return formats::stamps_beside(other);
  if (other_is_graph || !is_there(path) || !is_there(other)) return std::string();
  return fail(ErrorCode::invalid,
              "{}: its poses have no times, but those of {} have: expected {} beside it, as `tutti run` writes it and "
              "`tutti optimise` copies it",
              path, other, own);
}

}  // namespace

bool is_folder(const std::string& path) {
  std::error_code unreadable;
  return fs::is_directory(path, unreadable);
}

Result<std::pair<CompareSide, CompareSide>> load_sides(const CompareSource& a, const CompareSource& b) {
  const auto a_stamps = stamps_of(a.path, b.path);
  if (!a_stamps) return tl::unexpected(a_stamps.error());
  const auto b_stamps = stamps_of(b.path, a.path);
  if (!b_stamps) return tl::unexpected(b_stamps.error());
  auto side_a = load_side(a, *a_stamps);
  if (!side_a) return tl::unexpected(side_a.error());
  auto side_b = load_side(b, *b_stamps);
  if (!side_b) return tl::unexpected(side_b.error());
  return std::pair(std::move(*side_a), std::move(*side_b));
}

Result<std::vector<ComparePair>> pair_robots(const CompareSide& a, const CompareSide& b,
                                             std::vector<std::string>& notes) {
  if (a.robots.size() == 1 && b.robots.size() == 1) return std::vector<ComparePair>{{&a.robots[0], &b.robots[0]}};
  std::vector<ComparePair> out;
  const auto find = [](const CompareSide& side, const std::string& name) {
    return std::find_if(side.robots.begin(), side.robots.end(), [&](const auto& robot) { return robot.name == name; });
  };
  for (const NamedTrajectory& robot : b.robots) {
    const auto judge = find(a, robot.name);
    if (judge == a.robots.end())
      notes.push_back(fmt::format("A has no robot {}: left out.", robot.name));
    else
      out.push_back({&*judge, &robot});
  }
  for (const NamedTrajectory& robot : a.robots)
    if (find(b, robot.name) == b.robots.end()) notes.push_back(fmt::format("B has no robot {}: left out.", robot.name));
  if (out.empty())
    return fail(ErrorCode::invalid, "no robot is in both: A has {}; B has {}", fmt::join(names(a), ", "),
                fmt::join(names(b), ", "));
  return out;
}

}  // namespace tutti::app
