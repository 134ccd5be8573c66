// SPDX-License-Identifier: BSD-3-Clause
// Reports as the page of web/, with what they show in it.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "tutti/mission/report/compare.hpp"
#include "tutti/mission/report/geometry.hpp"
#include "tutti/mission/report/report.hpp"
#include "tutti/mission/view_recorder.hpp"
#include "tutti/program/field_json.hpp"
#include "tutti/program/page/cloud_bytes.hpp"
#include "tutti/program/page/page_file.hpp"
#include "tutti/program/page/view.hpp"

namespace tutti::mission {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostSurveyPoints = 200'000;

Json rounded(double value, double digits = 1e4) {
  return std::isfinite(value) ? Json(std::round(digits * value) / digits) : Json(nullptr);
}

/// A component's world in the frame of the page's poses.
Pose3 page_from_world(const MissionRecord& record, std::uint32_t component) {
  if (record.view == nullptr) return {};
  const auto found = record.view->T_upright_world.find(component);
  return found == record.view->T_upright_world.end() ? Pose3() : found->second;
}

/// Where its raw odometry alone puts the robot's submaps: moved as one rigid body onto the map's frame.
void add_odometry(const RobotRecord& robot, const Pose3& T_page_odom, const ViewRecord& view, Json& submaps) {
  for (const auto& [id, T_odom_submap] : view.T_odom_submap) {
    if (id.chain.robot != robot.id) continue;
    submaps[to_string(id)] = Json::parse(page::pose_text(T_page_odom * T_odom_submap));
  }
}

/// Whose trajectories they are, and when.
struct Whose {
  std::string name;
  RobotId robot;
  std::uint32_t component = 0;
  PictureClock clock;
  double time_s = 0.0;  ///< The messages' mission time.
};

void add_trajectory(const Whose& whose, const char* kind, const Points3d& points, const Trajectory& stamps,
                    std::vector<page::Message>& out) {
  if (points.empty() || points.size() != stamps.size()) return;
  Json all = Json::array();
  for (std::size_t i = 0; i < points.size(); ++i)
    all.push_back({rounded(whose.clock(stamps[i].stamp)), rounded(points[i].x()), rounded(points[i].y()),
                   rounded(points[i].z())});
  out.push_back({fmt::format("trajectory/{}/{}", whose.name, kind), whose.time_s,
                 text_of({{"name", whose.name},
                          {"robot", whose.robot.value},
                          {"component", whose.component},
                          {"points", std::move(all)}})});
}

/// One robot's estimates, moved as one rigid body each onto the frame that the map is shown in.
void add_trajectories(const MissionRecord& record, const RobotRecord& robot, Json& odometry,
                      std::vector<page::Message>& out) {
  const RobotGeometry geometry = robot_geometry(record, robot);
  const Pose3 T_page_world = page_from_world(record, robot.component);
  const Pose3 T_page_display =
      geometry.has_reference ? T_page_world * display_from_world(record, robot.component).inverse() : T_page_world;
  const PictureClock clock = mission_clock(robot);
  const auto add = [&](const char* kind, Points3d points, const Trajectory& stamps) {
    for (Eigen::Vector3d& point : points) point = T_page_display * point;
    add_trajectory({robot.name, robot.id, robot.component, clock, record.duration_s}, kind, points, stamps, out);
  };
  if (record.view != nullptr) add_odometry(robot, T_page_display * geometry.T_base_odom, *record.view, odometry);
  const PolicyRecord* const policy = find_policy(robot, record.default_policy);
  add("onboard", geometry.onboard, robot.odometry);
  if (policy != nullptr) add("corrected", geometry.corrected, policy->corrected);
  add("server", geometry.server, robot.server_estimate);
  add("reference", geometry.reference, robot.reference);
  Json errors = Json::array();
  for (const KeyframeError& error : geometry.errors)
    errors.push_back({rounded(error.time_s), rounded(error.onboard_m), rounded(error.corrected_m),
                      rounded(error.server_m), rounded(error.born_m)});
  out.push_back({"errors/" + robot.name, record.duration_s,
                 text_of({{"robot", robot.id.value},
                          {"names", {"onboard", "corrected", "server", "born"}},
                          {"against", geometry.has_reference ? "reference" : "server"},
                          {"points", std::move(errors)}})});
}

/// The true surface, in the frame of the largest component's map.
void add_survey(const MissionRecord& record, std::vector<page::Message>& out,
                std::map<std::string, std::string>& clouds) {
  if (record.survey == nullptr || record.survey->points.empty() || !record.server.T_reference_world) return;
  const Pose3 T_page_reference =
      page_from_world(record, record.server.largest_component) * record.server.T_reference_world->inverse();
  const Eigen::Matrix3f R = T_page_reference.rotation.toRotationMatrix().cast<float>();
  const Eigen::Vector3f t = T_page_reference.translation.cast<float>();
  PointCloud moved;
  moved.points.reserve(record.survey->points.size());
  for (const Eigen::Vector3f& point : record.survey->points) moved.points.emplace_back(R * point + t);
  clouds["survey"] = page::cloud_bytes(moved, kMostSurveyPoints);
  out.push_back(
      {"survey", record.duration_s, text_of({{"cloud", "survey"}, {"component", record.server.largest_component}})});
}

/// Its explanation's times are the robot's.
void add_disagreement(const Whose& whose, const consistency::Explanation& found, std::vector<page::Message>& out) {
  if (found.stamps.empty()) return;
  out.push_back(page::disagreement_message(
      {.name = whose.name, .robot = whose.robot, .component = whose.component, .time_s = whose.time_s}, found,
      whose.clock));
}

Points3d positions(const Trajectory& trajectory) {
  Points3d out;
  for (const StampedPose& p : trajectory) out.push_back(p.pose.translation);
  return out;
}

}  // namespace

std::string report_html(const MissionRecord& record) {
  std::vector<page::Message> messages{page::mission_message({.name = record.mission,
                                                             .description = record.description,
                                                             .mode = "report",
                                                             .version = record.version,
                                                             .duration_s = record.duration_s})};
  std::map<std::string, std::string> clouds;
  if (record.view != nullptr) {
    messages.insert(messages.end(), record.view->messages.begin(), record.view->messages.end());
    clouds = record.view->clouds;
  }
  Json odometry = Json::object();
  for (const RobotRecord& robot : record.robots) {
    add_trajectories(record, robot, odometry, messages);
    if (robot.explanation)
      add_disagreement({robot.name, robot.id, robot.component, mission_clock(robot), record.duration_s},
                       *robot.explanation, messages);
  }
  messages.push_back({"odometry", record.duration_s, text_of({{"submaps", std::move(odometry)}})});
  add_survey(record, messages, clouds);
  messages.push_back({"report", record.duration_s, report_json(record)});
  messages.push_back({"timing", record.duration_s, timing_json(record)});
  if (!record.effective_config_yaml.empty())
    messages.push_back({"settings", record.duration_s, text_of(record.effective_config_yaml)});
  return page::offline_page(messages, clouds);
}

std::string compare_html(const CompareReport& report) {
  std::vector<page::Message> messages{page::mission_message(
      {.name = report.b, .description = "judged by " + report.a, .mode = "compare", .version = report.version})};
  std::uint32_t number = 0;
  for (const TrajectoryComparison& c : report.robots) {
    const PictureClock clock{c.judged.front().stamp};
    const Whose whose{c.name.empty() ? "B" : c.name, RobotId{number++}, 0, clock, clock(c.judged.back().stamp)};
    add_trajectory(whose, "server", positions(c.judge), c.judge, messages);
    add_trajectory(whose, "onboard", positions(c.judged), c.judged, messages);
    if (!c.constraints.empty()) add_trajectory(whose, "corrected", positions(c.corrected), c.corrected, messages);
    add_disagreement(whose, c.explanation, messages);
  }
  messages.push_back({"compare", messages.back().time_s, compare_json(report)});
  return page::offline_page(messages, {});
}

}  // namespace tutti::mission
