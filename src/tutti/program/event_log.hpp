// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "tutti/base/result.hpp"
#include "tutti/node/event.hpp"
#include "tutti/program/rotated_file.hpp"
#include "tutti/program/throttle.hpp"

namespace spdlog {
class logger;
}

namespace tutti::program {

using Json = nlohmann::ordered_json;

enum class Level { debug, info, warning, error };
/// The level called "debug", "info", "warning" or "error"; fails with any other name.
Result<Level> level_of(const std::string& word);

/// The event as JSON: "time_s", then "event" (what happened, in one word), then its fields.
Json to_json(const node::Event& event);

/// Writes what a program reports: events for other programs in FOLDER/events.jsonl, one JSON object per line; sentences
/// for people in FOLDER/log.txt and, from `console` on, on stderr. Both files are begun anew when they are full, and
/// one older file of each is kept; a later file of events has in its first line how many were before it. May be called
/// from any thread.
///
/// Lines that cannot be written, for example because the disk is full, are lost, and the program goes on. Events that
/// others can cause at will (refusals, statuses) are throttled, and a sentence is repeated only after kSame_s.
class EventLog {
 public:
  static constexpr std::uintmax_t kMaxEventBytes = std::uintmax_t{64} << 20U;
  static constexpr std::size_t kMaxLogBytes = std::size_t{10} << 20U;
  static constexpr double kSame_s = 60.0;

  /// Continues the files of `folder`; `name` precedes sentences for people. Fails when the files cannot be opened.
  static Result<std::unique_ptr<EventLog>> open(const std::filesystem::path& folder, const std::string& name,
                                                Level console, std::uintmax_t max_event_bytes = kMaxEventBytes);
  /// Only writes sentences to stderr, for a program without a folder.
  static std::unique_ptr<EventLog> on_console(const std::string& name, Level console);
  ~EventLog();

  void write(const node::Event& event);
  void write(const Json& line);
  void say(Level level, const std::string& sentence);
  /// Shows the program's state in one line, which the next call overwrites; does nothing when stderr is no terminal.
  void show(const std::string& line);

 private:
  EventLog() = default;
  void append(const std::string& line);
  void people(Level level, const std::string& sentence);

  std::mutex mutex_;
  std::optional<RotatedFile> events_;
  std::uint64_t files_before_ = 0;  // of events
  std::shared_ptr<spdlog::logger> people_;
  Throttle throttle_;
  std::string last_said_;
  double last_said_s_ = 0.0;
  std::string shown_;
  Level console_ = Level::warning;
};

/// Reads the lines of events.jsonl, after those of the older file. A line that a kill has torn is skipped. Returns how
/// many files there were before these, which are gone. Fails when a file cannot be read.
Result<std::uint64_t> read_events(const std::filesystem::path& folder, const std::function<void(const Json&)>& take);

}  // namespace tutti::program
