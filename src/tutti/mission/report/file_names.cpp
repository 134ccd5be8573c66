// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/report/file_names.hpp"

#include <algorithm>
#include <array>
#include <cctype>

namespace tutti::mission {
namespace {

constexpr std::array kAlways = {"report.json", "timing.json", "report.html",
                                "config.yaml", "graph.g2o",   "graph_stamps.csv"};
constexpr const char* kMap = "map.ply";
constexpr const char* kSurvey = "survey.ply";
constexpr std::array kEstimates = {"onboard", "corrected", "server", "reference"};

std::string safe(const std::string& robot) {
  std::string out = robot;
  for (char& c : out)
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '-' && c != '_') c = '_';
  return out;
}

}  // namespace

std::string trajectory_file_name(const std::string& robot, const std::string& estimate) {
  return safe(robot) + "_" + estimate + ".tum";
}

std::vector<std::string> report_file_names(const MissionRecord& record) {
  std::vector<std::string> out(kAlways.begin(), kAlways.end());
  for (const RobotRecord& robot : record.robots) {
    const PolicyRecord* policy = find_policy(robot, record.default_policy);
    const std::array<bool, kEstimates.size()> there = {!robot.odometry.empty(), policy && !policy->corrected.empty(),
                                                       !robot.server_estimate.empty(), !robot.reference.empty()};
    for (std::size_t i = 0; i < kEstimates.size(); ++i)
      if (there[i]) out.push_back(trajectory_file_name(robot.name, kEstimates[i]));
  }
  if (std::ranges::any_of(record.server.clouds, [](const CloudRecord& seen) { return !seen.cloud.points.empty(); }))
    out.emplace_back(kMap);
  if (record.survey) out.emplace_back(kSurvey);
  return out;
}

bool is_report_file_name(const std::string& name) {
  const auto is = [&](const char* known) { return name == known; };
  if (std::ranges::any_of(kAlways, is) || is(kMap) || is(kSurvey)) return true;
  return std::ranges::any_of(kEstimates, [&](const std::string& estimate) {
    const std::string ending = trajectory_file_name("", estimate);
    return name.size() > ending.size() && name.ends_with(ending) &&
           name == trajectory_file_name(name.substr(0, name.size() - ending.size()), estimate);
  });
}

}  // namespace tutti::mission
