// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tutti/base/fields.hpp"
#include "tutti/base/ids.hpp"
#include "tutti/base/result.hpp"
#include "tutti/base/timestamp.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/model/method_id.hpp"

/// What nodes report about their state. Every time is mission time by the sender's clock, which others do not share.
/// What is added to a list of fields here is sent, checked, shown and recorded everywhere (docs/extending.md); only
/// proto/tutti/v1/status.proto, which is for other languages, names it again.
namespace tutti {

/// What a robot's body reports of itself, through its live feed or ROS.
struct Health {
  std::optional<double> battery_v;
  std::optional<double> battery_percent;  ///< 100: full.
  template <class V>
  void describe(V& v) {
    v.field(1, "battery_v", battery_v, {.low = 0.0, .high = 10'000.0});
    v.field(2, "battery_percent", battery_percent, {.low = 0.0, .high = 100.0, .column = "battery %"});
  }
  friend bool operator==(const Health&, const Health&) = default;
};

/// How a submap of a map that does not move fits what a robot has seen of it lately, in cubes (localise::SubmapFit).
struct SubmapReturn {
  SubmapId submap;
  std::uint32_t matched = 0, missing = 0, appeared = 0;
  std::uint32_t age_s = 0;  ///< Since the robot saw any of it.
  static constexpr std::uint32_t kMostCubes = 1'000'000;
  using InColumns = void;
  template <class V>
  void describe(V& v) {
    v.field(1, "robot", submap.chain.robot);
    v.field(2, "session", submap.chain.session);
    v.field(3, "index", submap.index);
    v.field(4, "matched", matched, {.high = kMostCubes});
    v.field(5, "missing", missing, {.high = kMostCubes});
    v.field(6, "appeared", appeared, {.high = kMostCubes});
    v.field(7, "age_s", age_s);
  }
  friend bool operator==(const SubmapReturn&, const SubmapReturn&) = default;
};

/// Where a robot is in a map that does not move, as it finds itself (localise::Located).
struct InMap {
  std::string map;            ///< The map's id; empty: it does not localise.
  std::uint64_t version = 0;  ///< The map's.
  std::string state;          ///< localise::to_string() of its state.
  std::string why;            ///< What has led to it, for people.
  std::uint32_t floor = 1;    ///< The floor of the map that it is on, which has a frame of its own.
  Pose3 T_world_body;         ///< In that frame; the identity without `age_s`.
  /// Standard deviations of its position (all three directions together) and of its heading.
  std::optional<double> sigma_m, sigma_deg;
  std::optional<double> age_s;     ///< Since the map last showed that it is there; nothing: it has no place.
  std::optional<double> overlap;   ///< Share of the scan that showed it last which lay on the map.
  std::vector<SubmapReturn> fits;  ///< The map's submaps that it saw last, and some of the others in turn.
  static constexpr std::size_t kMostFits = 8;
  template <class V>
  void describe(V& v) {
    v.field(1, "map_id", map);
    v.field(2, "map_version", version);
    v.field(3, "localisation", state, {.column = "localisation"});
    v.field(4, "localisation_why", why);
    v.field(5, "T_world_body", T_world_body);
    v.field(6, "sigma_m", sigma_m, {.low = 0.0});
    v.field(7, "sigma_deg", sigma_deg, {.low = 0.0});
    v.field(8, "place_age_s", age_s, {.low = 0.0});
    v.field(9, "place_overlap", overlap, {.low = 0.0, .high = 1.0});
    v.field(10, "map_fit", fits, {.at_most = kMostFits});
    v.field(11, "floor", floor, {.low = 1.0});
  }
  friend bool operator==(const InMap&, const InMap&) = default;
};

/// From a robot or worker to the server, every two seconds: a sign of life and the state. Fields that a role does not
/// have are 0.
struct NodeStatus {
  std::string name;           ///< 1 to 64 letters, digits, '_' and '-'.
  std::uint64_t session = 0;  ///< A robot's session.
  std::uint64_t start = 0;    ///< How often a robot has started on its store; distinguishes two of its programs.
  std::string version;        ///< Version of its program.
  std::uint64_t backlog_submaps = 0;  ///< Submaps that the server is not known to have stored.
  std::uint64_t backlog_bytes = 0;
  std::uint64_t heard_epoch = 0;  ///< Epoch of the newest proxy graph that it heard.
  std::uint64_t heard_revision = 0;
  /// Time since it used that graph; nothing when it has used none since its start.
  std::optional<double> update_age_s;
  std::uint64_t keyframes = 0;
  std::optional<std::uint64_t> submaps;  ///< Number of submaps that a robot has begun in its session.
  Pose3 T_odom_body;                     ///< A robot's, at its newest sample.
  std::uint64_t alerts = 0;
  bool finished = false;        ///< Its recording has ended.
  std::uint64_t jobs_done = 0;  ///< A worker's jobs since it started.
  std::string trouble;          ///< A problem, for people; empty: none.
  std::vector<MethodId> can;    ///< A worker's verifiers and refiners; those without settings can be made with any.
  Health health;                ///< The newest that its body has reported within a minute.
  InMap in_map;
  template <class V>
  void describe(V& v) {
    v.field(1, "name", name, {.text = FieldRule::Text::name});
    v.field(2, "session", session);
    v.field(3, "start", start);
    v.field(4, "version", version);
    v.field(5, "backlog_submaps", backlog_submaps);
    v.field(6, "backlog_bytes", backlog_bytes);
    v.field(7, "heard_epoch", heard_epoch);
    v.field(8, "heard_revision", heard_revision);
    v.field(9, "update_age_s", update_age_s, {.low = 0.0});
    v.field(10, "keyframes", keyframes);
    v.field(11, "T_odom_body", T_odom_body);
    v.field(12, "alerts", alerts);
    v.field(13, "finished", finished);
    v.field(14, "jobs_done", jobs_done);
    v.field(15, "trouble", trouble);
    v.field(20, "can", can, {.at_most = 100});
    v.field(24, "submaps_begun", submaps);
    v.field(25, "health", health, {.is_flat = true});
    v.field(26, "in_map", in_map, {.is_flat = true});
  }
  friend bool operator==(const NodeStatus&, const NodeStatus&) = default;
};

/// From the server to everybody who watches, every two seconds: all that it knows of the mission.
struct MissionStatus {
  struct Robot {
    RobotId robot;
    std::optional<Timestamp> last_seen;    ///< Nothing when the robot was not heard since the server started.
    std::optional<Timestamp> last_update;  ///< When the robot last used a proxy graph.
    std::uint64_t submaps = 0;             ///< Submaps in the map, over all sessions.
    std::uint64_t refused = 0;             ///< Submaps of the robot that the map does not take.
    std::string conflict;  ///< Why another program that claims to be this robot is refused; empty when there is none.
    NodeStatus status;     ///< The latest status of the session that owns the robot's name and number.
    std::uint64_t unread = 0;  ///< Submaps in versions that the server cannot read, which the robot keeps.
    template <class V>
    void describe(V& v) {
      v.field(1, "number", robot);
      v.field(2, "last_seen", last_seen);
      v.field(3, "last_update", last_update);
      v.field(4, "submaps", submaps);
      v.field(5, "refused_submaps", refused);
      v.field(6, "conflict", conflict);
      v.field(7, "status", status, {.is_flat = true});
      v.field(8, "unread_submaps", unread);
    }
    friend bool operator==(const Robot&, const Robot&) = default;
  };
  struct Worker {
    std::uint32_t number = 0;
    Timestamp last_seen;
    NodeStatus status;
    template <class V>
    void describe(V& v) {
      v.field(1, "number", number);
      v.field(2, "last_seen", last_seen);
      v.field(3, "status", status, {.is_flat = true});
    }
    friend bool operator==(const Worker&, const Worker&) = default;
  };
  /// Refused messages of one kind from one role.
  struct Refusals {
    std::string from;  ///< "robot", "worker", ...
    std::string kind;  ///< wire::name()
    std::uint64_t count = 0;
    std::string last_why;
    template <class V>
    void describe(V& v) {
      v.field(1, "from", from);
      v.field(2, "kind", kind);
      v.field(3, "count", count);
      v.field(4, "last_why", last_why);
    }
    friend bool operator==(const Refusals&, const Refusals&) = default;
  };

  /// The server's answer to an operator's ClosureDecision: the decision is stored, unless a later one replaces it.
  struct Decision {
    std::uint64_t content = 0;  ///< content_hash() of its frame.
    std::string why;            ///< Why the decision is not stored; empty: it is.
    template <class V>
    void describe(V& v) {
      v.field(1, "content", content, {.fixed = true});
      v.field(2, "why", why);
    }
    friend bool operator==(const Decision&, const Decision&) = default;
  };

  /// What the server has exchanged with a robot since it was started, of one kind and direction: messages as the bus is
  /// given them and gives them, without what the bus adds. One that comes or goes again counts again.
  struct Radio {
    RobotId robot;
    bool is_down = false;  ///< To the robot.
    std::string kind;      ///< wire::name()
    std::uint64_t messages = 0;
    std::uint64_t bytes = 0;
    template <class V>
    void describe(V& v) {
      v.field(1, "robot", robot);
      v.field(2, "down", is_down);
      v.field(3, "kind", kind);
      v.field(4, "messages", messages);
      v.field(5, "bytes", bytes);
    }
    friend bool operator==(const Radio&, const Radio&) = default;
  };

  /// What robots that localise in a map have found of one of its submaps, together (localise::PlaceTrust).
  struct Place {
    std::string submap;  ///< to_string(SubmapId); empty: another map's than the server's.
    std::string name;    ///< For people.
    std::uint64_t matched = 0, missing = 0, appeared = 0;
    double trust = 1.0;
    std::uint64_t age_s = 0;      ///< Since a robot saw any of it.
    std::vector<RobotId> robots;  ///< Those that did, the last first; kMostSeers at most.
    static constexpr std::size_t kMostSeers = 8;
    template <class V>
    void describe(V& v) {
      v.field(1, "submap", submap);
      v.field(2, "name", name);
      v.field(3, "matched", matched);
      v.field(4, "missing", missing);
      v.field(5, "appeared", appeared);
      v.field(6, "trust", trust, {.low = 0.0, .high = 1.0});
      v.field(7, "age_s", age_s);
      v.field(8, "robots", robots, {.at_most = kMostSeers});
    }
    friend bool operator==(const Place&, const Place&) = default;
  };

  static constexpr std::size_t kMostPlaces = 500;     ///< Those that are trusted least.
  static constexpr std::size_t kMostRobots = 10'000;  ///< Likewise workers.

  Timestamp time;
  std::int64_t wall_ns = 0;  ///< The server's wall clock, since the Unix epoch; 0: unknown.
  std::string version;       ///< Version of its program.
  std::uint64_t epoch = 0;
  std::uint32_t incarnation = 0;  ///< ProxyGraph::incarnation
  std::uint64_t revision = 0;
  std::uint64_t submaps = 0;
  std::uint64_t closures = 0;    ///< Accepted ones.
  std::uint64_t components = 0;  ///< Parts of the map that nothing joins yet.
  std::uint64_t pending_jobs = 0;
  bool has_news = false;           ///< The next revision is due.
  std::vector<Robot> robots;       ///< Sorted by number.
  std::vector<Worker> workers;     ///< Sorted by number.
  std::vector<Refusals> refusals;  ///< Messages that were refused.
  std::string trouble;             ///< A problem, for people; empty: none.
  std::string verifier;            ///< to_string(MethodId) of the verifier that verifies closures.
  /// Pairs with closures of other verifiers, which stay in the map until the present verifier has answered.
  std::uint64_t former_pairs = 0;
  std::uint64_t waiting = 0;        ///< Pairs and refinements that no present worker can compute,
  std::string why_waiting;          ///< and what the last worker that tried reported.
  std::vector<Decision> decisions;  ///< The latest decisions.
  std::vector<Radio> radio;         ///< Sorted by robot, direction and kind.
  std::uint64_t retired = 0;        ///< Those of the submaps that show known ground (server/known_ground.hpp).
  std::string places_map;           ///< The id of the map that `places` are of, and its version; empty: there are none.
  std::uint64_t places_version = 0;
  std::vector<Place> places;  ///< Sorted by SubmapId.
  template <class V>
  void describe(V& v) {
    v.field(1, "time", time);
    v.field(2, "wall_ns", wall_ns);
    v.field(3, "version", version);
    v.field(4, "epoch", epoch);
    v.field(5, "revision", revision);
    v.field(6, "submaps", submaps);
    v.field(7, "closures", closures);
    v.field(8, "components", components);
    v.field(9, "pending_jobs", pending_jobs);
    v.field(10, "has_news", has_news);
    v.field(11, "robots", robots, {.at_most = kMostRobots});
    v.field(12, "workers", workers, {.at_most = kMostRobots});
    v.field(13, "refusals", refusals);
    v.field(14, "trouble", trouble);
    v.field(15, "incarnation", incarnation, {.fixed = true});
    v.field(20, "verifier", verifier);
    v.field(21, "former_pairs", former_pairs);
    v.field(22, "waiting", waiting);
    v.field(23, "why_waiting", why_waiting);
    v.field(24, "decisions", decisions);
    v.field(25, "radio", radio, {.at_most = 20 * kMostRobots});
    v.field(26, "retired", retired);
    v.field(27, "places_map_id", places_map);
    v.field(28, "places_map_version", places_version);
    v.field(29, "places", places, {.at_most = kMostPlaces});
  }
  [[nodiscard]] Status check() const;  ///< Lists have the order that is promised above.
  friend bool operator==(const MissionStatus&, const MissionStatus&) = default;
};

}  // namespace tutti
