// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/lab/mission_input.hpp"

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/simulation/surface.hpp"

namespace tutti::lab {
namespace {

constexpr double kSurveySpacing_m = 0.1;

std::shared_ptr<const PointCloud> survey_of(const simulation::TriangleMesh& surface, std::uint64_t seed) {
  return std::make_shared<const PointCloud>(
      simulation::sample_surface(surface, kSurveySpacing_m, Rng(seed).fork("survey")));
}

Result<mission::MissionInput> walk(const MissionConfig& config, std::uint64_t seed) {
  auto world = simulation::simulate_recordings(config.simulation, Timestamp{0}, seed);
  if (!world) return tl::unexpected(world.error());
  mission::MissionInput input;
  const auto robots = simulation::single_robots(config.simulation.robots);
  for (std::size_t i = 0; i < world->recordings.size(); ++i)
    input.robots.push_back({.recording = std::move(world->recordings[i]), .start_s = robots[i].start_s});
  if (world->surface) input.survey = survey_of(*world->surface, seed);
  return input;
}

Result<mission::MissionInput> fly(const MissionConfig& config, std::uint64_t seed) {
  auto hall = simulation::simulate_hall(config.hall, Timestamp{0}, seed);
  if (!hall) return tl::unexpected(hall.error());
  mission::MissionInput input;
  for (std::size_t i = 0; i < hall->robots.size(); ++i) {
    auto& [recording, images] = hall->robots[i];
    if (!images.stamps.empty()) {
      recording.images = std::make_shared<const ImageStream>(images);
      auto source = visual::TrackingSource::open(std::move(images), recording.odometry, config.tracking);
      if (!source) return in_context("robot " + recording.name, source.error());
      recording.visual = std::move(*source);
    }
    input.robots.push_back({.recording = std::move(recording), .start_s = config.hall.robots[i].start_s});
  }
  input.survey = survey_of(*hall->surface, seed);
  return input;
}

mission::ChangeOdometry change_of(const RobotChanges& changes, Rng rng) {
  return [changes, rng](Trajectory recorded) mutable {
    const simulation::DegradeConfig& degrade = changes.degrade;
    mission::ChangedOdometry out{.odometry = simulation::degrade_odometry(recorded, degrade),
                                 .T_odom_recorded = {},
                                 .is_bent = degrade.yaw_deg_per_m != 0.0 || degrade.scale_percent != 0.0};
    if (!changes.random_frame) return out;
    out.T_odom_recorded = simulation::random_frame(rng);
    out.odometry = simulation::move_frame(out.odometry, out.T_odom_recorded);
    return out;
  };
}

Result<mission::MissionInput> replay(const MissionConfig& config, const std::filesystem::path& data,
                                     std::uint64_t seed) {
  std::vector<mission::ChangeOdometry> changes;
  for (std::size_t i = 0; i < std::min(config.robots.size(), config.robot_changes.size()); ++i)
    changes.push_back(change_of(config.robot_changes[i], Rng(seed).fork("robot/" + config.robots[i].name)));
  return mission::load_input(config, data, seed, changes);
}

/// A closure planted on a robot that is not there would silently do nothing.
Status check_planted(const MissionConfig& config, const std::vector<mission::MissionRecording>& robots) {
  for (const PlantedClosureConfig& planted : config.closure_changes.planted)
    for (const std::string& name : {planted.robot, planted.other.empty() ? planted.robot : planted.other})
      if (std::ranges::none_of(robots, [&](const auto& robot) { return robot.recording.name == name; }))
        return fail(ErrorCode::configuration, "closures.planted: no robot is called '{}'", name);
  return {};
}

}  // namespace

/// Fixes of a receiver that nobody has would silently be none.
Status add_fixes(const MissionConfig& config, std::uint64_t seed, const std::vector<Recording*>& robots) {
  for (const simulation::ReceiverConfig& receiver : config.receivers) {
    bool any = false;
    for (Recording* robot : robots) {
      if (!receiver.robot.empty() && receiver.robot != robot->name) continue;
      any = true;
      if (robot->reference.empty())
        return fail(ErrorCode::configuration, "receivers: robot {} has no reference to make fixes of", robot->name);
      set_measured(*robot, simulation::simulate_fixes(robot->reference, receiver, simulation::PlaceConfig{},
                                                      Rng(seed).fork("receiver/" + robot->name)));
    }
    if (!any) return fail(ErrorCode::configuration, "receivers: no robot is called '{}'", receiver.robot);
  }
  return {};
}

Status add_ranges(const MissionConfig& config, std::uint64_t seed, const std::vector<Recording*>& robots) {
  if (config.ranging.every_s == 0.0) return {};
  for (const Recording* robot : robots)
    if (robot->reference.empty())
      return fail(ErrorCode::configuration, "ranging: robot {} has no reference to make ranges of", robot->name);
  for (Recording* robot : robots)
    set_measured(*robot,
                 simulation::simulate_ranges(*robot, robots, config.ranging, Rng(seed).fork("ranging/" + robot->name)));
  return {};
}

Result<mission::MissionInput> load_input(const MissionConfig& config, const std::filesystem::path& data,
                                         std::uint64_t seed) {
  const bool is_replayed = config.source == "recordings";
  auto input = is_replayed               ? replay(config, data, seed)
               : config.source == "hall" ? fly(config, seed)
                                         : walk(config, seed);
  if (!input) return input;
  if (!is_replayed)
    if (auto ok = mission::fit_input(config, seed, input->robots); !ok) return tl::unexpected(ok.error());
  std::vector<Recording*> recordings;
  for (mission::MissionRecording& robot : input->robots) recordings.push_back(&robot.recording);
  if (auto ok = add_fixes(config, seed, recordings); !ok) return tl::unexpected(ok.error());
  if (auto ok = add_ranges(config, seed, recordings); !ok) return tl::unexpected(ok.error());
  if (auto ok = make_mistakes(config.mistakes, recordings); !ok) return tl::unexpected(ok.error());
  if (auto ok = check_planted(config, input->robots); !ok) return tl::unexpected(ok.error());
  return input;
}

}  // namespace tutti::lab
