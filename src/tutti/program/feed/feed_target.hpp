// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tutti/base/ids.hpp"
#include "tutti/base/result.hpp"
#include "tutti/model/input.hpp"
#include "tutti/model/trajectory.hpp"
#include "tutti/node/robot_alert.hpp"
#include "tutti/robot/next_keyframe.hpp"
#include "tutti/robot/odometry_watch.hpp"

namespace tutti::program {

struct TeamMate {
  RobotId robot;
  std::string name;
  Timestamp stamp;  ///< When the team-mate was last seen, in its robot's own time.
  /// Where, in this robot's map; nothing when it is in another component of the server's map.
  std::optional<Pose3> T_map_body;
  friend bool operator==(const TeamMate&, const TeamMate&) = default;
};

/// A robot's knowledge as its live feed reports it.
struct FeedState {
  ChainId chain;
  std::string name;
  // The frame `odom` is the client's here; it begins anew where the client's odometry jumps.
  std::optional<StampedPose> newest;       ///< T_odom_body of the newest sample taken.
  Pose3 T_map_odom;                        ///< Jumps with every correction, and where the client's odometry jumps.
  Pose3 T_odom_fed;                        ///< RobotAgent::T_odom_fed(): changes where the client's odometry jumps.
  Matrix6d covariance = Matrix6d::Zero();  ///< RobotAgent::covariance(): of T_map_odom * newest, right tangent.
  std::pair<std::uint64_t, std::uint64_t>
      map_age;                             ///< ProxyGraph::age() of the newest graph heard; zeros before the first.
  std::optional<std::uint32_t> component;  ///< The server's map's; nothing while the map does not know this chain.
  std::optional<Pose3> T_map_world;        ///< RobotAgent::T_map_world(): of that component's world.
  /// In the frame of a map that does not move, while the robot is localised there; right tangent. Its stamp is
  /// `located`.
  std::optional<RelativePose> T_world_body;
  Timestamp located;
  bool wants_scan = false;  ///< A scan from now on would be used.
  std::vector<TeamMate> team_mates;
  std::vector<node::RobotAlert> alerts;
  /// field_texts() of the robot's NodeStatus, another one whenever these change; null before the first. Shared, because
  /// the state is copied for every odometry sample.
  std::shared_ptr<const std::vector<std::pair<std::string, std::string>>> status;
  std::optional<Timestamp> stored;    ///< The newest sample that a kill would not lose.
  robot::NextKeyframe next_keyframe;  ///< Determines at which later sample a scan would be wanted.
  robot::OdometryWatch watch;         ///< RobotAgent::watch()
  bool ended = false;                 ///< The client has ended the recording, and everything before that is stored.
};

/// The robot's trajectory and the map's estimate of it, as of one update of the map.
struct FeedTrajectory {
  std::pair<std::uint64_t, std::uint64_t> map_age;  ///< ProxyGraph::age()
  std::size_t constraints = 0;                      ///< RobotAgent::ledger()
  Trajectory corrected;                             ///< RobotAgent::corrected()
  Trajectory map;                                   ///< trajectory_of() the proxy graph that was heard.
};

/// A sample or scan that was accepted from the client and turned out to be unusable.
struct FeedRefusal {
  Timestamp stamp;
  std::string why;
};

/// The robot behind a live feed, as a session sees it. Every call returns at once.
class FeedTarget {
 public:
  virtual ~FeedTarget() = default;
  /// An error states why the input was refused, and nothing has changed then; or how many of the IMU's samples were.
  virtual Status add(Input input) = 0;
  /// Sets what the client's later inputs come from.
  virtual void set_sensors(const Sensors& /*sensors*/) {}
  /// Ends the recording; FeedState::ended shows when that is done.
  virtual Status finish() = 0;
  /// From now on take_trajectories() has something to return.
  virtual void want_trajectory() {}
  /// The trajectories since the last call, as far as they were kept.
  virtual std::vector<FeedTrajectory> take_trajectories() { return {}; }
  /// The refusals since the last call.
  virtual std::vector<FeedRefusal> take_refusals() { return {}; }
  [[nodiscard]] virtual FeedState state() const = 0;
};

}  // namespace tutti::program
