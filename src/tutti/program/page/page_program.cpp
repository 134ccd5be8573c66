// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/page_program.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <list>
#include <optional>
#include <utility>

#include "tutti/bus/mission_lease.hpp"
#include "tutti/history/history_file.hpp"
#include "tutti/mapfile/map_beside.hpp"
#include "tutti/node/decision_sender.hpp"
#include "tutti/node/marks.hpp"
#include "tutti/program/clock.hpp"
#include "tutti/program/host.hpp"
#include "tutti/program/incarnation.hpp"
#include "tutti/program/page_child.hpp"
#include "tutti/program/server_program.hpp"
#include "tutti/program/state_folder.hpp"
#include "tutti/program/stop.hpp"
#include "tutti/storage/sqlite_store.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::page {
namespace {

using program::Answer, program::Clock, program::Json, program::Level;

constexpr double kWaitForServer_s = 10.0;
constexpr double kNobodyWaits_s = 30.0;  // an order that the server has not answered is sent no more

/// The page as its host sees it: a viewer of the bus, which passes on what operators say.
class HostedPage final : public program::Hosted {
 public:
  HostedPage(bus::Endpoint self, Page& page, const storage::TableStore& map, const std::filesystem::path& estimate,
             std::string url, program::EventLog& log)
      : self_(self), page_(page), map_(map), beside_(map, estimate), url_(std::move(url)), log_(log) {}

  Answer start(Timestamp /*now*/) override { return {}; }
  Answer receive(const bus::Received& message, Timestamp /*now*/) override {
    auto status = wire::decode_mission_status(*message.envelope.bytes);
    if (!status) {
      say(status.error().message);
      return {{}, {message.ticket}};
    }
    revision_ = status->revision;
    page_.show_status(*status);
    for (auto sent = sent_.begin(); sent != sent_.end();) {
      const auto why = sent->sender.answer(*status);
      if (why) sent->answer.set_value(*why);
      sent = why ? sent_.erase(sent) : std::next(sent);
    }
    return {{}, {message.ticket}};
  }
  [[nodiscard]] std::optional<Timestamp> next_work() const override {
    return sent_.empty() ? std::nullopt : std::optional(kFirstTimestamp);
  }
  Answer work(Timestamp /*now*/) override {
    Answer out;
    const double now_s = Clock::steady_s();
    std::erase_if(sent_, [&](const Sent& sent) { return now_s - sent.since_s > kNobodyWaits_s; });
    for (Sent& sent : sent_)
      if (auto message = sent.sender.due(now_s)) out.step.messages.push_back(std::move(*message));
    return out;
  }
  void wait(double wall_s) override {
    for (AskedOrder& asked : page_.take_orders())
      std::visit(
          [&](const auto& order) {
            sent_.push_back({node::DecisionSender(self_, order), std::move(asked.answer), Clock::steady_s()});
          },
          asked.order);
    if (beside_.has_news() && page_.wants(revision_)) show_map();
    Hosted::wait(sent_.empty() ? wall_s : std::min(wall_s, kSoon_s));
  }
  Answer report(Timestamp /*now*/) override {
    show_marks();
    return {};
  }
  [[nodiscard]] Json status(Timestamp /*now*/) const override {
    return {{"program", "page"}, {"pid", getpid()}, {"url", url_}, {"revision", revision_}, {"line", url_}};
  }

 private:
  static constexpr double kSoon_s = 0.01;
  struct Sent {
    node::DecisionSender sender;
    std::promise<std::string> answer;
    double since_s = 0.0;
  };

  void show_map() {
    const auto map = beside_.newest();
    if (!map) return say(map.error().message);
    if (*map) page_.show(*map);
  }
  void show_marks() {
    const auto marks = node::read_marks(map_);
    if (!marks) return say(marks.error().message);
    if (marks_ != *marks) page_.show_marks(*marks);
    marks_ = *marks;
  }
  void say(const std::string& what) { log_.say(Level::warning, what); }

  bus::Endpoint self_;
  Page& page_;
  const storage::TableStore& map_;
  mapfile::MapBeside beside_;
  std::string url_;
  program::EventLog& log_;
  std::uint64_t revision_ = 0;
  std::optional<MarkSet> marks_;  // that the page has
  std::list<Sent> sent_;
};

Status check_server(const std::filesystem::path& folder) {
  std::error_code none;
  if (std::filesystem::is_regular_file(folder / program::kMapFile, none)) return {};
  return fail(ErrorCode::configuration, "--server {}: no {} there, expected the state folder of the server",
              folder.string(), program::kMapFile);
}

}  // namespace

Status run_page(PageProgramOptions options, const std::atomic<bool>& stop) {
  if (Status ok = check_server(options.server); !ok) return ok;
  auto mission = bus::served_mission(options.bus, kWaitForServer_s);
  if (!mission) return tl::unexpected(mission.error());
  options.bus.mission = *mission;
  auto folder = program::StateFolder::open(options.state, "page", history::kHistoryFile);
  if (!folder) return tl::unexpected(folder.error());
  auto log = program::EventLog::open(folder->path(), "page", options.console);
  if (!log) return tl::unexpected(log.error());
  auto map = storage::open_sqlite_reader(options.server / program::kMapFile, storage::map_schema());
  if (!map) return tl::unexpected(map.error());
  std::string url;
  PageOptions served = options.page;
  served.mission = *mission;
  served.verifier = options.verifiers.verifier();
  served.history = folder->path() / history::kHistoryFile;
  served.say = [&](Level level, const std::string& sentence) { (*log)->say(level, sentence); };
  served.announce = [&](const std::string& at) { url = at; };
  auto page = serve_page(served, **map);
  if (!page) return tl::unexpected(page.error());
  const Clock clock;
  const bus::Endpoint self = bus::Endpoint::viewer(program::any_incarnation());
  program::Host host({.store = nullptr,
                      .open_port = [&] { return bus::open_port(self, options.bus); },
                      .open_node = [&](bus::Port&) -> Result<std::unique_ptr<program::Hosted>> {
                        return std::make_unique<HostedPage>(self, **page, **map,
                                                            options.server / program::kEstimateFile, url, **log);
                      },
                      .each_second = {},
                      .status_file = folder->path() / program::kPageStatusFile,
                      .version = served.version},
                     clock, **log);
  if (Status opened = host.open(); !opened) return opened;
  if (options.page.announce) options.page.announce(url);
  program::notify_service_manager("READY=1");
  host.run(stop);
  program::notify_service_manager("STOPPING=1");
  return {};
}

}  // namespace tutti::page
