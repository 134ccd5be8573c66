// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string_view>

/// Names of the tables of a robot's store (storage::robot_schema()), and of their rows.
namespace tutti::node::robot_tables {

inline constexpr const char* kCheckpoint = "checkpoint";
/// Begins the keys of what this or another program could not read: then the session, '/', the table, '/' and the key.
inline constexpr const char* kAside = "aside/";
inline constexpr const char* kJournal = "journal";
inline constexpr const char* kOutbox = "outbox";  // submaps, with their bytes
// Which submaps of the outbox the server has named: without bytes those that it has stored
inline constexpr const char* kArchive = "archive";
inline constexpr const char* kRefused = "refused";  // in a row of the archive
inline constexpr const char* kMeta = "meta";
inline constexpr const char* kRobot = "robot";      // which robot the store belongs to
inline constexpr const char* kStarts = "starts";    // number of starts on this store
inline constexpr const char* kSession = "session";  // newest session on this store
inline constexpr const char* kLost = "lost";        // why there is no checkpoint, until it is reported
// the server's incarnations in the last graph and in the last receipt
inline constexpr const char* kIncarnations = "incarnations";
inline constexpr const char* kPlace = "place";            // where it was last in a map that does not move (StoredPlace)
inline constexpr std::string_view kForeign = "foreign/";  // followed by a session that another body has, too

}  // namespace tutti::node::robot_tables
