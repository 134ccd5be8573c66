// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/lab/mission_config.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <memory>
#include <string_view>
#include <utility>

#include "tutti/lab/demo_missions.hpp"
#include "tutti/lab/policies.hpp"

namespace tutti::lab {
namespace {

/// No two poses of a graph are that close: every one is a keyframe, which closures name.
constexpr double kEveryPose_s = 1e-6;

mission::MissionConfig& of_recordings(MissionConfig& config) { return config; }

constexpr std::string_view kDefault = "what was its default is always so, leave it out";
constexpr std::string_view kOfKind = "simulated odometry has a kind, see `tutti settings odometry.kind`";
/// Settings of the version before: a key from any of its words on, and what is to be done instead.
constexpr std::array<std::pair<std::string_view, std::string_view>, 15> kGone = {{
    {"odometry.tilt_deg_per_sqrt_m", kOfKind},
    {"odometry.floor_m", kOfKind},
    {"odometry.floor_deg", kOfKind},
    {"odometry.yaw_drift_deg_per_m", "odometry.yaw_bias_deg_per_m drifts, too"},
    {"odometry.consistent_length_m", kOfKind},
    {"odometry.stated_sigma_factor", kOfKind},
    {"odometry.slip_m", "it is always 0.1, leave it out"},
    {"odometry.degeneracy", "set odometry.slide_percent, or odometry.kind to sliding"},
    {"odometry.failure", "set odometry.kind to failing, or odometry.scripted"},
    {"closures.wrong", kDefault},
    {"place", kDefault},
    {"hall.world", "hall.boxes says how many boxes stand there, and what else was its default is always so"},
    {"hall.imu", kDefault},
    {"hall.lidar", kDefault},
    {"flight.rate_hz", kDefault},
}};

void complain_of_gone(const ConfigNode& node, const std::string& path, config_internal::Findings& findings) {
  for (std::size_t i = 0; i < node.list.size(); ++i)
    complain_of_gone(node.list[i], fmt::format("{}.{}", path, i), findings);
  for (const auto& [key, value] : node.map) {
    const std::string full = path.empty() ? key : path + "." + key;
    const auto gone = std::ranges::find_if(kGone, [dotted = "." + full](const auto& setting) {
      return dotted.ends_with(fmt::format(".{}", setting.first));
    });
    if (gone == kGone.end())
      complain_of_gone(value, full, findings);
    else
      config_internal::complain(findings, value, full, fmt::format("is no setting any more: {}", gone->second));
  }
}

/// For each simulated robot; one without a name is named by its place in the list.
template <class Robots>
void check_names(const Robots& robots, const char* path, std::vector<std::string>& problems) {
  for (std::size_t i = 0; i < robots.size(); ++i)
    if (const std::string why = mission::problem_of_name(robots[i].name); !why.empty())
      problems.push_back(fmt::format("{}.{}.name: {}", path, i, why));
}

void check_closures(const MissionConfig& config, std::vector<std::string>& problems) {
  const ClosureChanges& closures = config.closure_changes;
  if (!closures.come_with_mission()) {
    std::ranges::move(mission::problems_of_verifier(config), std::back_inserter(problems));
  }
  if (!closures.planted.empty() && closures.verifier != "reference")
    problems.push_back(
        fmt::format("closures.planted: given, but closures.verifier is '{}', expected 'reference'", closures.verifier));
  for (std::size_t i = 0; i < config.robots.size(); ++i)
    if (const LabVerifier* kind = closures.lab_verifier(); kind != nullptr && !kind->has(config.robots[i]))
      problems.push_back(
          fmt::format("robots.{}.{}: missing, but closures.verifier is '{}'", i, kind->needs, closures.verifier));
  if (closures.verifier == "recorded" && config.source != "recordings")
    problems.push_back(fmt::format("closures.verifier: is 'recorded', but source is '{}'", config.source));
  if (config.source == "simulation" && closures.verifier == "lidar" && config.simulation.sensors != "lidar")
    problems.push_back(
        fmt::format("closures.verifier: is 'lidar', but simulation.sensors is '{}'; expected verifier 'reference'",
                    config.simulation.sensors));
}

void check_receivers(const MissionConfig& config, std::vector<std::string>& problems) {
  for (std::size_t i = 0; i < config.receivers.size(); ++i) {
    const simulation::ReceiverConfig& receiver = config.receivers[i];
    if (receiver.outage_s.size() != 0 && receiver.outage_s.size() != 2)
      problems.push_back(fmt::format("receivers.{}.outage_s: {} numbers, expected 2", i, receiver.outage_s.size()));
    if (receiver.antenna_m.size() != 0 && receiver.antenna_m.size() != 3)
      problems.push_back(fmt::format("receivers.{}.antenna_m: {} numbers, expected 3", i, receiver.antenna_m.size()));
  }
}

Status check_mission(const MissionConfig& config, const std::string& name) {
  std::vector<std::string> problems;
  if (config.source == "recordings" && config.robots.empty())
    problems.emplace_back("robots: none given, expected at least one (or source: simulation)");
  std::ranges::move(mission::problems_of(config), std::back_inserter(problems));
  check_names(config.simulation.robots, "simulation.robots", problems);
  check_names(config.hall.robots, "hall.robots", problems);
  check_closures(config, problems);
  check_receivers(config, problems);
  for (const std::string& policy : config.compare_policies)
    if (const auto known = make_policy(policy, config.agent, Rng(1)); !known)
      problems.push_back("compare_policies: " + known.error().message);
  for (std::string& problem : problems) problem.insert(0, ": ");
  return config_internal::to_status(name, problems);
}

Result<MissionConfig> finish(ConfigNode root, const std::string& name, const std::vector<std::string>& assignments) {
  for (const std::string& assignment : assignments)
    if (const auto ok = apply_override(root, assignment); !ok) return tl::unexpected(ok.error());
  auto config = read_mission(root, name);
  if (!config) return config;
  if (const auto ok = check_mission(*config, name); !ok) return tl::unexpected(ok.error());
  return config;
}

/// Where closures come with the mission, their source is a setting of the laboratory.
ConfigNode without_verifier(ConfigNode root) {
  for (auto& [key, value] : root.map)
    if (key == "closures")
      std::erase_if(value.map, [](const auto& entry) {
        return entry.key == "verifier" || entry.key == verifiers::VerifierConfig::kFormerName;
      });
  return root;
}

}  // namespace

Result<MissionConfig> read_mission(const ConfigNode& root, const std::string& name) {
  config_internal::Findings gone;
  complain_of_gone(root, "", gone);
  if (const auto ok = config_internal::to_status(name, gone.problems); !ok) return tl::unexpected(ok.error());
  MissionConfig config;
  ConfigLoader loader;
  loader.load(root, config);
  const ConfigNode rest = config.closure_changes.come_with_mission() ? without_verifier(root) : root;
  loader.load(rest, of_recordings(config));
  if (const auto ok = loader.finish(name); !ok) return tl::unexpected(ok.error());
  if (mission::has_graphs(config)) config.agent.submap.keyframe_time_s = kEveryPose_s;
  return config;
}

Result<MissionConfig> load_mission(const std::filesystem::path& file, const std::vector<std::string>& assignments) {
  std::error_code ignored;
  if (file == "demo" && !std::filesystem::is_regular_file(file, ignored)) return demo_mission(assignments);
  auto root = load_yaml(file.string());
  if (!root) return tl::unexpected(root.error());
  return finish(std::move(*root), file.string(), assignments);
}

Result<MissionConfig> parse_mission(const std::string& text, const std::string& name,
                                    const std::vector<std::string>& assignments) {
  auto root = parse_yaml(text, name);
  if (!root) return tl::unexpected(root.error());
  return finish(std::move(*root), name, assignments);
}

Result<MissionConfig> demo_mission(const std::vector<std::string>& assignments, DemoSensors sensors) {
  struct BuiltIn {
    const char* text;
    const char* name;
  };
  static constexpr std::array kMissions = {BuiltIn{kDemoMission, "missions/demo.yaml"},
                                           BuiltIn{kHallMission, "missions/hall.yaml"},
                                           BuiltIn{kHallMixedMission, "missions/hall_mixed.yaml"}};
  const auto& [text, name] = kMissions.at(static_cast<std::size_t>(sensors));
  return parse_mission(text, name, assignments);
}

std::string to_yaml(const MissionConfig& config) {
  ConfigNode all = dump_config<mission::MissionConfig>(config);
  MissionConfig rest = config;
  if (!rest.closure_changes.come_with_mission()) rest.closure_changes.verifier = config.closures.verifier;
  merge_config(all, dump_config(rest));
  return tutti::to_yaml(all);
}

MissionDocs document_mission() {
  const auto config = std::make_unique<const MissionConfig>();  // large
  MissionDocs out{.product = document_config<mission::MissionConfig>(*config), .laboratory = {}};
  for (config_internal::FieldDoc& field : document_config(*config)) {
    const auto there = std::ranges::find(out.product, field.path, &config_internal::FieldDoc::path);
    if (there != out.product.end())
      *there = std::move(field);
    else
      out.laboratory.push_back(std::move(field));
  }
  return out;
}

}  // namespace tutti::lab
