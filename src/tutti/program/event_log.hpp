// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>

#include "tutti/base/result.hpp"
#include "tutti/node/event.hpp"
#include "tutti/program/throttle.hpp"

namespace spdlog {
class logger;
}

namespace tutti::program {

using Json = nlohmann::ordered_json;

enum class Level { debug, info, warning, error };
/// "debug", "info", "warning", "error".
Result<Level> level_of(const std::string& word);

Json to_json(const consistency::SuspectedOrigin& origin);
/// "time_s", "event" (what happened, one word), then what it says.
Json to_json(const node::Event& event);

/// What a program tells: events for other programs in FOLDER/events.jsonl, one JSON object a line, and sentences for
/// people in FOLDER/log.txt and, from a level on, on stderr. Both files begin anew when they are full: one older one of
/// each is kept. Any thread may call at any time. What cannot be written, as on a full disk, is lost; the program goes
/// on. What others can cause (refusals, and who says that he is here) is throttled, and the same sentence is said once
/// in kSame_s.
class EventLog {
 public:
  static constexpr std::uintmax_t kMaxEventBytes = std::uintmax_t{64} << 20U;
  static constexpr std::size_t kMaxLogBytes = std::size_t{10} << 20U;
  static constexpr double kSame_s = 60.0;

  /// `name` stands in front of what people read. Goes on where an earlier program of this folder stopped.
  static Result<std::unique_ptr<EventLog>> open(const std::filesystem::path& folder, const std::string& name,
                                                Level console);
  /// Only what people read on stderr: for a program without a folder.
  static std::unique_ptr<EventLog> on_console(const std::string& name, Level console);
  ~EventLog();

  void write(const node::Event& event);
  void write(const Json& line);
  void say(Level level, const std::string& sentence);
  /// How it stands, in one line, rewritten in place; nothing where stderr is no terminal.
  void show(const std::string& line);

 private:
  EventLog() = default;
  void append(const std::string& line);
  void people(Level level, const std::string& sentence);

  std::mutex mutex_;
  std::filesystem::path file_;
  std::ofstream events_;
  std::uintmax_t bytes_ = 0;
  std::shared_ptr<spdlog::logger> people_;
  Throttle throttle_;
  std::string last_said_;
  double last_said_s_ = 0.0;
  std::string shown_;
  Level console_ = Level::warning;
};

/// The lines of an events.jsonl and of the older one beside it, in their order; a line that a kill has torn is left
/// out. An error: it cannot be read.
Status read_events(const std::filesystem::path& folder, const std::function<void(const Json&)>& take);

}  // namespace tutti::program
