// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/bus_rights.hpp"

#include <fmt/format.h>

#include <array>
#include <set>

namespace tutti::bus {
namespace {

constexpr BusRight publishes(BusRole role, const char* subject, const char* purpose) {
  return {role, BusRight::To::publish, subject, purpose};
}
constexpr BusRight listens(BusRole role, const char* subject, const char* purpose) {
  return {role, BusRight::To::subscribe, subject, purpose};
}

constexpr BusRole kRobotUser = BusRole::robot, kWorkerUser = BusRole::worker, kViewerUser = BusRole::views,
                  kOperatorUser = BusRole::operates, kServerUser = BusRole::server;

constexpr const char* kAskLease = "$JS.API.DIRECT.GET.KV_TUTTI_SERVERS.$KV.TUTTI_SERVERS.{mission}";
constexpr const char* kAskStatus = "$JS.API.DIRECT.GET.KV_GRAPH_{mission}.$KV.GRAPH_{mission}.viewer.0.mission_status";
constexpr const char* kAskMap = "$JS.API.DIRECT.GET.MAPS_{mission}.mission.{mission}.map.*.*";
constexpr const char* kOwnInbox = "answers to what it asks";
constexpr const char* kLease = "whether the mission has a server";
constexpr const char* kStreams = "makes and watches the mission's streams";
constexpr const char* kConsumers = "takes what robots, workers and operators send";

/// Docs/security.md has the same table (bus_rights_test).
constexpr std::array kRights{
    publishes(kRobotUser, "mission.{mission}.robot.{number}.submap", "its own submaps"),
    publishes(kRobotUser, "mission.{mission}.robot.{number}.status", "its own status"),
    publishes(kRobotUser, "$JS.API.DIRECT.GET.KV_GRAPH_{mission}.$KV.GRAPH_{mission}.robot.{number}.*",
              "asks for its last graph and receipt"),
    publishes(kRobotUser, kAskLease, kLease),
    publishes(kRobotUser, kAskMap, "asks for the map that is published"),
    listens(kRobotUser, "$KV.GRAPH_{mission}.robot.{number}.*", "its own graphs and receipts"),
    listens(kRobotUser, "_INBOX.robot.{number}.>", kOwnInbox),

    publishes(kWorkerUser, "$JS.API.CONSUMER.MSG.NEXT.JOBS_{mission}.workers", "asks for a job"),
    publishes(kWorkerUser, "mission.{mission}.worker.{number}.settle",
              "says that a job of its own is done, or goes on"),
    publishes(kWorkerUser, "mission.{mission}.worker.{number}.status", "its own status"),
    publishes(kWorkerUser, "mission.{mission}.worker.{number}.verdicts", "its answers"),
    publishes(kWorkerUser, "mission.{mission}.worker.{number}.refinement", "its refinements of the map"),
    publishes(kWorkerUser, "mission.{mission}.worker.{number}.submap_request",
              "asks for submaps, and gets those of jobs that are out"),
    publishes(kWorkerUser, kAskLease, kLease),
    listens(kWorkerUser, "mission.{mission}.worker.{number}.submap_copy", "the submaps that it asked for"),
    listens(kWorkerUser, "_INBOX.worker.{number}.>", kOwnInbox),

    publishes(kViewerUser, kAskStatus, "asks for the mission's last status"),
    publishes(kViewerUser, kAskLease, kLease),
    listens(kViewerUser, "$KV.GRAPH_{mission}.viewer.0.*", "the mission's status"),
    listens(kViewerUser, "_INBOX.viewer.{number}.>", kOwnInbox),

    publishes(kOperatorUser, "mission.{mission}.operator.{name}.decision",
              "decisions, under the name that the key proves"),
    publishes(kOperatorUser, kAskStatus, "asks for the mission's last status"),
    publishes(kOperatorUser, kAskLease, kLease),
    publishes(kOperatorUser, kAskMap, "asks for the map that is published"),
    publishes(kOperatorUser, "mission.{mission}.map.*.*", "publishes a map, under its signature"),
    listens(kOperatorUser, "$KV.GRAPH_{mission}.viewer.0.*", "the mission's status"),
    listens(kOperatorUser, "_INBOX.operator.{number}.>", kOwnInbox),

    publishes(kServerUser, "$JS.API.INFO", "whether the bus is ready"),
    publishes(kServerUser, "$JS.API.STREAM.*.SUBMAPS_{mission}", kStreams),
    publishes(kServerUser, "$JS.API.STREAM.*.VERDICTS_{mission}", kStreams),
    publishes(kServerUser, "$JS.API.STREAM.*.JOBS_{mission}", kStreams),
    publishes(kServerUser, "$JS.API.STREAM.*.MAPS_{mission}", kStreams),
    publishes(kServerUser, "$JS.API.STREAM.MSG.*.JOBS_{mission}", "removes jobs that are not its own"),
    publishes(kServerUser, "$JS.API.STREAM.*.KV_GRAPH_{mission}", kStreams),
    publishes(kServerUser, "$JS.API.STREAM.*.KV_TUTTI_SERVERS", kStreams),
    publishes(kServerUser, "$JS.API.CONSUMER.*.SUBMAPS_{mission}.server", kConsumers),
    publishes(kServerUser, "$JS.API.CONSUMER.*.*.SUBMAPS_{mission}.server", kConsumers),
    publishes(kServerUser, "$JS.API.CONSUMER.*.VERDICTS_{mission}.server", kConsumers),
    publishes(kServerUser, "$JS.API.CONSUMER.*.*.VERDICTS_{mission}.server", kConsumers),
    publishes(kServerUser, "$JS.API.CONSUMER.*.JOBS_{mission}.workers", "makes what workers take jobs from"),
    publishes(kServerUser, "$JS.API.CONSUMER.*.*.JOBS_{mission}.workers", "the same, and jobs for its own worker"),
    publishes(kServerUser, "$JS.ACK.SUBMAPS_{mission}.server.>", "says what is stored"),
    publishes(kServerUser, "$JS.ACK.VERDICTS_{mission}.server.>", "says what is stored"),
    publishes(kServerUser, "$JS.ACK.JOBS_{mission}.workers.>", "passes on what workers say of their own jobs"),
    publishes(kServerUser, "$KV.GRAPH_{mission}.>", "graphs, receipts and the mission's status"),
    publishes(kServerUser, "$KV.TUTTI_SERVERS.{mission}", "the lease of the mission"),
    publishes(kServerUser, kAskLease, "the lease of the mission"),
    publishes(kServerUser, "mission.{mission}.jobs.loop", "jobs"),
    publishes(kServerUser, "mission.{mission}.worker.*.submap_copy", "the submaps that workers ask for"),
    publishes(kServerUser, "mission.{mission}.worker.0.*", "its own worker"),
    listens(kServerUser, "mission.{mission}.*.*.status", "statuses of robots and workers"),
    listens(kServerUser, "mission.{mission}.worker.*.submap_request", "what workers ask for"),
    listens(kServerUser, "mission.{mission}.worker.*.settle", "what workers say of their jobs"),
    listens(kServerUser, "mission.{mission}.worker.0.submap_copy", "its own worker"),
    listens(kServerUser, "_INBOX.server.{number}.>", kOwnInbox),
};

std::string quoted(const std::vector<std::string>& subjects) {
  std::string out;
  for (const std::string& subject : subjects) out += fmt::format("{}\"{}\"", out.empty() ? "" : ", ", subject);
  return out;
}

std::string subject_of(const BusRight& right, const std::string& mission, const std::string& number,
                       const std::string& name) {
  return fmt::format(fmt::runtime(right.subject), fmt::arg("mission", mission), fmt::arg("number", number),
                     fmt::arg("name", name));
}

std::string user_block(const KeyedUser& one) {
  return fmt::format(
      "      # {}\n      {{ nkey: {}, permissions: {{\n        publish: {{ allow: [{}] }}\n        subscribe: {{ "
      "allow: "
      "[{}] }}{} }} }}\n",
      to_string(one.user), one.key, quoted(subjects_of(one.user, BusRight::To::publish)),
      quoted(subjects_of(one.user, BusRight::To::subscribe)),
      one.user.role == BusRole::server ? ", allow_responses: true" : "");
}

/// The subjects that pass between the accounts: all that members publish and subscribe to, but their inboxes.
struct Passages {
  std::string exports, imports;
};
Passages passages_of(const std::string& mission) {
  Passages out;
  std::set<std::string> seen;
  for (const BusRight& right : kRights) {
    const std::string subject = subject_of(right, mission, "*", "*");
    if (right.role == BusRole::server || subject.starts_with("_INBOX.") || !seen.insert(subject).second) continue;
    const char* const kind = right.to == BusRight::To::publish ? "service" : "stream";
    const bool is_answered_often = subject.starts_with("$JS.API.CONSUMER.MSG.NEXT.");
    out.exports += fmt::format("      {{ {}: \"{}\", accounts: [MEMBERS]{} }}\n", kind, subject,
                               is_answered_often ? ", response_type: stream" : "");
    out.imports += fmt::format("      {{ {}: {{ account: SERVER, subject: \"{}\" }} }}\n", kind, subject);
  }
  return out;
}

}  // namespace

std::span<const BusRight> bus_rights() { return kRights; }

std::vector<std::string> subjects_of(const BusUser& user, BusRight::To to) {
  std::vector<std::string> out;
  for (const BusRight& right : kRights)
    if (right.role == user.role && right.to == to)
      out.push_back(subject_of(right, user.mission, std::to_string(user.number), user.name));
  return out;
}

std::string authorization(const std::string& mission, const std::vector<KeyedUser>& users) {
  std::string servers, members;
  for (const KeyedUser& one : users) (one.user.role == BusRole::server ? servers : members) += user_block(one);
  const Passages between = passages_of(mission);
  return fmt::format(
      "authorization {{ timeout: 2 }}\naccounts {{\n"
      "  SERVER {{\n    jetstream: enabled\n    users: [\n{}    ]\n    exports: [\n{}    ]\n  }}\n"
      "  MEMBERS {{\n    users: [\n{}    ]\n    imports: [\n{}    ]\n  }}\n}}\n",
      servers, between.exports, members, between.imports);
}

}  // namespace tutti::bus
