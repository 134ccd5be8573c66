// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/localise_mission.hpp"

#include <algorithm>
#include <iterator>
#include <limits>
#include <utility>

#include "tutti/evaluation/association.hpp"
#include "tutti/geometry/covariance.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/mission/kidnapped.hpp"
#include "tutti/mission/lift_ride.hpp"
#include "tutti/mission/robot_actor.hpp"
#include "tutti/model/pose_at.hpp"

namespace tutti::mission {
namespace {

constexpr double kCourse_s = 0.1;
constexpr double kTrueStart_m = 0.1, kTrueStart_rad = 1.0 * kRadPerDeg;  // what a true start pose is stated to err by

/// The poses of a robot on a floor of the map, or on all, of all its sessions.
Trajectory poses_in(const mapfile::OpenedMap& map, const std::string& robot,
                    std::optional<std::uint32_t> floor = std::nullopt) {
  Trajectory out;
  for (const MapNode& node : map.estimate.nodes) {
    const auto name = map.content.names.find(node.id.chain.robot);
    const auto on = map.floors.of_component(node.component);
    if (on && (!floor || on == floor) && name != map.content.names.end() && name->second == robot)
      out.push_back({node.stamp, node.T_world_body});
  }
  std::ranges::sort(out, {}, &StampedPose::stamp);
  const auto twice = std::ranges::unique(out, {}, &StampedPose::stamp);
  out.erase(twice.begin(), twice.end());
  return out;
}

bool overlaps(const Trajectory& a, const Trajectory& b) {
  return !a.empty() && !b.empty() && a.front().stamp <= b.back().stamp && b.front().stamp <= a.back().stamp;
}

/// A floor's, by the robots that made the map there; nothing when none of them has a reference.
std::optional<MapReference> reference_of(const mapfile::OpenedMap& map, std::uint32_t floor, const MissionInput& input,
                                         const evaluation::AssociationConfig& association) {
  std::vector<std::vector<evaluation::PosePair>> drives;
  for (const MissionRecording& robot : input.robots) {
    const Trajectory poses = poses_in(map, robot.recording.name, floor);
    if (overlaps(poses, robot.recording.reference))
      drives.push_back(evaluation::associate(poses, robot.recording.reference, association));
  }
  return lay_on_map(std::move(drives));
}

/// In the reference's frame, in which floors can be compared.
std::vector<Pose3> keyframes_of(const localise::KnownMap& map, const std::vector<std::optional<MapReference>>& floors) {
  std::vector<Pose3> out;
  for (const auto& [id, entry] : map.submaps) {
    const auto& floor = floors.at(entry.floor - 1);
    if (!floor) continue;
    for (const Keyframe& keyframe : entry.submap->keyframes)
      out.push_back(floor->T_world_reference.inverse() * entry.T_world_odom() * keyframe.T_odom_body);
  }
  return out;
}

Eigen::Vector2d heading(const Pose3& pose) { return (pose.rotation * Eigen::Vector3d::UnitX()).head<2>().normalized(); }

void measure_starts(const std::vector<Pose3>& keyframes, const Trajectory& reference, LocalisedRobot& robot) {
  const Timestamp begin = robot.course.empty() ? reference.front().stamp : robot.course.front().stamp;
  for (LocalisedRobot::Start& start : robot.starts)
    for (const auto& [stamp, pose] : reference) {
      const double since_s = stamp - begin - start.at_s;
      if (since_s < 0.0 || since_s > LocalisedRobot::kOneSubmap_s) continue;
      double nearest_m = std::numeric_limits<double>::infinity();
      for (const Pose3& keyframe : keyframes) {
        const double apart_m = (keyframe.translation - pose.translation).norm();
        nearest_m = std::min(nearest_m, apart_m);
        if (apart_m > LocalisedRobot::kSamePlace_m) continue;
        const double cosine = heading(keyframe).dot(heading(pose));
        start.turned_deg =
            std::min(start.turned_deg.value_or(180.0), std::acos(std::clamp(cosine, -1.0, 1.0)) / kRadPerDeg);
      }
      start.from_map_m = std::max(start.from_map_m.value_or(0.0), nearest_m);
    }
}

/// Notes the kidnaps at these times at which it was localised. Returns its course without what it published until it
/// said so.
std::vector<localise::Located> measure_kidnaps(const std::vector<Timestamp>& at, LocalisedRobot& robot) {
  std::vector<localise::Located> rest = robot.course;
  const Timestamp begin = rest.empty() ? Timestamp{} : rest.front().stamp;
  const auto is_localised = [](const localise::Located& one) { return one.state == localise::State::localised; };
  for (const Timestamp taken : at) {
    const auto after = std::ranges::upper_bound(rest, taken, {}, &localise::Located::stamp);
    if (after == rest.begin() || !is_localised(*std::prev(after))) continue;
    const auto said = std::find_if_not(after, rest.end(), is_localised);
    const auto found = std::find_if(said, rest.end(), is_localised);
    LocalisedRobot::Kidnap kidnap{.at_s = taken - begin, .said_after_s = {}, .found_after_s = {}};
    if (said != rest.end()) kidnap.said_after_s = said->stamp - taken;
    if (found != rest.end()) kidnap.found_after_s = found->stamp - taken;
    robot.kidnaps.push_back(kidnap);
    rest.erase(after, said);
  }
  return rest;
}

/// Where the robot is in the map at its first sample, on the floor whose robots have been nearest.
Result<StartPose> true_start(const Recording& recording, const std::vector<std::optional<MapReference>>& floors) {
  const auto T_reference_body = pose_at(recording.reference, recording.odometry.front().stamp);
  std::optional<StartPose> out;
  double least_m = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; T_reference_body && k < floors.size(); ++k) {
    if (!floors[k]) continue;
    const evaluation::PosePair& nearest = *floors[k]->nearest(T_reference_body->translation).front();
    const double away_m = (nearest.reference.translation - T_reference_body->translation).norm();
    if (away_m >= least_m) continue;
    least_m = away_m;
    out = StartPose{.T_world_body = RelativePose{in_map(nearest, *T_reference_body),
                                                 diagonal_covariance(kTrueStart_m, kTrueStart_rad)},
                    .floor = static_cast<std::uint32_t>(k + 1)};
  }
  if (!out)
    return fail(
        ErrorCode::invalid,
        "{}: no reference says where it starts in the map, expected one of its own and of the robots that made the map",
        recording.name);
  return *out;
}

/// That of the robot after this one; of the first after the last.
const Recording& next_of(const Recording& recording, const std::vector<const MissionRecording*>& robots) {
  const auto at = std::ranges::find_if(
      robots, [&](const MissionRecording* robot) { return robot->recording.robot == recording.robot; });
  return (at + 1 == robots.end() ? robots.front() : *(at + 1))->recording;
}

/// Replays one recording alone.
LocalisedRobot replay(const MissionRecording& recording, const MissionConfig& config,
                      std::shared_ptr<const localise::Localiser::Setup> setup, const std::optional<StartPose>& start,
                      double restart_s, const std::function<bool(const std::string&, double)>& stop) {
  robot::AgentConfig agent = config.agent;
  agent.submap.fit.scans = "off";  // nobody hears its map
  RobotActor robot(recording, agent, config.association, nullptr, std::move(setup));
  const localise::Localiser& localiser = *robot.node().localiser();
  const Timestamp begin = recording.recording.odometry.front().stamp;
  const double length_s = recording.recording.odometry.back().stamp - begin;
  LocalisedRobot out{.name = recording.recording.name};
  out.starts.emplace_back();
  if (start) robot.start_at(*start, kMissionStart + recording.start_s);
  while (std::isfinite(robot.next_time())) {
    const double time_s = robot.next_time();
    if (stop && stop(out.name, length_s > 0.0 ? (time_s - recording.start_s) / length_s : 1.0)) break;
    const localise::LocaliserWork before = localiser.work();
    const double cpu_s = robot.cpu_s();
    if (const double since_s = time_s - recording.start_s;
        restart_s > 0.0 && since_s >= restart_s * static_cast<double>(out.starts.size()) &&
        since_s + restart_s <= length_s) {
      robot.start_at({}, kMissionStart + time_s);
      out.starts.push_back({.at_s = since_s});
    }
    robot.replay_next(kMissionStart + time_s);
    robot.take_step();
    const localise::LocaliserWork after = localiser.work();
    if (after.registered > before.registered && after.compared == before.compared)  // else a submap was looked for
      out.scan_ms.push_back(1e3 * (robot.cpu_s() - cpu_s));
    localise::Located now = localiser.located();
    if (now.state == localise::State::localised && !out.starts.back().fix_after_s) {
      out.starts.back().fix_after_s = now.stamp - begin - out.starts.back().at_s;
      if (out.starts.size() == 1) out.first_fix_cpu_s = robot.cpu_s();
    }
    if (out.course.empty() || out.course.back().state != now.state || now.stamp - out.course.back().stamp >= kCourse_s)
      out.course.push_back(std::move(now));
  }
  out.work = localiser.work();
  out.map_fit = localiser.map_fit().fits();
  out.cpu_s = robot.cpu_s();
  out.troubles = robot.troubles();
  if (!out.course.empty()) out.duration_s = out.course.back().stamp - begin;
  return out;
}

}  // namespace

double LocalisedRobot::share(localise::State state) const {
  double in_state_s = 0.0;
  for (std::size_t k = 0; k + 1 < course.size(); ++k)
    if (course[k].state == state) in_state_s += course[k + 1].stamp - course[k].stamp;
  return duration_s > 0.0 ? in_state_s / duration_s : 0.0;
}

std::optional<double> LocalisedRobot::fresh_share() const {
  const auto is_localised = [](const localise::Located& one) { return one.state == localise::State::localised; };
  const auto first = std::ranges::find_if(course, is_localised);
  double fresh_s = 0.0;
  for (auto now = first; now != course.end() && now + 1 != course.end(); ++now)
    if (is_localised(*now) && now->age_s <= kFresh_s) fresh_s += (now + 1)->stamp - now->stamp;
  const double since_s = first == course.end() ? 0.0 : course.back().stamp - first->stamp;
  return since_s > 0.0 ? std::optional(fresh_s / since_s) : std::nullopt;
}

Trajectory LocalisedRobot::published(std::uint32_t floor) const {
  Trajectory out;
  for (const localise::Located& located : course)
    if (located.state == localise::State::localised && located.T_world_body && located.floor == floor &&
        (out.empty() || out.back().stamp < located.stamp))
      out.push_back({located.stamp, located.T_world_body->T_a_b});
  return out;
}

std::map<SubmapId, localise::PlaceTrust> trust_of(const std::vector<LocalisedRobot>& robots) {
  std::map<SubmapId, localise::PlaceTrust> out;
  for (const LocalisedRobot& robot : robots)
    for (const auto& [submap, fit] : robot.map_fit) out[submap].add(fit);
  return out;
}

std::shared_ptr<const localise::Localiser::Setup> localise_setup(
    const MissionConfig& config, const robot::SubmapConfig& submap, std::shared_ptr<const localise::KnownMap> map,
    std::function<std::shared_ptr<const server::ClosureVerifier>()> make_verifier) {
  return std::make_shared<const localise::Localiser::Setup>(
      localise::Localiser::Setup{.map = std::move(map),
                                 .make_verifier = std::move(make_verifier),
                                 .lidar = config.closures.lidar,
                                 .submap = submap,
                                 .config = config.localise});
}

Follow follow_by_node(const MissionConfig& config, std::shared_ptr<const localise::KnownMap> map,
                      std::function<std::shared_ptr<const server::ClosureVerifier>()> make_verifier, double restart_s,
                      std::function<bool(const std::string&, double share)> stop) {
  return [&config, map = std::move(map), make_verifier = std::move(make_verifier), restart_s, stop = std::move(stop)](
             const MissionRecording& robot, const std::optional<StartPose>& start) {
    auto setup = localise_setup(config, drive::with_sensors(config.agent, robot.recording).submap, map, make_verifier);
    return replay(robot, config, std::move(setup), start, restart_s, stop);
  };
}

Result<std::vector<LocalisedRobot>> localise_mission(const MissionConfig& config, const MissionInput& input,
                                                     const mapfile::OpenedMap& map, const LocaliseTrial& trial,
                                                     const Follow& follow) {
  std::vector<std::optional<MapReference>> floors;
  for (std::uint32_t floor = 1; floor <= map.known->floors; ++floor)
    floors.push_back(reference_of(map, floor, input, config.association));
  const bool has_reference = std::ranges::any_of(floors, [](const auto& floor) { return floor.has_value(); });
  const std::vector<Pose3> keyframes = keyframes_of(*map.known, floors);
  std::vector<const MissionRecording*> driving;
  for (const MissionRecording& robot : input.robots) {
    const Trajectory& odometry = robot.recording.odometry;
    if (!odometry.empty() && !overlaps(poses_in(map, robot.recording.name), odometry)) driving.push_back(&robot);
  }
  std::vector<LocalisedRobot> out;
  for (const MissionRecording* const drives : driving) {
    MissionRecording robot = *drives;
    Recording& recording = robot.recording;
    std::vector<Timestamp> kidnapped_at;
    if (trial.kidnap_s > 0.0 || trial.lift) {
      auto made = trial.lift ? ride_lift(recording, next_of(recording, driving)) : kidnapped(recording, trial.kidnap_s);
      if (!made) return tl::unexpected(made.error());
      recording = std::move(made->recording);
      kidnapped_at = std::move(made->at);
    }
    std::optional<StartPose> start;
    if (trial.true_start) {
      const auto known = true_start(recording, floors);
      if (!known) return tl::unexpected(known.error());
      start = *known;
    }
    out.push_back(follow(robot, start));
    const auto course = measure_kidnaps(kidnapped_at, out.back());
    if (!has_reference || recording.reference.empty()) continue;
    const auto score = [&](const std::vector<localise::Located>& of) {
      return score_of(of, recording.reference, floors, config.association);
    };
    out.back().score = score(course);
    if (!kidnapped_at.empty()) {
      const auto& all = out.back().course;
      const auto since = std::ranges::upper_bound(all, kidnapped_at.front(), {}, &localise::Located::stamp);
      out.back().score_since_kidnap = score({since, all.end()});
    }
    measure_starts(keyframes, recording.reference, out.back());
  }
  if (out.empty())
    return fail(ErrorCode::invalid, "every robot of the mission has made this map, expected one to be localised in it");
  return out;
}

}  // namespace tutti::mission
