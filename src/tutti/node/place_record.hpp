// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tutti/localise/known_map.hpp"
#include "tutti/localise/state.hpp"
#include "tutti/model/messages.hpp"
#include "tutti/model/start_pose.hpp"
#include "tutti/robot/agent.hpp"

namespace tutti::node {

/// Where a robot was in a map when it last knew. After a start it is a start pose, no more: it may have been moved.
struct StoredPlace {
  std::string map;  ///< KnownMap::id
  Pose3 T_world_body;
  SubmapId near;  ///< The map's submap that was nearest: on its floor, however another version numbers floors.
  template <class V>
  void describe(V& v) {
    v.field(1, "map_id", map);
    v.field(2, "T_world_body", T_world_body);
    v.field(3, "robot", near.chain.robot);
    v.field(4, "session", near.chain.session);
    v.field(5, "index", near.index);
  }
  friend bool operator==(const StoredPlace&, const StoredPlace&) = default;
};
/// Nothing when it is of another map, or the map has that submap no more.
std::optional<StartPose> start_at(const StoredPlace& place, const localise::KnownMap& map);

/// Where a robot was localised in a map as it drove: from it a robot without a server makes the proxy graph that a
/// server would send, so that its own trajectory is corrected by the map in the same way, by the comparison and the
/// constraints of the paper. One that has a server is corrected by that. Only the last place is stored. It is of one
/// floor of the map: when the robot has left that, another one begins.
class PlaceRecord {
 public:
  /// True when the state is another than at the last call, and at the first one.
  bool is_news(localise::State state) { return std::exchange(state_, state) != state; }
  void forget_state() { state_.reset(); }

  /// note() would change something.
  [[nodiscard]] bool wants(const robot::RobotAgent& agent, localise::State state) const {
    return seen_ != agent.keyframes().size() || (state == localise::State::lost && !places_.empty());
  }
  /// To be called after each input. Representative keyframes made while the robot is localised are noted. When it is
  /// lost, those of the last kDoubted_s go: they were at the wrong place already.
  void note(const robot::RobotAgent& agent, const localise::Located& located, const localise::KnownMap& map);
  static constexpr double kDoubted_s = 3.0;

  /// The last place that was noted, once.
  std::optional<StoredPlace> take_unstored() { return std::exchange(unstored_, std::nullopt); }
  /// True where the robot is localised on another floor than what was noted.
  [[nodiscard]] bool is_elsewhere(const localise::Located& located) const {
    return located.state == localise::State::localised && !places_.empty() && located.floor != floor_;
  }
  /// The graph of what was noted, when it is time: a tenth more nodes than in the one before, and kLeastNew at least.
  std::optional<ProxyGraphMessage> graph_if_due(const robot::RobotAgent& agent);
  static constexpr std::size_t kLeastNew = 8;

 private:
  struct Place {
    Timestamp stamp;
    RelativePose T_world_body;
  };
  std::optional<localise::State> state_;
  std::uint32_t floor_ = 1;
  std::vector<Place> places_;
  std::optional<StoredPlace> unstored_;
  std::size_t seen_ = 0;  // of the agent's keyframes
  std::size_t told_ = 0;  // places in the last graph
};

}  // namespace tutti::node
