// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/event_log.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/logger.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <fstream>
#include <numbers>
#include <utility>
#include <vector>

#include "tutti/program/field_json.hpp"
#include "tutti/wire/message_kind.hpp"

namespace tutti::program {
namespace {

namespace fs = std::filesystem;

constexpr const char* kEvents = "events.jsonl";
constexpr const char* kContinues = "log_continues";  // the first event of a file that is not the first one
constexpr std::array<std::pair<const char*, spdlog::level::level_enum>, 4> kLevels{{{"debug", spdlog::level::debug},
                                                                                    {"info", spdlog::level::info},
                                                                                    {"warning", spdlog::level::warn},
                                                                                    {"error", spdlog::level::err}}};

/// Lines for people, in a file of the program's own.
class LogFile final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  explicit LogFile(RotatedFile file) : file_(std::move(file)) {}

 private:
  void sink_it_(const spdlog::details::log_msg& message) override {
    spdlog::memory_buf_t line;
    formatter_->format(message, line);
    file_.append({line.data(), line.size()});
  }
  void flush_() override {}
  RotatedFile file_;
};

/// How many files of events were before the one with this first line.
std::uint64_t files_before(const Json& first) {
  const bool continues = first.is_object() && first.contains("event") && first["event"] == kContinues &&
                         first.contains("before") && first["before"].is_number_unsigned();
  return continues ? first["before"].get<std::uint64_t>() : 0;
}

/// The same of a file, or nothing if there is none.
std::optional<std::uint64_t> files_before(const fs::path& file) {
  std::ifstream in(file);
  if (!in) return std::nullopt;
  std::string line;
  std::getline(in, line);
  return files_before(Json::parse(line, nullptr, false));
}

spdlog::level::level_enum of_spdlog(Level level) { return kLevels.at(static_cast<std::size_t>(level)).second; }

/// An event as reported to programs and to people, and how much it matters to these.
struct EventReport {
  Json json;
  std::string sentence;
  Level level = Level::info;
};

std::string name_of(const bus::Endpoint& end) {
  if (end.role == bus::Endpoint::Role::server) return "server";
  if (end.role == bus::Endpoint::Role::viewer) return "a viewer";
  return fmt::format("{} {}", name(end.role), end.number);
}

EventReport report_of(const node::SubmapStored& stored) {
  return {{{"event", "submap_stored"}, {"submap", to_string(stored.id)}},
          fmt::format("submap {} stored", to_string(stored.id)),
          Level::debug};
}
EventReport report_of(const node::VerdictsTaken& taken) {
  return {{{"event", "verdicts_taken"}, {"job", taken.job}, {"pairs", taken.pairs}},
          fmt::format("job {}: {} pairs verified", taken.job, taken.pairs),
          Level::debug};
}
EventReport report_of(const node::DecisionTaken& taken) {
  return {{{"event", "decision_taken"},
           {"first", to_string(taken.pair.first)},
           {"second", to_string(taken.pair.second)},
           {"wish", to_string(taken.wish)}},
          fmt::format("an operator's decision on the closures between submaps {} and {}: {}",
                      to_string(taken.pair.first), to_string(taken.pair.second), to_string(taken.wish))};
}
EventReport report_of(const node::VerificationFailed& failed) {
  const std::string pair = to_string(failed.pair.first) + " and " + to_string(failed.pair.second);
  return {{{"event", "verification_failed"},
           {"first", to_string(failed.pair.first)},
           {"second", to_string(failed.pair.second)},
           {"why", failed.why},
           {"given_up", failed.given_up}},
          fmt::format("submaps {} could not be verified, and {}: {}", pair,
                      failed.given_up ? "are given up" : "will be asked again", failed.why),
          Level::warning};
}
EventReport report_of(const node::RefinementTaken& taken) {
  std::string remarks;
  for (const RefinementRemark& remark : taken.remarks)
    remarks += fmt::format("; robot {}: {}", remark.robot.value, remark.text);
  return {{{"event", "refinement_taken"},
           {"job", taken.job},
           {"revision", taken.revision},
           {"whole", taken.whole},
           {"steps", taken.steps},
           {"remarks", remarks.empty() ? remarks : remarks.substr(2)}},
          fmt::format("{} of map revision {} was refined: {} steps{}", taken.whole ? "all" : "a part", taken.revision,
                      taken.steps, remarks)};
}
EventReport report_of(const node::RefinementFailed& failed) {
  return {{{"event", "refinement_failed"},
           {"revision", failed.revision},
           {"why", failed.why},
           {"given_up", failed.given_up}},
          fmt::format("map revision {} could not be refined, which {}: {}", failed.revision,
                      failed.given_up ? "is given up" : "will be tried again", failed.why),
          Level::warning};
}
EventReport report_of(const node::MapUpdated& map) {
  return {{{"event", "map_updated"},
           {"revision", map.revision},
           {"submaps", map.submaps},
           {"accepted", map.accepted},
           {"cost", map.cost},
           {"degrees_of_freedom", map.degrees_of_freedom},
           {"from_measurements", map.from_measurements}},
          fmt::format("map revision {}: {} submaps, {} closures", map.revision, map.submaps, map.accepted)};
}
EventReport report_of(const node::ChangeOfMind& report) {
  const consistency::MapChange& change = report.change;
  const std::string reason = server::to_string(report.reason);
  Json json{{"event", "change_of_mind"}, {"robot", report.robot.value}, {"reason", reason}};
  json.update(json_of_fields(change));
  return {std::move(json),
          fmt::format("the map changed its mind about robot {} by {:.2f} m and {:.1f} degrees, {:.1f} times what it "
                      "allowed for: {}",
                      report.robot.value, change.translation_m, change.rotation_rad * 180.0 / std::numbers::pi,
                      change.significance, reason),
          Level::warning};
}
EventReport report_of(const node::RobotUpdated& robot) {
  const robot::UpdateSummary& update = robot.summary;
  Json origins = Json::array();
  for (const consistency::SuspectedOrigin& origin : update.explanation.origins)
    origins.push_back(json_of_fields(origin));
  return {{{"event", "robot_updated"},
           {"origins", std::move(origins)},
           {"robot", robot.robot.value},
           {"revision", update.revision},
           {"synchronised", update.synchronised},
           {"constraints", update.constraints},
           {"optimised", to_string(update.optimised)},
           {"taken_back", update.taken_back}},
          fmt::format("heard map revision {}: {} nodes compared, {} constraints held", update.revision,
                      update.synchronised, update.constraints)};
}
EventReport report_of(const node::MessageRefused& refused) {
  return {{{"event", "message_refused"},
           {"from", name_of(refused.from)},
           {"kind", wire::name(refused.kind)},
           {"why", refused.why}},
          fmt::format("a {} from {} was refused: {}", wire::name(refused.kind), name_of(refused.from), refused.why),
          Level::warning};
}
EventReport report_of(const node::RobotJoined& joined) {
  return {
      {{"event", "robot_joined"}, {"robot", joined.robot.value}, {"name", joined.name}, {"session", joined.session}},
      fmt::format("robot {} ({}) is here, session {}", joined.robot.value, joined.name, joined.session)};
}
EventReport report_of(const node::RobotRefused& refused) {
  return {
      {{"event", "robot_refused"}, {"robot", refused.robot.value}, {"session", refused.session}, {"why", refused.why}},
      fmt::format("robot {}, session {}, is refused: {}", refused.robot.value, refused.session, refused.why),
      Level::warning};
}
EventReport report_of(const node::StateLost& lost) {
  return {{{"event", "state_lost"}, {"robot", lost.robot.value}, {"session", lost.session}, {"why", lost.why}},
          fmt::format("what was stored of this robot cannot be read; it is set aside, and session {} is begun; submaps "
                      "that wait are kept: {}",
                      lost.session, lost.why),
          Level::warning};
}
EventReport report_of(const node::SessionBegun& begun) {
  return {{{"event", "session_begun"}, {"robot", begun.robot.value}, {"session", begun.session}, {"why", begun.why}},
          fmt::format("robot {} begins session {}, submaps that wait are kept: {}", begun.robot.value, begun.session,
                      begun.why),
          Level::warning};
}
EventReport report_of(const node::SubmapsForgotten& forgotten) {
  return {{{"event", "submaps_forgotten"}, {"robot", forgotten.robot.value}, {"submaps", forgotten.submaps}},
          fmt::format("the server's map is another than before and lacks {} submaps that it had: they are sent again",
                      forgotten.submaps),
          Level::warning};
}
EventReport report_of(const node::SampleRefused& refused) {
  return {{{"event", "sample_refused"}, {"robot", refused.robot.value}, {"why", refused.why}},
          "a sample was refused: " + refused.why,
          Level::warning};
}
EventReport report_of(const node::OdometryJumped& jumped) {
  const robot::OdometryJump& jump = jumped.jump;
  return {{{"event", "odometry_jumped"},
           {"robot", jumped.robot.value},
           {"stamp_ns", jump.to.ns},
           {"within_s", jump.to - jump.from},
           {"translation_m", jump.translation_m},
           {"rotation_rad", jump.rotation_rad}},
          fmt::format("robot {}: {}: no body moves so; it is taken to have stayed, and only the map tells where it is",
                      jumped.robot.value, to_string(jump)),
          Level::warning};
}
EventReport report_of(const node::MisfitFound& found) {
  Json json = json_of_fields(found.misfit);
  json.update({{"event", "misfit_found"}, {"robot", found.robot.value}});
  return {std::move(json),
          fmt::format("robot {}: {}: {}", found.robot.value, to_string(found.misfit), way_on(found.misfit)),
          Level::warning};
}
EventReport report_of(const node::ScanRefused& refused) {
  return {{{"event", "scan_refused"}, {"robot", refused.robot.value}, {"why", refused.why}},
          "a scan was refused: " + refused.why,
          Level::warning};
}
EventReport report_of(const node::SensorMissing& missing) {
  return {{{"event", "sensor_missing"},
           {"robot", missing.robot.value},
           {"sensor", missing.sensor},
           {"keyframes", missing.keyframes}},
          missing.keyframes > 0
              ? fmt::format("robot {}: {} keyframes without {}: no closures are found there", missing.robot.value,
                            missing.keyframes, missing.sensor == "scan" ? "a scan" : missing.sensor)
              : fmt::format("robot {}: keyframes have {} again", missing.robot.value,
                            missing.sensor == "scan" ? "scans" : missing.sensor),
          missing.keyframes > 0 ? Level::warning : Level::info};
}
EventReport report_of(const node::RobotLocated& heard) {
  const localise::Located& located = heard.located;
  const bool is_known = located.state == localise::State::localised;
  Json json{{"event", "robot_located"},
            {"robot", heard.robot.value},
            {"state", to_string(located.state)},
            {"why", located.why},
            {"places", heard.places}};
  return {std::move(json),
          fmt::format("robot {} is {} in its map: {}{}{}", heard.robot.value, to_string(located.state), located.why,
                      heard.places.empty() ? "" : ": ", fmt::join(heard.places, ", ")),
          is_known || located.state == localise::State::searching ? Level::info : Level::warning};
}
EventReport report_of(const node::FixRefused& refused) {
  return {{{"event", "fix_refused"}, {"robot", refused.robot.value}, {"why", refused.why}},
          "a fix was refused: " + refused.why,
          Level::warning};
}
EventReport report_of(const node::ImagesRefused& refused) {
  return {{{"event", "images_refused"}, {"robot", refused.robot.value}, {"why", refused.why}},
          "images were refused: " + refused.why,
          Level::warning};
}

EventReport report_of_event(const node::Event& event) {
  EventReport report = std::visit([](const auto& what) { return report_of(what); }, event.what);
  Json json{{"time_s", static_cast<double>(event.time.ns) * 1e-9}};
  json.update(report.json);
  report.json = std::move(json);
  return report;
}

/// The kind of an event that others can cause as often as they like; empty: another event. Who it was is not in it:
/// they can forge that, too.
std::string throttled_kind(const node::Event& event) {
  if (const auto* refused = std::get_if<node::MessageRefused>(&event.what))
    return fmt::format("message {} {}", name(refused->from.role), wire::name(refused->kind));
  if (std::holds_alternative<node::RobotRefused>(event.what)) return "robot refused";
  if (std::holds_alternative<node::RobotJoined>(event.what)) return "robot joined";
  if (std::holds_alternative<node::SampleRefused>(event.what)) return "sample";
  if (std::holds_alternative<node::OdometryJumped>(event.what)) return "jump";
  if (std::holds_alternative<node::MisfitFound>(event.what)) return "misfit";
  if (std::holds_alternative<node::SessionBegun>(event.what)) return "session";
  if (std::holds_alternative<node::ScanRefused>(event.what)) return "scan";
  if (std::holds_alternative<node::ImagesRefused>(event.what)) return "images";
  if (std::holds_alternative<node::FixRefused>(event.what)) return "fix";
  if (std::holds_alternative<node::RobotLocated>(event.what)) return "place";
  return {};
}

double steady_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

}  // namespace

Result<Level> level_of(const std::string& name) {
  for (std::size_t i = 0; i < kLevels.size(); ++i)
    if (name == kLevels.at(i).first) return static_cast<Level>(i);
  return fail(ErrorCode::configuration, "log level '{}', expected debug, info, warning or error", name);
}

Json to_json(const node::Event& event) { return report_of_event(event).json; }

std::unique_ptr<EventLog> EventLog::on_console(const std::string& name, Level console) {
  std::unique_ptr<EventLog> log(new EventLog());
  const auto sink = std::make_shared<spdlog::sinks::stderr_sink_mt>();
  sink->set_level(of_spdlog(console));
  sink->set_pattern("%n: %l: %v");
  log->people_ = std::make_shared<spdlog::logger>(name, sink);
  log->people_->set_level(spdlog::level::debug);
  log->console_ = console;
  return log;
}

Result<std::unique_ptr<EventLog>> EventLog::open(const fs::path& folder, const std::string& name, Level console,
                                                 std::uintmax_t max_event_bytes) {
  auto log = on_console(name, console);
  auto text = RotatedFile::open(folder / "log.txt", kMaxLogBytes);
  if (!text) return tl::unexpected(text.error());
  const auto sink = std::make_shared<LogFile>(std::move(*text));
  sink->set_level(spdlog::level::info);
  sink->set_pattern("%Y-%m-%d %H:%M:%S.%e %l %v");
  log->people_->sinks().push_back(sink);
  log->people_->set_error_handler([](const std::string& /*of stderr*/) {});
  const fs::path file = folder / kEvents;
  const auto before = files_before(file), older = files_before(RotatedFile::older_of(file));
  log->files_before_ = before ? *before : older ? *older + 1 : 0;
  const auto heading = [log = log.get()] {
    return Json{{"event", kContinues}, {"before", ++log->files_before_}}.dump() + "\n";
  };
  auto events = RotatedFile::open(file, max_event_bytes, heading);
  if (!events) return tl::unexpected(events.error());
  log->events_.emplace(std::move(*events));
  // Killed between the renaming of a full file and the first line of the next.
  if (!before && older) log->append(Json{{"event", kContinues}, {"before", log->files_before_}}.dump());
  return log;
}

EventLog::~EventLog() { show(""); }

void EventLog::append(const std::string& line) {
  if (events_) events_->append(line + '\n');
}

void EventLog::write(const node::Event& event) {
  EventReport report = report_of_event(event);
  if (const std::string kind = throttled_kind(event); !kind.empty()) {
    const std::scoped_lock guard(mutex_);
    const Throttle::Verdict verdict = throttle_.ask(kind, steady_s());
    if (!verdict.passes) return;
    if (verdict.left_out > 0) report.json["left_out"] = verdict.left_out;
    if (verdict.left_out > 0) report.sentence += fmt::format(" (and {} more of the kind before)", verdict.left_out);
  }
  write(report.json);
  const std::scoped_lock guard(mutex_);
  people(report.level, report.sentence);
}

void EventLog::write(const Json& line) {
  const std::scoped_lock guard(mutex_);
  append(text_of(line));
}

void EventLog::say(Level level, const std::string& sentence) {
  const std::scoped_lock guard(mutex_);
  const double now_s = steady_s();
  if (sentence == last_said_ && now_s < last_said_s_ + kSame_s) return;
  last_said_ = sentence;
  last_said_s_ = now_s;
  people(level, sentence);
}

void EventLog::people(Level level, const std::string& sentence) {
  const bool over_line = !shown_.empty() && level >= console_;
  if (over_line) static_cast<void>(!::write(STDERR_FILENO, "\r\033[K", 4));
  people_->log(of_spdlog(level), sentence);
  if (over_line) static_cast<void>(!::write(STDERR_FILENO, shown_.data(), shown_.size()));
}

void EventLog::show(const std::string& line) {
  const std::scoped_lock guard(mutex_);
  if (line == shown_ || isatty(STDERR_FILENO) == 0) return;
  const std::string all = line.empty() ? "\n" : "\r\033[K" + line;
  shown_ = line;
  static_cast<void>(!::write(STDERR_FILENO, all.data(), all.size()));
}

Result<std::uint64_t> read_events(const fs::path& folder, const std::function<void(const Json&)>& take) {
  const fs::path file = folder / kEvents;
  std::optional<std::uint64_t> gone;
  for (const fs::path& one : {RotatedFile::older_of(file), file}) {
    std::ifstream in(one);
    if (!in && one == file) return fail(ErrorCode::io, "{}: cannot be read", one.string());
    for (std::string line; std::getline(in, line);) {
      const Json json = Json::parse(line, nullptr, false);
      if (!gone && json.is_object()) gone = files_before(json);
      if (json.is_object()) take(json);
    }
  }
  return gone.value_or(0);
}

}  // namespace tutti::program
