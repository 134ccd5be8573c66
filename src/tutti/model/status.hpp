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

/// The reports of nodes about their state. Every time is mission time by the sender's clock, which others do not share.
/// A field that is added to a list here is sent, checked, shown and recorded everywhere, and status.proto and the
/// page's tables are made of it (docs/extending.md).
namespace tutti {

/// A robot's report on its own body, through its live feed or ROS.
struct Health {
  std::optional<double> battery_v;
  std::optional<double> battery_percent;
  template <class V>
  void describe(V& v) {
    v.field(1, "battery_v", battery_v, {.low = 0.0, .high = 10'000.0});
    v.field(2, "battery_percent", battery_percent, {.low = 0.0, .high = 100.0, .column = "battery %"}, "100: full.");
  }
  friend bool operator==(const Health&, const Health&) = default;
};

/// How a submap of a map that does not move fits what a robot has seen of it lately, in cubes (localise::SubmapFit).
struct SubmapReturn {
  SubmapId submap;
  std::uint32_t matched = 0, missing = 0, appeared = 0;
  std::uint32_t age_s = 0;
  static constexpr std::uint32_t kMostCubes = 1'000'000;
  using InColumns = void;
  template <class V>
  void describe(V& v) {
    v.field(1, "robot", submap.chain.robot, {}, "The submap's.");
    v.field(2, "session", submap.chain.session);
    v.field(3, "index", submap.index);
    v.field(4, "matched", matched, {.high = kMostCubes});
    v.field(5, "missing", missing, {.high = kMostCubes}, "The submap has something there, and scans looked through.");
    v.field(6, "appeared", appeared, {.high = kMostCubes}, "The other way round.");
    v.field(7, "age_s", age_s, {}, "Since the robot saw any of it.");
  }
  friend bool operator==(const SubmapReturn&, const SubmapReturn&) = default;
};

/// Where a robot is in a map that does not move, as it finds itself (localise::Located).
struct InMap {
  std::string map;
  std::uint64_t version = 0;  ///< The map's.
  std::string state;
  std::string why;
  std::uint32_t floor = 1;
  Pose3 T_world_body;
  std::optional<double> sigma_m, sigma_deg;
  std::optional<double> age_s;
  std::optional<double> overlap;
  std::vector<SubmapReturn> fits;
  static constexpr std::size_t kMostFits = 8;
  template <class V>
  void describe(V& v) {
    v.field(1, "map_id", map, {}, "Empty: it does not localise.");
    v.field(2, "map_version", version);
    v.field(3, "localisation", state, {.column = "localisation"},
            "localise::to_string() of its state: 'localised', 'searching', ..");
    v.field(4, "localisation_why", why, {}, "What has led to it, for people.");
    v.field(5, "T_world_body", T_world_body, {},
            "In the frame of its floor; the identity without place_age_s. As T_odom_body.");
    v.field(6, "sigma_m", sigma_m, {.low = 0.0}, "Standard deviation of its position, all three directions together.");
    v.field(7, "sigma_deg", sigma_deg, {.low = 0.0}, "Standard deviation of its heading.");
    v.field(8, "place_age_s", age_s, {.low = 0.0},
            "Since the map last showed that it is there; none: it has no place.");
    v.field(9, "place_overlap", overlap, {.low = 0.0, .high = 1.0},
            "Share of the scan that showed it last which lay on the map.");
    v.field(10, "map_fit", fits, {.at_most = kMostFits},
            "The submaps that it saw last, and some of the others in turn; at most 8.");
    v.field(11, "floor", floor, {.low = 1.0},
            "The floor of the map that it is on, from 1 on; each has a frame of its own.");
  }
  friend bool operator==(const InMap&, const InMap&) = default;
};

/// From a robot or worker to the server, every two seconds: a sign of life and the state. Fields that a role does not
/// have are 0.
struct NodeStatus {
  std::string name;
  std::uint64_t session = 0;  ///< A robot's session.
  std::uint64_t start = 0;
  std::string version;  ///< Version of its program.
  std::uint64_t backlog_submaps = 0;
  std::uint64_t backlog_bytes = 0;
  std::uint64_t heard_epoch = 0;
  std::uint64_t heard_revision = 0;
  std::optional<double> update_age_s;
  std::uint64_t keyframes = 0;
  std::optional<std::uint64_t> submaps;
  Pose3 T_odom_body;
  std::uint64_t alerts = 0;
  bool finished = false;
  std::uint64_t jobs_done = 0;
  std::string trouble;
  std::vector<MethodId> can;
  Health health;
  InMap in_map;
  template <class V>
  void describe(V& v) {
    v.field(1, "name", name, {.text = FieldRule::Text::name}, "1 to 64 letters, digits, '_' and '-'.");
    v.field(2, "session", session);
    v.field(3, "start", start, {}, "How often a robot has started on its store; distinguishes two of its programs.");
    v.field(4, "version", version);
    v.field(5, "backlog_submaps", backlog_submaps, {}, "That the server is not known to have stored.");
    v.field(6, "backlog_bytes", backlog_bytes);
    v.field(7, "heard_epoch", heard_epoch, {}, "The newest proxy graph's that it heard.");
    v.field(8, "heard_revision", heard_revision);
    v.field(9, "update_age_s", update_age_s, {.low = 0.0},
            "Since it used that graph; none: it has used none since its start.");
    v.field(10, "keyframes", keyframes);
    v.field(11, "T_odom_body", T_odom_body, {},
            "A robot's, at its newest sample: x y z of the translation, x y z w of the quaternion.");
    v.field(12, "alerts", alerts);
    v.field(13, "finished", finished, {}, "Its recording has ended.");
    v.field(14, "jobs_done", jobs_done, {}, "A worker's, since it started.");
    v.field(15, "trouble", trouble, {}, "A problem, for people; empty: none.");
    v.field(20, "can", can, {.at_most = 100},
            "A worker's verifiers and refiners; those without settings can be made with any.");
    v.field(24, "submaps_begun", submaps, {}, "That a robot has begun in its session.");
    v.field(25, "health", health, {.is_flat = true}, "The newest that its body has reported within a minute.");
    v.field(26, "in_map", in_map, {.is_flat = true});
  }
  friend bool operator==(const NodeStatus&, const NodeStatus&) = default;
};

/// From the server to everybody who watches, every two seconds: all that it knows of the mission.
struct MissionStatus {
  struct Robot {
    RobotId robot;
    std::optional<Timestamp> last_seen;
    std::optional<Timestamp> last_update;
    std::uint64_t submaps = 0;
    std::uint64_t refused = 0;
    std::string conflict;
    NodeStatus status;
    std::uint64_t unread = 0;
    template <class V>
    void describe(V& v) {
      v.field(1, "number", robot);
      v.field(2, "last_seen", last_seen, {}, "None: the robot was not heard since the server started.");
      v.field(3, "last_update", last_update, {}, "When the robot last used a proxy graph.");
      v.field(4, "submaps", submaps, {}, "In the map, over all sessions.");
      v.field(5, "refused_submaps", refused, {}, "That the map does not take.");
      v.field(6, "conflict", conflict, {},
              "Why another program that claims to be this robot is refused; empty: there is none.");
      v.field(7, "status", status, {.is_flat = true},
              "The latest of the session that owns the robot's name and number.");
      v.field(8, "unread_submaps", unread, {}, "In versions that the server cannot read, which the robot keeps.");
    }
    friend bool operator==(const Robot&, const Robot&) = default;
  };
  struct Worker {
    std::uint32_t number = 0;
    Timestamp last_seen;
    NodeStatus status;
    template <class V>
    void describe(V& v) {
      v.field(1, "number", number, {.is_needed = true});
      v.field(2, "last_seen", last_seen);
      v.field(3, "status", status, {.is_flat = true});
    }
    friend bool operator==(const Worker&, const Worker&) = default;
  };
  /// Refused messages of one kind from one role.
  struct Refusals {
    std::string from;
    std::string kind;
    std::uint64_t count = 0;
    std::string last_why;
    template <class V>
    void describe(V& v) {
      v.field(1, "from", from, {}, "A role: 'robot', 'worker', ..");
      v.field(2, "kind", kind, {}, "The message's, as wire::name() has it.");
      v.field(3, "count", count);
      v.field(4, "last_why", last_why);
    }
    friend bool operator==(const Refusals&, const Refusals&) = default;
  };

  /// The server's answer to an operator's ClosureDecision: the decision is stored, unless a later one replaces it.
  struct Decision {
    std::uint64_t content = 0;
    std::string why;
    template <class V>
    void describe(V& v) {
      v.field(1, "content", content, {.fixed = true}, "Hash of the bytes of its message.");
      v.field(2, "why", why, {}, "Why it is not stored; empty: it is.");
    }
    friend bool operator==(const Decision&, const Decision&) = default;
  };

  /// The messages that the server has exchanged with a robot since it was started, of one kind and direction: as the
  /// bus is given them and gives them, without what the bus adds. One that comes or goes again counts again.
  struct Radio {
    RobotId robot;
    bool is_down = false;
    std::string kind;
    std::uint64_t messages = 0;
    std::uint64_t bytes = 0;
    template <class V>
    void describe(V& v) {
      v.field(1, "robot", robot);
      v.field(2, "down", is_down, {}, "To the robot.");
      v.field(3, "kind", kind, {}, "The messages', as wire::name() has it.");
      v.field(4, "messages", messages);
      v.field(5, "bytes", bytes);
    }
    friend bool operator==(const Radio&, const Radio&) = default;
  };

  /// The findings of robots that localise in a map on one of its submaps, together (localise::PlaceTrust).
  struct Place {
    std::string submap;
    std::string name;
    std::uint64_t matched = 0, missing = 0, appeared = 0;
    double trust = 1.0;
    std::uint64_t age_s = 0;
    std::vector<RobotId> robots;
    static constexpr std::size_t kMostSeers = 8;
    template <class V>
    void describe(V& v) {
      v.field(1, "submap", submap, {}, "ROBOT:SESSION/INDEX; empty: another map's than the server's.");
      v.field(2, "name", name, {.is_needed = true}, "For people.");
      v.field(3, "matched", matched);
      v.field(4, "missing", missing);
      v.field(5, "appeared", appeared);
      v.field(6, "trust", trust, {.low = 0.0, .high = 1.0, .is_needed = true}, "The share that fits.");
      v.field(7, "age_s", age_s, {}, "Since a robot saw any of it.");
      v.field(8, "robots", robots, {.at_most = kMostSeers, .is_needed = true},
              "Those that did, the last first; at most 8.");
    }
    friend bool operator==(const Place&, const Place&) = default;
  };

  static constexpr std::size_t kMostPlaces = 500;     ///< Those that are trusted least.
  static constexpr std::size_t kMostRobots = 10'000;  ///< Likewise workers.

  Timestamp time;
  std::int64_t wall_ns = 0;
  std::string version;
  std::uint64_t epoch = 0;
  std::uint32_t incarnation = 0;  ///< ProxyGraph::incarnation
  std::uint64_t revision = 0;
  std::uint64_t submaps = 0;
  std::uint64_t closures = 0;
  std::uint64_t components = 0;
  std::uint64_t pending_jobs = 0;
  bool has_news = false;
  std::vector<Robot> robots;
  std::vector<Worker> workers;
  std::vector<Refusals> refusals;
  std::string trouble;
  std::string verifier;
  std::uint64_t former_pairs = 0;
  std::uint64_t waiting = 0;
  std::string why_waiting;
  std::vector<Decision> decisions;
  std::vector<Radio> radio;
  std::uint64_t retired = 0;
  std::string places_map;
  std::uint64_t places_version = 0;
  std::vector<Place> places;
  template <class V>
  void describe(V& v) {
    v.field(1, "time", time);
    v.field(2, "wall_ns", wall_ns, {}, "The server's wall clock, since the Unix epoch; 0: unknown.");
    v.field(3, "version", version, {}, "The server's program's.");
    v.field(4, "epoch", epoch);
    v.field(5, "revision", revision);
    v.field(6, "submaps", submaps);
    v.field(7, "closures", closures, {}, "Accepted ones.");
    v.field(8, "components", components, {}, "Parts of the map that nothing joins yet.");
    v.field(9, "pending_jobs", pending_jobs);
    v.field(10, "has_news", has_news, {}, "The next revision is due.");
    v.field(11, "robots", robots, {.at_most = kMostRobots}, "Ascending by number.");
    v.field(12, "workers", workers, {.at_most = kMostRobots}, "Ascending by number.");
    v.field(13, "refusals", refusals, {}, "Messages that were refused.");
    v.field(14, "trouble", trouble, {}, "A problem, for people; empty: none.");
    v.field(15, "incarnation", incarnation, {.fixed = true});
    v.field(20, "verifier", verifier, {}, "The verifier of closures, as to_string(MethodId) has it.");
    v.field(21, "former_pairs", former_pairs, {},
            "With closures of other verifiers, which stay in the map until the present verifier has answered.");
    v.field(22, "waiting", waiting, {}, "Pairs and refinements that no present worker can compute.");
    v.field(23, "why_waiting", why_waiting, {}, "What the last worker that tried them reported.");
    v.field(24, "decisions", decisions, {}, "The answers to the latest.");
    v.field(25, "radio", radio, {.at_most = 20 * kMostRobots}, "Ascending by robot, direction and kind.");
    v.field(26, "retired", retired, {}, "Those of the submaps that show known ground.");
    v.field(27, "places_map_id", places_map, {}, "The map that places are of; empty: there are none.");
    v.field(28, "places_map_version", places_version);
    v.field(29, "places", places, {.at_most = kMostPlaces}, "Ascending by submap; at most 500.");
  }
  [[nodiscard]] Status check() const;  ///< Lists have the order that is promised above.
  friend bool operator==(const MissionStatus&, const MissionStatus&) = default;
};

}  // namespace tutti
