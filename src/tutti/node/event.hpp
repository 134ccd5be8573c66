// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "tutti/base/ids.hpp"
#include "tutti/base/timestamp.hpp"
#include "tutti/bus/envelope.hpp"
#include "tutti/localise/state.hpp"
#include "tutti/model/closure_decision.hpp"
#include "tutti/model/loop_closure.hpp"
#include "tutti/model/refinement.hpp"
#include "tutti/node/followed_maps.hpp"
#include "tutti/perception/fit/misfit.hpp"
#include "tutti/robot/agent.hpp"

/// The events at a node, for those who keep a record. They have no durations, because the same inputs must give the
/// same events; the host measures them.
namespace tutti::node {

/// Reported by the server, once per submap.
struct SubmapStored {
  SubmapId id;
};
/// Reported by the server; each refused verdict of the job has a MessageRefused beside.
struct VerdictsTaken {
  std::string job;
  std::size_t pairs = 0;
};
/// Reported by the server: an operator's decision.
struct DecisionTaken {
  SubmapPair pair;
  Wish wish = Wish::withdraw;
};
/// No worker could verify the pair; it is asked again (ServerNodeConfig::most_tries).
struct VerificationFailed {
  SubmapPair pair;
  std::string why;
  bool given_up = false;  ///< The pair was refused instead.
};
/// Reported by the server.
struct RefinementTaken {
  std::string job;
  std::uint64_t revision = 0;  ///< Revision of the map that was refined.
  bool whole = false;
  std::size_t steps = 0;
  std::vector<RefinementRemark> remarks;
};
/// A refinement failed; it is asked for again (ServerNodeConfig::most_tries).
struct RefinementFailed {
  std::uint64_t revision = 0;
  std::string why;
  bool given_up = false;  ///< There is no further try until something new has come; the map stays as it is.
};
/// Reported by the server: an update of the map has ended.
struct MapUpdated {
  std::uint64_t revision = 0;
  std::size_t submaps = 0;
  std::size_t accepted = 0;  ///< Number of accepted closures.
  double cost = 0.0;         ///< server::MapEstimate::cost, and the next two likewise.
  std::size_t degrees_of_freedom = 0;
  bool from_measurements = false;
};
/// Reported by a robot: it has used a proxy graph.
struct RobotUpdated {
  RobotId robot;
  robot::UpdateSummary summary;
};
/// A message was invalid, either one received or one to be sent.
struct MessageRefused {
  bus::Endpoint from;
  bus::MessageKind kind = bus::MessageKind::submap;
  std::string why;
};
/// Reported by the server: from now on this session owns the robot's name and number.
struct RobotJoined {
  RobotId robot;
  std::string name;
  std::uint64_t session = 0;
};
/// Another program uses this name or number; reported by the server and by the robot.
struct RobotRefused {
  RobotId robot;
  std::uint64_t session = 0;
  std::string why;
};
/// The robot's stored state cannot be read, so it begins a new session; its unsent submaps are kept.
struct StateLost {
  RobotId robot;
  std::uint64_t session = 0;  ///< The new session.
  std::string why;
};
/// Reported by the robot: it has begun a new session, a chain of its own; its unsent submaps are kept.
struct SessionBegun {
  RobotId robot;
  std::uint64_t session = 0;  ///< The new session.
  std::string why;
};
/// Reported by the robot: the server's map is another one than before and lacks these submaps, which are sent again.
struct SubmapsForgotten {
  RobotId robot;
  std::size_t submaps = 0;
};
/// Reported by a robot: a sample of odometry, a range or a start pose was refused.
struct SampleRefused {
  RobotId robot;
  std::string why;
};
/// A step of odometry that no body can make; the robot is assumed to stay where it is.
struct OdometryJumped {
  RobotId robot;
  robot::OdometryJump jump;
};
/// A robot's scans contradict its odometry; reported when it is found, and when its size is another.
struct MisfitFound {
  RobotId robot;
  fit::Misfit misfit;
};
/// Reported by a robot: a scan was refused.
struct ScanRefused {
  RobotId robot;
  std::string why;
  bool later = false;  ///< Refused after the step that took it, because odometry came later than the scan.
};
/// Reported by a robot: images were refused.
struct ImagesRefused {
  RobotId robot;
  std::string why;
  bool later = false;  ///< Refused after the step that took them.
};
/// Reported by a robot: a position fix was refused.
struct FixRefused {
  RobotId robot;
  std::string why;
};
/// A robot that localises in a map knows more or less of where it is than before.
struct RobotLocated {
  RobotId robot;
  localise::Located located;
  std::vector<std::string> places;  ///< Names of the submaps of located.places.
};
/// Many keyframes in a row lack what one of the robot's sensors sees, because the sensor is broken or its data come too
/// late. Without it no closures are found.
struct SensorMissing {
  RobotId robot;
  std::string sensor;           ///< "scan" or "images".
  std::uint64_t keyframes = 0;  ///< How many keyframes; 0: the sensor is back.
};

/// One event, at mission time `time`.
struct Event {
  Timestamp time;
  std::variant<SubmapStored, VerdictsTaken, DecisionTaken, VerificationFailed, RefinementTaken, RefinementFailed,
               MapUpdated, ChangeOfMind, RobotUpdated, MessageRefused, RobotJoined, RobotRefused, StateLost,
               SessionBegun, SubmapsForgotten, SampleRefused, OdometryJumped, MisfitFound, ScanRefused, ImagesRefused,
               SensorMissing, FixRefused, RobotLocated>
      what;
};

}  // namespace tutti::node
