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
#include "tutti/model/trajectory.hpp"
#include "tutti/node/journal.hpp"
#include "tutti/program/feed/feed_sensors.hpp"
#include "tutti/robot/next_keyframe.hpp"
#include "tutti/robot/odometry_watch.hpp"

namespace tutti::program {

struct TeamMate {
  RobotId robot;
  std::string name;
  Timestamp stamp;                  ///< When it was last seen, in its own time.
  std::optional<Pose3> T_map_body;  ///< Where, in this robot's map; nothing in another component.
  friend bool operator==(const TeamMate&, const TeamMate&) = default;
};

/// A stretch of odometry where localisation failed, or the map is wrong; or a sensor that is not heard.
struct FeedAlert {
  std::string text;
  Timestamp since;  ///< The newest sample when it was first raised.
  Timestamp from, until;
  friend bool operator==(const FeedAlert&, const FeedAlert&) = default;
};

/// What a robot knows, as its live feed tells it.
struct FeedState {
  ChainId chain;
  std::string name;
  // `odom` is the client's here, and begins anew where that does.
  std::optional<StampedPose> newest;       ///< T_odom_body of the newest sample taken.
  Pose3 T_map_odom;                        ///< Jumps with every correction, and where the client's odometry jumps.
  Pose3 T_odom_fed;                        ///< RobotAgent::T_odom_fed(): changes where the client's odometry jumps.
  Matrix6d covariance = Matrix6d::Zero();  ///< RobotAgent::covariance(): of T_map_odom * newest, right tangent.
  std::pair<std::uint64_t, std::uint64_t> map_age;  ///< ProxyGraph::age() of the newest one heard; zeros: none yet.
  std::optional<std::uint32_t> component;           ///< Nothing: the map does not know this chain.
  bool wants_scan = false;                          ///< A scan from now on would be used.
  std::vector<TeamMate> team_mates;
  std::vector<FeedAlert> alerts;
  std::optional<Timestamp> stored;    ///< The newest sample that a kill would not lose.
  robot::NextKeyframe next_keyframe;  ///< A scan of a later sample would be used when one is due there.
  robot::OdometryWatch watch;         ///< RobotAgent::watch()
  bool ended = false;                 ///< The client has said so, and all before is stored.
};

/// After an update of the map.
struct FeedWay {
  std::pair<std::uint64_t, std::uint64_t> map_age;  ///< ProxyGraph::age()
  std::size_t constraints = 0;                      ///< RobotAgent::ledger()
  Trajectory corrected;                             ///< RobotAgent::corrected()
  Trajectory map;                                   ///< trajectory_of() the graph that was heard.
};

/// A sample or scan that was taken from the client and turned out to be no good.
struct FeedRefusal {
  Timestamp stamp;
  std::string why;
};

/// The robot behind a live feed.
class FeedTarget {
 public:
  virtual ~FeedTarget() = default;
  /// An error: it was refused, and why; nothing has changed.
  virtual Status add_odometry(const node::OdometrySample& sample) = 0;
  virtual Status add_scan(const Scan& scan) = 0;
  /// What its client has, from its next input on.
  virtual void set_sensors(const FeedSensors& /*sensors*/) {}
  virtual Status add_images(FedImages images) {
    return fail(ErrorCode::unsupported, "images at {} ns: this robot takes none", images.stamp.ns);
  }
  /// An error where any of them was left out.
  virtual Status add_imu(const std::vector<ImuSample>& samples) {
    return fail(ErrorCode::unsupported, "{} IMU samples: this robot takes none", samples.size());
  }
  /// FeedState::ended says when it is done.
  virtual Status finish() = 0;
  /// From now on there are ways to take.
  virtual void want_ways() {}
  /// Since the last call, as far as they are kept.
  virtual std::vector<FeedWay> take_ways() { return {}; }
  /// Since the last call.
  virtual std::vector<FeedRefusal> take_refusals() { return {}; }
  [[nodiscard]] virtual FeedState state() const = 0;
};

}  // namespace tutti::program
