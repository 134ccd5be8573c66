// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/consistency/explanation.hpp"
#include "tutti/consistency/robot_node.hpp"
#include "tutti/mapfile/shown_map.hpp"
#include "tutti/model/map_mark.hpp"
#include "tutti/model/status.hpp"
#include "tutti/program/page/board.hpp"

/// The contents of the page, as messages (docs/page.md): pure functions of a map and a status.
namespace tutti::page {

/// After how many seconds of mission time a robot is silent: five statuses that did not come. Statuses come by the
/// wall clock, so a mission that is played `rate` times as fast waits as much longer.
constexpr double silent_after_s(double rate) { return 10.0 * std::max(1.0, rate); }

/// The first message that the page is sent.
struct Mission {
  std::string name;
  std::string description;
  std::string mode = "live";  ///< Or "report".
  std::string version;
  std::optional<double> duration_s;
  double robot_silent_s = silent_after_s(1.0);
  template <class V>
  void describe(V& v) {
    v.field(1, "name", name, {.is_needed = true});
    v.field(2, "description", description);
    v.field(3, "mode", mode);
    v.field(4, "version", version);
    v.field(5, "duration_s", duration_s);
    v.field(6, "robot_silent_s", robot_silent_s);
  }
};
/// With the robots' colours, which are to be the same everywhere.
Message mission_message(const Mission& mission);

enum class Severity : std::uint8_t { error, warning, info };
constexpr const char* to_string(Severity severity) {
  return severity == Severity::error ? "error" : severity == Severity::warning ? "warning" : "info";
}

/// A problem, for people: what, where, since when, and what to do about it.
struct Alert {
  std::string id;  ///< The same as long as it is the same problem.
  Severity severity = Severity::info;
  std::string what;
  std::string where;
  double since_s = 0.0;  ///< Mission time.
  std::string todo;
  std::optional<RobotId> robot;
  std::optional<std::string> closure;
  template <class V>
  void describe(V& v) {
    v.field(1, "id", id);
    v.field(2, "severity", severity, {.high = 2.0, .is_needed = true});
    v.field(3, "what", what, {.is_needed = true});
    v.field(4, "where", where);
    v.field(5, "since_s", since_s);
    v.field(6, "todo", todo);
    v.field(7, "robot", robot);
    v.field(8, "closure", closure);
  }
  friend bool operator==(const Alert&, const Alert&) = default;
};

/// Follows the problems that statuses and maps show, so that each has a time since when it is there.
class Alerts {
 public:
  explicit Alerts(double silent_s = silent_after_s(1.0)) : silent_s_(silent_s) {}
  /// Errors first, the oldest of each first.
  std::vector<Alert> of_status(const MissionStatus& status);
  std::vector<Alert> of_map(const mapfile::ShownMap& map, const std::map<SubmapId, std::size_t>& holding);
  /// Problems of a value of alerts_message() are there since it says, if they still are when these are asked next.
  void resume(std::string_view alerts);

 private:
  std::vector<Alert> dated(std::vector<Alert> found, std::map<std::string, double>& since, double now_s);

  double silent_s_;
  std::map<std::string, double> status_since_, map_since_;
};
/// Both, errors first, the oldest of each first.
std::vector<Alert> joined(std::vector<Alert> alerts, const std::vector<Alert>& more);
Message alerts_message(const std::vector<Alert>& alerts, double time_s);

/// `status`, with times as seconds before it, without what radio_message() and places_message() have.
Message status_message(const MissionStatus& status);
/// `places`: what robots have found of the map that they localise in, and when each place was seen, in mission time.
Message places_message(const MissionStatus& status);

/// The messages of one map, to be put on a board with the prefixes below.
struct MapMessages {
  std::vector<Message> submaps;   ///< "submap/".
  std::vector<Message> closures;  ///< "closure/".
  Message poses;                  ///< Where all submaps are.
};
/// The value of "poses" alone. `unshown`: so many closures have no message.
std::string poses_text(const mapfile::ShownMap& map, const std::map<SubmapId, std::size_t>& holding = {},
                       const std::map<SubmapId, double>& sigma_m = {}, std::size_t unshown = 0);
/// More than the 12,000 that a map judges. Each is a message, in the page, in its past and in every browser.
inline constexpr std::size_t kMostClosures = 20'000;
/// `holding` is of closures_holding(). `sigma_m`: how sure the server is of each submap (Comparisons); empty: that is
/// not shown.
MapMessages map_messages(const mapfile::ShownMap& map, const std::map<SubmapId, std::size_t>& holding,
                         const std::map<SubmapId, double>& sigma_m = {}, std::size_t most_closures = kMostClosures);

/// Whose raw odometry is compared with the map, and when.
struct DisagreementOf {
  std::string name;
  RobotId robot;
  std::uint32_t component = 0;
  double time_s = 0.0;                    ///< Mission time of the message.
  std::vector<std::string> submaps = {};  ///< That each compared node is in, by id; may be empty.
};
/// "disagreement/NAME": by node and scale, and where it began; `time_of` makes seconds of the robot's stamps.
Message disagreement_message(const DisagreementOf& of, const consistency::Explanation& found,
                             const std::function<double(Timestamp)>& time_of);

/// A session's representative keyframes as its robot has them (RobotAgent::nodes()), by raw odometry, up to the first
/// submap that is missing.
std::vector<consistency::RobotNode> robot_nodes(const server::SubmapSet& submaps, const ChainId& chain);

/// Every session's raw odometry against the last broadcast, and how sure the server is of where each submap is: the
/// largest standard deviation of its nodes, relative to the rest of its chain. Costs what a robot's comparison does.
struct Comparisons {
  std::vector<Message> messages;
  std::map<SubmapId, double> sigma_m;
};
Comparisons compare_all(const mapfile::ShownMap& map);

/// "mark/NUMBER". `photo`: where it is, a path of the page's server or the picture itself as data:; empty: none.
Message mark_message(std::uint64_t number, const MapMark& mark, const std::string& photo, double time_s);
/// All marks of a map's store, with their photos in them, for a page that asks no server. Fails when they cannot be
/// read.
Result<std::vector<Message>> marks_with_photos(const storage::TableStore& map, double time_s);

/// A closure's relative pose of the two submap frames.
Pose3 between_submaps(const mapfile::ShownMap& map, const SubmapPair& pair, const LoopClosure& closure);
/// [x, y, z, qx, qy, qz, qw], to 0.1 mm and 1e-6; and back. Errors: not seven finite numbers, or no rotation.
std::string pose_text(const Pose3& pose);
Result<Pose3> pose_of_text(const std::string& json);
/// Gates with their values and limits, as closures have them.
std::string evidence_text(const std::vector<Refusal>& evidence);

/// The least number of accepted closures (pairs of submaps) without which a submap would no longer be joined to the
/// part of its component with the most submaps; nothing for that part itself. Odometry of one session without a gap
/// joins without closures. 1: it hangs on one closure.
std::map<SubmapId, std::size_t> closures_holding(const server::SubmapSet& submaps, const server::MapEstimate& map);

}  // namespace tutti::page
