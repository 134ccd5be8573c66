// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tutti/base/ids.hpp"
#include "tutti/base/timestamp.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/model/method_id.hpp"

/// What nodes know about each other. Every time is mission time of the sender, whose clock others do not share.
namespace tutti {

/// robot or worker -> server, every two seconds: that it is there, and how it is. What its role has not is 0.
struct NodeStatus {
  std::string name;                   ///< 1 to 64 letters, digits, '_' and '-'.
  std::uint64_t session = 0;          ///< Of a robot: of its chain of odometry.
  std::uint64_t start = 0;            ///< Of a robot: how often it has started on its store; tells its programs apart.
  std::string version;                ///< Of its program.
  std::uint64_t backlog_submaps = 0;  ///< Which the server is not known to have stored.
  std::uint64_t backlog_bytes = 0;
  std::uint64_t heard_epoch = 0;  ///< Of the newest proxy graph (ProxyGraph::age()).
  std::uint64_t heard_revision = 0;
  std::optional<double> update_age_s;  ///< Since it took that up; nothing: not since its start.
  std::uint64_t keyframes = 0;
  Pose3 T_odom_body;  ///< At the newest sample.
  std::uint64_t alerts = 0;
  bool finished = false;        ///< Its recording has ended.
  std::uint64_t jobs_done = 0;  ///< Of a worker, since it started.
  std::string trouble;          ///< For people; empty: none.
  std::vector<MethodId> can;    ///< Of a worker: its finders and refiners; without settings: with any.
  friend bool operator==(const NodeStatus&, const NodeStatus&) = default;
};

/// server -> whoever looks on, every two seconds: all that it knows of the mission.
struct MissionStatus {
  struct Robot {
    RobotId robot;
    std::optional<Timestamp> last_seen;    ///< Nothing: not since the server started.
    std::optional<Timestamp> last_update;  ///< When it last took up a proxy graph.
    std::uint64_t submaps = 0;             ///< In the map, of all its sessions.
    std::uint64_t refused = 0;             ///< Submaps that the map does not take.
    std::string conflict;      ///< Why another program that calls itself the same is refused; empty: there is none.
    NodeStatus status;         ///< The last one of the session that owns name and number.
    std::uint64_t unread = 0;  ///< Submaps of versions that the server does not read: the robot keeps them.
    friend bool operator==(const Robot&, const Robot&) = default;
  };
  struct Worker {
    std::uint32_t number = 0;
    Timestamp last_seen;
    NodeStatus status;
    friend bool operator==(const Worker&, const Worker&) = default;
  };
  /// Of one kind, from one role.
  struct Refusals {
    std::string from;  ///< "robot", "worker", ...
    std::string kind;  ///< wire::name()
    std::uint64_t count = 0;
    std::string last_why;
    friend bool operator==(const Refusals&, const Refusals&) = default;
  };

  /// An operator's (ClosureWord), answered: it is stored, as long as no later one takes its place.
  struct Word {
    std::uint64_t content = 0;  ///< content_hash() of its frame.
    std::string why;            ///< It is not stored, since; empty: it is.
    friend bool operator==(const Word&, const Word&) = default;
  };

  Timestamp time;
  std::int64_t wall_ns = 0;  ///< Of the server's clock on the wall, since the Unix epoch; 0: unknown.
  std::string version;       ///< Of its program.
  std::uint64_t epoch = 0;
  std::uint32_t incarnation = 0;  ///< ProxyGraph::incarnation
  std::uint64_t revision = 0;
  std::uint64_t submaps = 0;
  std::uint64_t closures = 0;    ///< Accepted.
  std::uint64_t components = 0;  ///< Parts of the map that nothing joins yet.
  std::uint64_t pending_jobs = 0;
  bool has_news = false;           ///< The next revision is due.
  std::vector<Robot> robots;       ///< By number.
  std::vector<Worker> workers;     ///< By number.
  std::vector<Refusals> refusals;  ///< Messages.
  std::string trouble;             ///< For people; empty: none.
  std::string finder;              ///< Who is asked for closures: to_string(MethodId).
  std::uint64_t former_pairs = 0;  ///< With closures of other finders, in the map until this one has answered.
  std::uint64_t waiting = 0;       ///< Pairs and refinements that none of the workers that are there can compute,
  std::string why_waiting;         ///< and what the last one that tried said.
  std::vector<Word> words;         ///< The last ones.
  friend bool operator==(const MissionStatus&, const MissionStatus&) = default;
};

}  // namespace tutti
