// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <variant>

#include "tutti/base/ids.hpp"
#include "tutti/base/timestamp.hpp"
#include "tutti/bus/envelope.hpp"
#include "tutti/model/closure_word.hpp"
#include "tutti/model/loop_closure.hpp"
#include "tutti/model/refinement.hpp"
#include "tutti/node/change_watch.hpp"
#include "tutti/robot/agent.hpp"

/// What has happened at a node, for whoever keeps a record. How long it took is not in it: that is the host's to
/// measure, and the same inputs give the same events.
namespace tutti::node {

struct SubmapStored {  ///< By the server, for the first time.
  SubmapId id;
};
struct VerdictsTaken {  ///< By the server; of those refused there are MessageRefused beside.
  std::string job;
  std::size_t pairs = 0;
};
struct WordTaken {  ///< By the server, from an operator.
  SubmapPair pair;
  Wish wish = Wish::withdraw;
};
struct VerificationFailed {  ///< The pair is asked again (ServerNodeConfig::most_tries).
  SubmapPair pair;
  std::string why;
  bool given_up = false;  ///< No more: it is refused.
};
struct RefinementTaken {  ///< By the server.
  std::string job;
  std::uint64_t revision = 0;  ///< Of the map that was refined.
  bool whole = false;
  std::size_t steps = 0;
  std::vector<RefinementRemark> remarks;
};
struct RefinementFailed {  ///< It is asked for again (ServerNodeConfig::most_tries).
  std::uint64_t revision = 0;
  std::string why;
  bool given_up = false;  ///< No more, until something new has come; the map stands.
};
struct MapUpdated {
  std::uint64_t revision = 0;
  std::size_t submaps = 0;
  std::size_t accepted = 0;  ///< Closures.
};
struct RobotUpdated {
  RobotId robot;
  robot::UpdateSummary summary;
};
struct MessageRefused {  ///< It was no good, or what was to be sent was not.
  bus::Endpoint from;
  bus::MessageKind kind = bus::MessageKind::submap;
  std::string why;
};
struct RobotJoined {  ///< The server takes this session as the owner of name and number from now on.
  RobotId robot;
  std::string name;
  std::uint64_t session = 0;
};
struct RobotRefused {  ///< Another program with a name or number that is in use: told by the server, and by the robot.
  RobotId robot;
  std::uint64_t session = 0;
  std::string why;
};
struct StateLost {  ///< What was stored of the robot cannot be read: a new session; submaps that wait are kept.
  RobotId robot;
  std::uint64_t session = 0;  ///< The new one.
  std::string why;
};
struct SubmapsForgotten {  ///< By the server's map, which is another than before: told by the robot, which sends them
                           ///< again.
  RobotId robot;
  std::size_t submaps = 0;
};
struct SampleRefused {
  RobotId robot;
  std::string why;
};
/// A step of odometry that no body makes: the robot is taken to stay, and goes on from there.
struct OdometryJumped {
  RobotId robot;
  robot::OdometryJump jump;
};
struct ScanRefused {
  RobotId robot;
  std::string why;
  bool later = false;  ///< Not by the step that took it: its odometry came after it.
};
struct ImagesRefused {
  RobotId robot;
  std::string why;
  bool later = false;  ///< Not by the step that took them.
};
/// Keyframe after keyframe without what a sensor of the robot sees: it is broken, or comes too late. Then no closures
/// are found.
struct SensorMissing {
  RobotId robot;
  std::string sensor;           ///< scan, images
  std::uint64_t keyframes = 0;  ///< So many; 0: it is back.
};

struct Event {
  Timestamp time;
  std::variant<SubmapStored, VerdictsTaken, WordTaken, VerificationFailed, RefinementTaken, RefinementFailed,
               MapUpdated, ChangeOfMind, RobotUpdated, MessageRefused, RobotJoined, RobotRefused, StateLost,
               SubmapsForgotten, SampleRefused, OdometryJumped, ScanRefused, ImagesRefused, SensorMissing>
      what;
};

}  // namespace tutti::node
