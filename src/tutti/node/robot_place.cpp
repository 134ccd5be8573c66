// SPDX-License-Identifier: BSD-3-Clause
// Where a robot's node is in a map that does not move.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "tutti/base/plain_text.hpp"
#include "tutti/node/place_book.hpp"
#include "tutti/node/robot_node.hpp"
#include "tutti/node/robot_tables.hpp"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/field_bytes.hpp"

namespace tutti::node {

void RobotNode::begin_localising() {
  localiser_.reset();
  places_ = {};
  if (config_.localise) localiser_.emplace(*config_.localise);
}

/// A row that cannot be read, as one of a newer version, is as none.
Status RobotNode::begin_at_stored_place() {
  const auto row = store_.read(robot_tables::kMeta, robot_tables::kPlace);
  if (!row) return tl::unexpected(row.error());
  if (!*row || !localiser_) return {};
  const auto stored = wire::read_fields<StoredPlace>(**row);
  const auto start = stored ? start_at(*stored, localiser_->map()) : std::nullopt;
  if (start) (void)localiser_->add(*start);  // one that cannot be is refused
  return {};
}

bool RobotNode::wants_scan(Timestamp stamp) const {
  const bool is_wanted = stamp == agent_.newest_sample() ? agent_.wants_scan() : agent_.wants_scan(stamp);
  return is_wanted || (localiser_ && localiser_->wants_scan(stamp));
}

/// An input that the localiser refuses was refused by the agent before, or is of no use to the localiser.
void RobotNode::locate(const Input& input, Timestamp now, Step& step) {
  if (!localiser_) return;
  (void)localiser_->add(input);
  tell_place(now, step);
  if (localiser_->map().floors > 1 && places_.is_elsewhere(localiser_->located()))
    return change_floor(localiser_->located().floor, now, step);
  if (!places_.wants(agent_, localiser_->state())) return;
  places_.note(agent_, localiser_->located(), localiser_->map());
  // Where there is a server, its map corrects it. The graph is as it will be read again after a start.
  if (const auto graph = base_ ? std::nullopt : places_.graph_if_due(agent_))
    follow(wire::decode_proxy_graph(wire::encode(*graph)).value(), now, step);
}

/// Nothing measures how it got there: what it sees from now on is a session of its own.
void RobotNode::change_floor(std::uint32_t floor, Timestamp now, Step& step) {
  agent_.finish();
  settle(now, step);
  change_session(fmt::format("it is on floor {} now", floor), now, step);
}

void RobotNode::hear(const StartPose& start, Timestamp now, Step& step) {
  const Status ok = localiser_ ? localiser_->add(start)
                               : fail(ErrorCode::unsupported,
                                      "a start pose, and this robot does not localise in a map: start it with --map "
                                      "FILE --localise");
  if (!ok) return step.emit(now, SampleRefused{agent_.robot(), ok.error().message});
  places_.forget_state();  // somebody has asked
  tell_place(now, step);
}

void RobotNode::tell_place(Timestamp now, Step& step) {
  if (!places_.is_news(localiser_->state())) return;
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
            .floor = located.floor,
            .T_world_body = {},
            .sigma_m = {},
            .sigma_deg = {},
            .age_s = {},
            .overlap = {},
            .fits = fits_to_return(localiser_->map_fit().fits(), located.stamp)};
  if (!located.T_world_body) return out;
  const Matrix6d& covariance = located.T_world_body->covariance;
  out.T_world_body = located.T_world_body->T_a_b;
  out.sigma_m = std::sqrt(covariance.topLeftCorner<3, 3>().trace());
  out.sigma_deg = std::sqrt(covariance(5, 5)) * kDegPerRad;
  out.age_s = std::max(0.0, located.age_s);
  out.overlap = located.overlap;
  return out;
}

}  // namespace tutti::node
