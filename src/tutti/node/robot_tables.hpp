// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// Tables of a robot's store (storage::robot_schema()), and their rows.
namespace tutti::node::robot_tables {

inline constexpr const char* kCheckpoint = "checkpoint";
inline constexpr const char* kWhole = "agent";  // the one row that was the checkpoint once
inline constexpr const char* kJournal = "journal";
inline constexpr const char* kOutbox = "outbox";    // submaps
inline constexpr const char* kArchive = "archive";  // without bytes: which of them the server has named
inline constexpr const char* kMeta = "meta";
inline constexpr const char* kRobot = "robot";                // whose store it is
inline constexpr const char* kStarts = "starts";              // on it
inline constexpr const char* kSession = "session";            // the newest on it
inline constexpr const char* kIncarnations = "incarnations";  // of the server: of the last graph, of the last receipt

}  // namespace tutti::node::robot_tables
