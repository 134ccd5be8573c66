// SPDX-License-Identifier: BSD-3-Clause
// Where a robot's node is in a map that does not move.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "tutti/base/plain_text.hpp"
#include "tutti/node/robot_node.hpp"

namespace tutti::node {

void RobotNode::begin_localising() {
  localiser_.reset();
  told_.reset();
  if (config_.localise) localiser_.emplace(*config_.localise);
}

bool RobotNode::wants_scan(Timestamp stamp) const {
  return agent_.wants_scan(stamp) || (localiser_ && localiser_->wants_scan(stamp));
}

/// What the localiser refuses, the agent has refused before, or it is of no use to it.
void RobotNode::locate(const Input& input, Timestamp now, Step& step) {
  if (!localiser_) return;
  (void)localiser_->add(input);
  tell_place(now, step);
}

void RobotNode::tell_place(Timestamp now, Step& step) {
  const localise::State state = localiser_->state();
  if (std::exchange(told_, state) == state) return;
  localise::Located located = localiser_->located();
  std::vector<std::string> places;
  for (const localise::PlaceFound& place : located.places) places.push_back(localiser_->map().names.of(place.submap));
  step.emit(now, RobotLocated{agent_.robot(), std::move(located), std::move(places)});
}

InMap RobotNode::in_map() const {
  if (!localiser_) return {};
  constexpr double kDegPerRad = 180.0 / std::numbers::pi;
  const localise::Located located = localiser_->located();
  InMap out{.map = localiser_->map().id,
            .version = localiser_->map().revision,
            .state = std::string(to_string(located.state)),
            .why = plain_text(located.why),
            .T_world_body = {},
            .sigma_m = {},
            .sigma_deg = {},
            .age_s = {}};
  if (!located.T_world_body) return out;
  const Matrix6d& covariance = located.T_world_body->covariance;
  out.T_world_body = located.T_world_body->T_a_b;
  out.sigma_m = std::sqrt(covariance.topLeftCorner<3, 3>().trace());
  out.sigma_deg = std::sqrt(covariance(5, 5)) * kDegPerRad;
  out.age_s = std::max(0.0, located.age_s);
  return out;
}

}  // namespace tutti::node
