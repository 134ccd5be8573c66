// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/exports/run_scene.hpp"

#include <algorithm>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "tutti/base/file.hpp"
#include "tutti/formats/g2o.hpp"
#include "tutti/formats/graph_stamps.hpp"
#include "tutti/formats/ply.hpp"
#include "tutti/formats/trajectory_file.hpp"
#include "tutti/geometry/alignment.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::exports {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

struct Robot {
  std::string name;      ///< ROS's.
  Timestamp first;       ///< By its own clock,
  double start_s = 0.0;  ///< at this mission time.
  Trajectory onboard, corrected, server, reference;
};

double number(const Json& object, const char* key) {
  const auto at = object.find(key);
  return at != object.end() && at->is_number() ? at->get<double>() : std::numeric_limits<double>::quiet_NaN();
}
Eigen::Vector3d vector(const Json& object, const char* key) {
  Eigen::Vector3d out = Eigen::Vector3d::Zero();
  const auto at = object.find(key);
  for (Eigen::Index i = 0; at != object.end() && at->is_array() && at->size() == 3 && i < 3; ++i)
    out(i) = (*at)[static_cast<std::size_t>(i)].is_number() ? (*at)[static_cast<std::size_t>(i)].get<double>() : 0.0;
  return out;
}
const Json& member(const Json& object, const char* key) {
  static const Json kNothing;
  const auto at = object.is_object() ? object.find(key) : object.end();
  return object.is_object() && at != object.end() ? *at : kNothing;
}

std::optional<Pose3> pose(const Json& object) {
  const Json& q = member(object, "quaternion_xyzw");
  if (!q.is_array() || q.size() != 4 || !std::ranges::all_of(q, [](const Json& one) { return one.is_number(); }))
    return std::nullopt;
  const Eigen::Quaterniond rotation(q[3].get<double>(), q[0].get<double>(), q[1].get<double>(), q[2].get<double>());
  if (rotation.norm() < 0.5) return std::nullopt;
  return Pose3{rotation.normalized(), vector(object, "translation_m")};
}

/// Poses of both at equal stamps.
std::vector<std::pair<const StampedPose*, const StampedPose*>> at_equal_stamps(const Trajectory& a,
                                                                               const Trajectory& b) {
  std::vector<std::pair<const StampedPose*, const StampedPose*>> out;
  for (auto i = a.begin(), j = b.begin(); i != a.end() && j != b.end();)
    if (i->stamp == j->stamp)
      out.emplace_back(&*i++, &*j++);
    else
      ++(i->stamp < j->stamp ? i : j);
  return out;
}

/// T_a_b that lays b on a best; nothing where they share no stamp.
std::optional<Pose3> align(const Trajectory& a, const Trajectory& b) {
  std::vector<Eigen::Vector3d> points_a, points_b;
  for (const auto& [of_a, of_b] : at_equal_stamps(a, b)) {
    points_a.push_back(of_a->pose.translation);
    points_b.push_back(of_b->pose.translation);
  }
  if (points_a.empty()) return std::nullopt;
  return align_points(points_a, points_b);
}

class Run {
 public:
  explicit Run(const std::string& folder) : folder_(folder) {}

  Result<Scene> read() {
    const auto text = read_file((folder_ / "report.json").string());
    if (!text) return tl::unexpected(text.error());
    report_ = Json::parse(*text, nullptr, false);
    if (!report_.is_object())
      return fail(ErrorCode::parse, "{}: is no JSON object", (folder_ / "report.json").string());
    if (auto ok = read_robots(); !ok) return tl::unexpected(ok.error());
    if (const auto T = pose(member(member(report_, "server"), "T_reference_world")))
      out_.still.push_back({"world", "reference", T->inverse()});
    add_earth();
    for (const Robot& robot : robots_) add(robot);
    for (std::size_t i = 0; i < robots_.size(); ++i) add_findings(i);
    for (const Json& row : member(member(report_, "server"), "course"))
      out_.numbers.push_back(
          {"course", at(number(row, "time_s")), {{"closures_accepted", number(row, "closures_accepted")}}});
    for (const auto& [name, frame] : {std::pair{"map", "world"}, std::pair{"survey", "reference"}})
      if (auto ok = add_cloud(name, frame); !ok) return tl::unexpected(ok.error());
    if (auto ok = add_closures(); !ok) return tl::unexpected(ok.error());
    return std::move(out_);
  }

 private:
  [[nodiscard]] Timestamp at(double mission_s) const { return begin_ + mission_s; }

  /// For the largest component, in whose frame all trajectories of a run's files are.
  void add_earth() {
    const Json& fixes = member(member(report_, "server"), "fixes");
    const Json& origin = member(fixes, "origin");
    const auto T_enu_world = pose(member(fixes, "T_enu_world"));
    const Geodetic place{number(origin, "latitude_deg"), number(origin, "longitude_deg"), number(origin, "height_m")};
    if (T_enu_world && check_geodetic(place)) out_.earth = {place, "world", *T_enu_world};
  }

  /// All that the report names: their places in it are their numbers.
  Status read_robots() {
    std::optional<double> earliest_s;
    for (const Json& row : member(report_, "robots")) {
      const Json& name = member(row, "name");
      if (!name.is_string()) continue;
      Robot robot{.name = ros_name(name.get<std::string>()), .first = {}};
      std::string file = name.get<std::string>();  // as tutti run names it
      std::ranges::replace_if(
          file, [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '-' && c != '_'; }, '_');
      for (const auto& [trajectory, what] :
           {std::pair{&robot.onboard, "onboard"}, std::pair{&robot.corrected, "corrected"},
            std::pair{&robot.server, "server"}, std::pair{&robot.reference, "reference"}}) {
        const std::string path = (folder_ / (file + "_" + what + ".tum")).string();
        if (!fs::exists(path)) continue;
        auto read = formats::read_trajectory(path, "tum");
        if (!read) return tl::unexpected(read.error());
        *trajectory = std::move(*read);
      }
      if (!robot.onboard.empty()) robot.first = robot.onboard.front().stamp;
      const double start_s = number(row, "start_s");
      robot.start_s = std::isfinite(start_s) ? start_s : 0.0;
      if (!robot.onboard.empty() && (!earliest_s || robot.start_s < *earliest_s)) {
        earliest_s = robot.start_s;
        begin_ = robot.first - robot.start_s;
      }
      rows_.push_back(row);
      robots_.push_back(std::move(robot));
    }
    if (!earliest_s)
      return fail(ErrorCode::invalid, "{}: no ROBOT_onboard.tum, expected what tutti run writes", folder_.string());
    for (Robot& robot : robots_)
      for (Trajectory* trajectory : {&robot.onboard, &robot.corrected, &robot.server, &robot.reference})
        for (StampedPose& sample : *trajectory) sample.stamp = at(robot.start_s + (sample.stamp - robot.first));
    return {};
  }

  void add(const Robot& robot) {
    if (robot.onboard.empty()) return;
    const std::string map = robot.name + "/map", odom = robot.name + "/odom";
    out_.tracks.push_back({robot.name + "/onboard", odom, robot.onboard});
    out_.motions.push_back({odom, robot.name + "/base_link", robot.onboard});
    if (!robot.corrected.empty()) out_.tracks.push_back({robot.name + "/corrected", map, robot.corrected});
    if (!robot.server.empty()) out_.tracks.push_back({robot.name + "/server", "world", robot.server});
    if (!robot.reference.empty()) out_.tracks.push_back({robot.name + "/reference", "reference", robot.reference});
    Scene::Motion T_map_odom{map, odom, {}};
    for (const auto& [corrected, onboard] : at_equal_stamps(robot.corrected, robot.onboard))
      T_map_odom.poses.push_back({corrected->stamp, corrected->pose * onboard->pose.inverse()});
    out_.motions.push_back(std::move(T_map_odom));
    if (const auto T_world_map = align(robot.server, robot.corrected))
      out_.still.push_back({"world", map, *T_world_map});
    add_distances(robot);
  }

  /// From raw odometry, and from its correction, to the server's trajectory, each after one rigid alignment.
  void add_distances(const Robot& robot) {
    std::map<Timestamp, std::vector<std::pair<std::string, double>>> rows;
    for (const auto& [trajectory, name] :
         {std::pair{&robot.onboard, "onboard_m"}, std::pair{&robot.corrected, "corrected_m"}})
      if (const auto T = align(robot.server, *trajectory))
        for (const auto& [server, own] : at_equal_stamps(robot.server, *trajectory))
          rows[server->stamp].emplace_back(name, (server->pose.translation - *T * own->pose.translation).norm());
    for (auto& [stamp, row] : rows) out_.numbers.push_back({robot.name + "/to_server", stamp, std::move(row)});
  }

  void add_findings(std::size_t i) {
    const Robot& robot = robots_[i];
    const Json& explanation = member(rows_[i], "explanation");
    if (explanation.is_object() && !robot.onboard.empty())
      out_.numbers.push_back({robot.name + "/disagreement",
                              robot.onboard.back().stamp,
                              {{"aligned_rmse_m", number(explanation, "aligned_rmse_m")},
                               {"expected_rmse_m", number(explanation, "expected_rmse_m")},
                               {"direction_significance", number(explanation, "direction_significance")}}});
    const auto add_origin = [&](const Json& origin, bool is_alert) {
      const Eigen::Vector3d place = vector(origin, "place_m");
      out_.alerts.push_back(
          {at(number(origin, is_alert ? "known_since_s" : "until_s")),
           is_alert,
           robot.name,
           is_alert ? "odometry is worse here than it says" : "drift is suspected to come from here",
           {{"from_s", fmt::format("{:.1f}", number(origin, "from_s"))},
            {"until_s", fmt::format("{:.1f}", number(origin, "until_s"))},
            {"place_m", fmt::format("{:.2f} {:.2f} {:.2f}", place.x(), place.y(), place.z())},
            {"translation_m", fmt::format("{:.3f}", number(origin, "translation_m"))},
            {"rotation_deg", fmt::format("{:.2f}", 1.0 / kRadPerDeg * number(origin, "rotation_rad"))},
            {"significance", fmt::format("{:.2f}", number(origin, "significance"))}}});
    };
    for (const Json& origin : member(explanation, "suspected_origins"))
      if (member(origin, "until_s").is_number()) add_origin(origin, false);
    for (const Json& alert : member(rows_[i], "alerts"))
      if (member(alert, "known_since_s").is_number()) add_origin(alert, true);
  }

  Status add_cloud(const std::string& name, const std::string& frame) {
    const std::string path = (folder_ / (name + ".ply")).string();
    if (!fs::exists(path)) return {};
    auto cloud = formats::read_ply(path);
    if (!cloud) return tl::unexpected(cloud.error());
    out_.clouds.push_back({name, frame, std::move(*cloud)});
    return {};
  }

  /// Edges that are no step of one robot's odometry.
  Status add_closures() {
    const std::string path = (folder_ / "graph.g2o").string();
    if (!fs::exists(path)) return {};
    const auto graph = formats::read_g2o(path);
    if (!graph) return tl::unexpected(graph.error());
    const auto stamps = formats::read_graph_stamps(formats::stamps_beside(path));
    if (!stamps) return tl::unexpected(stamps.error());
    std::map<std::int64_t, const formats::VertexStamp*> of_vertex;
    for (const formats::VertexStamp& stamp : *stamps) of_vertex[stamp.vertex_id] = &stamp;
    for (const PoseGraphEdge& edge : graph->graph.edges) {
      const auto a = of_vertex.find(graph->vertex_ids[edge.from]), b = of_vertex.find(graph->vertex_ids[edge.to]);
      if (a == of_vertex.end() || b == of_vertex.end()) continue;
      const KeyframeId &from = a->second->keyframe, &to = b->second->keyframe;
      if (from.chain == to.chain && to.index == from.index + 1) continue;
      if (from.chain.robot.value >= robots_.size() || to.chain.robot.value >= robots_.size()) continue;
      const auto when = [&](const formats::VertexStamp& vertex) {
        const Robot& robot = robots_[vertex.keyframe.chain.robot.value];
        return at(robot.start_s + (vertex.stamp - robot.first));
      };
      const auto name = [&](const KeyframeId& id) {
        return fmt::format("{} keyframe {}", robots_[id.chain.robot.value].name, id.index);
      };
      out_.closures.push_back({.name = name(from) + " - " + name(to),
                               .state = "accepted",
                               .reason = {},
                               .between_robots = from.chain.robot != to.chain.robot,
                               .frame = "world",
                               .stamp = std::max(when(*a->second), when(*b->second)),
                               .from = graph->graph.poses[edge.from].translation,
                               .to = graph->graph.poses[edge.to].translation,
                               .numbers = {}});
    }
    return {};
  }

  fs::path folder_;
  Json report_;
  Timestamp begin_;
  std::vector<Robot> robots_;
  std::vector<Json> rows_;  ///< The report's, for those robots.
  Scene out_;
};

}  // namespace

Result<Scene> scene_of_run(const std::string& folder) { return Run(folder).read(); }

}  // namespace tutti::exports
