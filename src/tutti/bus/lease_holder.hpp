// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace tutti::bus {

/// The server that serves a mission.
struct LeaseHolder {
  std::string host;
  std::uint64_t process = 0;
  std::string state;          ///< Its state folder.
  std::int64_t since_ns = 0;  ///< Wall time since the Unix epoch.
  /// Names state folder and boot of the machine. Two containers of one machine may have copies of one folder, and with
  /// these one seat.
  std::string seat;
  /// Names this start of the process, and nothing else ever (process_mark()). Empty: of a server of an earlier version.
  std::string mark;
  friend bool operator==(const LeaseHolder&, const LeaseHolder&) = default;
};
/// "process 17 on base, state /var/lib/tutti-server, since 2026-01-31 12:00:00 UTC".
std::string to_string(const LeaseHolder& holder);

/// A lease's value on the bus: a line for each field, as plain_text().
std::string lease_text(const LeaseHolder& holder);
/// The holder that a value on the bus names; nothing when the value is no lease. Anybody may have written it.
std::optional<LeaseHolder> lease_of(std::string_view text);

/// A mark for this process: its space of process numbers, when it started, and `random`.
std::string process_mark(std::uint64_t random);
/// True when it is certain that the holder has ended: it ran on this boot of this machine, in this process's space of
/// process numbers, and its number is free or another process's. `own` is this process's.
bool has_ended(const LeaseHolder& holder, const LeaseHolder& own);

}  // namespace tutti::bus
