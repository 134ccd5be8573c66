// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/feed/robot_view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "tutti/consistency/alerts.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::program {
namespace {

/// In a map that does not move the robot's own trajectory is tied to the world of the floor on which the map shows the
/// robot.
void set_place(const localise::Located& located, bool wants_scan, const Pose3& T_map_body, FeedState& out) {
  out.wants_scan |= wants_scan;
  out.component.reset();
  out.T_map_world.reset();
  if (located.state == localise::State::localised) {
    out.component = located.floor - 1;
    out.T_map_world = T_map_body * located.T_world_body->T_a_b.inverse();
    out.T_world_body = located.T_world_body;
    out.located = located.stamp;
  } else if (located.state != localise::State::searching) {
    out.alerts.push_back({fmt::format("{} in its map: {}", to_string(located.state), located.why), located.stamp,
                          located.stamp, located.stamp});
  }
}

}  // namespace

void RobotView::note(const node::Event& event, const node::RobotNode& node) {
  const auto* update = std::get_if<node::RobotUpdated>(&event.what);
  const auto newest = node.agent().newest_sample();
  if (const auto* missing = std::get_if<node::SensorMissing>(&event.what); missing != nullptr && newest) {
    missing_.erase(missing->sensor);
    if (missing->keyframes > 0)
      missing_[missing->sensor] = {fmt::format("{} keyframes without {}: no closures are found there",
                                               missing->keyframes, missing->sensor == "scan" ? "a scan" : "images"),
                                   *newest, *newest, *newest};
  }
  if (std::holds_alternative<node::SessionBegun>(event.what)) *this = RobotView(std::move(name_), std::move(names_));
  if (update == nullptr || update->summary.synchronised == 0 || !newest) return;
  if (!first_) first_ = *newest;
  consistency::Suspicion record{.time_s = *newest - *first_, .revision = update->summary.revision};
  for (const auto& origin : update->summary.explanation.origins)
    if (origin.alert) record.origins.push_back(origin);
  if (updates_.empty() && record.origins.empty()) return;  // before the first alert there is nothing to follow
  updates_.push_back(std::move(record));
  alerts_.clear();
  for (const consistency::Alert& alert : consistency::follow_alerts(updates_)) {
    if (alert.withdrawn_s) continue;
    const consistency::SuspectedOrigin& origin = alert.origin;
    alerts_.push_back(
        {fmt::format("odometry and map differ by {:.2f} m and {:.1f} degrees within {:.1f} m of trajectory, more "
                     "than odometry allows for: localisation failed there, or the map is wrong",
                     origin.translation_m, origin.rotation_rad / kRadPerDeg, origin.length_m),
         *first_ + alert.known_since_s, origin.from, origin.until});
  }
  if (alerts_.empty()) updates_.clear();
}

FeedState RobotView::state(const node::RobotNode& node) const {
  const robot::RobotAgent& agent = node.agent();
  FeedState out{.chain = agent.chain(),
                .name = name_,
                .newest = agent.newest_fed(),
                .T_map_odom = agent.T_map_odom() * agent.T_odom_fed(),
                .T_odom_fed = agent.T_odom_fed(),
                .covariance = agent.covariance(),
                .map_age = agent.map_age(),
                .component = agent.component(),
                .T_map_world = agent.T_map_world(),
                .wants_scan = agent.wants_scan(),
                .team_mates = {},
                .alerts = alerts_,
                .next_keyframe = agent.next_keyframe(),
                .watch = agent.watch()};
  if (const localise::Localiser* localiser = node.localiser(); localiser != nullptr && out.newest)
    set_place(localiser->located(), localiser->wants_scan(out.newest->stamp), agent.T_map_body(), out);
  for (const auto& [sensor, alert] : missing_) out.alerts.push_back(alert);
  std::ranges::copy(node.alerts(), std::back_inserter(out.alerts));
  for (const robot::Whereabouts& other : agent.whereabouts()) {
    const auto given = names_.find(other.robot);
    std::string name = given == names_.end() ? other.name : given->second;
    if (name.empty()) name = fmt::format("robot {}", other.robot.value);  // its server does not tell
    out.team_mates.push_back({other.robot, std::move(name), other.stamp, other.T_map_body});
  }
  return out;
}

RobotId robot_id_of(const std::string& name) {
  std::uint32_t hash = 2'166'136'261U;
  for (const char letter : name) hash = (hash ^ static_cast<unsigned char>(letter)) * 16'777'619U;
  return RobotId{hash | 0x8000'0000U};
}

RobotId RobotView::number_of(const std::string& name) const {
  const auto found = std::ranges::find(names_, name, [](const auto& entry) { return entry.second; });
  return found == names_.end() ? robot_id_of(name) : found->first;
}

Status taken(const node::Step& step) {
  for (const node::Event& event : step.events) {
    if (const auto* sample = std::get_if<node::SampleRefused>(&event.what))
      return fail(ErrorCode::invalid, "{}", sample->why);
    if (const auto* scan = std::get_if<node::ScanRefused>(&event.what); scan != nullptr && !scan->later)
      return fail(ErrorCode::invalid, "{}", scan->why);
    if (const auto* images = std::get_if<node::ImagesRefused>(&event.what); images != nullptr && !images->later)
      return fail(ErrorCode::invalid, "{}", images->why);
    if (const auto* fix = std::get_if<node::FixRefused>(&event.what)) return fail(ErrorCode::invalid, "{}", fix->why);
  }
  return {};
}

}  // namespace tutti::program
