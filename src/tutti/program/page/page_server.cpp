// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/page_server.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "tutti/bus/bus_address.hpp"
#include "tutti/bus/bus_credentials.hpp"
#include "tutti/history/history_file.hpp"
#include "tutti/pki/pki.hpp"
#include "tutti/program/clock.hpp"
#include "tutti/program/incarnation.hpp"
#include "tutti/program/page/internal/guarded_server.hpp"
#include "tutti/program/page/internal/mark_routes.hpp"
#include "tutti/program/page/internal/recorder.hpp"
#include "tutti/program/page/internal/routes.hpp"
#include "tutti/program/page/view.hpp"

namespace tutti::page {
namespace {

using program::Clock, program::Level, mapfile::ShownMap;

constexpr double kPeriod_s = 1.0;  // at least between two maps that are shown
constexpr double kRestPerWork = 4.0;

/// Where a browser finds a page that listens at `host`: nobody can open 0.0.0.0.
std::string host_to_open(const std::string& host, const std::vector<std::string>& names) {
  if (host != "0.0.0.0" && host != "::") return host;
  const auto named = std::ranges::find_if(names, [](const std::string& name) { return name != bus::kBusName; });
  if (named != names.end()) return *named;
  const std::string own = own_host_name();
  return own.empty() ? "localhost" : own;
}

class ServedPage final : public Page {
 public:
  ServedPage(const PageOptions& options, const storage::TableStore& map)
      : site_(options, map),
        say_(options.say),
        announce_(options.announce),
        rate_(options.rate),
        alerts_(silent_after_s(options.rate)) {
    site_.board.put([&](Board& board) {
      board.put(mission_message({.name = options.mission,
                                 .description = options.description,
                                 .version = options.version,
                                 .robot_silent_s = silent_after_s(options.rate)}));
    });
    remember(options.history);
  }
  ~ServedPage() override {
    site_.board.close();
    site_.orders.close();
    if (server_) server_->end();
    if (listens_.joinable()) listens_.join();
    makes_.request_stop();
    if (makes_.joinable()) makes_.join();
    recorder_.reset();
  }
  ServedPage(const ServedPage&) = delete;
  ServedPage& operator=(const ServedPage&) = delete;

  Status open(const bus::HostPort& address, const std::filesystem::path& pki) {
    server_ = std::make_unique<GuardedServer>();
    if (!pki.empty() && !server_->use_tls({pki / pki::kBusCertificate, pki / pki::kBusKey, pki / pki::kAuthority}))
      return fail(ErrorCode::io, "the page: the certificate of {} cannot be used", pki.string());
    if (!pki.empty()) {
      const auto there = pki::Pki::open(pki);
      auto names = there ? there->bus_names() : tl::unexpected(there.error());
      if (!names) return in_context("the page", names.error());
      site_.names = std::move(*names);
    }
    add_routes(*server_, site_);
    const int port = server_->bind(address.host, address.port);
    if (port < 0)
      return fail(ErrorCode::io, "the page at {}: this address cannot be listened at; is another program there?",
                  to_string(address));
    site_.is_secure = !pki.empty();
    listens_ = std::thread([this] { server_->listen(); });
    makes_ = std::jthread([this](const std::stop_token& stop) { make_all(stop); });
    const std::string url = fmt::format("{}://{}/", pki.empty() ? "http" : "https",
                                        to_string(bus::HostPort{host_to_open(address.host, site_.names), port}));
    say_(Level::info, "the page is at " + url);
    if (announce_) announce_(url);
    return {};
  }

  [[nodiscard]] bool wants(std::uint64_t revision) const override {
    return revision != shown_ && Clock::steady_s() >= not_before_s_;
  }
  void show(std::shared_ptr<const ShownMap> map) override {
    shown_ = map->revision;
    site_.last_map.set(map);
    not_before_s_ = Clock::steady_s() + kPeriod_s;
    {
      const std::scoped_lock lock(mutex_);
      next_ = std::move(map);
    }
    changed_.notify_one();
  }
  void show_status(const MissionStatus& status) override {
    const double time_s = status.time - Timestamp{};
    site_.time_s = time_s;
    const auto alerts = joined(alerts_.of_status(status), map_alerts());
    site_.metrics.update(status);
    site_.acknowledged.with([&](Acknowledged& all) { all.show(alerts); });
    const auto held = site_.held.with([&](Holders& holders) { return holders.message(Clock::steady_s(), time_s); });
    site_.board.put([&](Board& board) {
      board.put(held);
      board.put(radio_message(status));
      if (!status.places.empty()) board.put(places_message(status));
      board.put(status_message(status));
      board.put(alerts_message(alerts, time_s));
    });
  }
  void show_marks(const MarkSet& marks) override {
    const MarkSet all = site_.marks.with([&](MarkBook& book) { return book.replace(marks); });
    site_.board.put([&](Board& board) {
      std::vector<Message> messages;
      for (const auto& [number, mark] : all)
        messages.push_back(mark_message(number, mark, mark.photo_type.empty() ? "" : photo_path(number), site_.time_s));
      board.put_all("mark/", messages, site_.time_s);
    });
  }
  std::vector<AskedOrder> take_orders() override { return site_.orders.take(); }

 private:
  /// Goes on from an earlier program: the past, since when problems are there, who has acknowledged them.
  void remember(const std::filesystem::path& file) {
    const double gap_s = 3.0 * silent_after_s(rate_);
    auto opened = history::open_history(file, {.gap_s = gap_s});
    if (!opened.said.empty()) say_(Level::warning, "the page: " + opened.said);
    site_.history = std::move(opened.history);
    for (const Message& message : site_.history->last()) {
      site_.time_s = std::max<double>(site_.time_s, message.time_s);
      site_.acknowledged.with([&](Acknowledged& all) { all.resume(message); });
      if (message.key != "alerts") continue;
      alerts_.resume(message.value);
      maps_alerts_.resume(message.value);
    }
    recorder_.emplace(site_.board, *site_.history, say_);
  }
  std::vector<Alert> map_alerts() {
    const std::scoped_lock lock(mutex_);
    return map_alerts_;
  }
  void make_all(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, stop, [this] { return next_ != nullptr; });
      const auto map = std::exchange(next_, nullptr);
      lock.unlock();
      if (map) make(*map);
    }
  }
  void make(const ShownMap& map) {
    const double begin_s = Clock::steady_s(), time_s = map.time - Timestamp{};
    Comparisons comparisons = compare_all(map);
    const auto holding = closures_holding(map.content.submaps, map.map);
    MapMessages messages = map_messages(map, holding, comparisons.sigma_m);
    auto alerts = maps_alerts_.of_map(map, holding);
    {
      const std::scoped_lock lock(mutex_);
      map_alerts_ = std::move(alerts);
    }
    site_.board.put([&](Board& board) {
      board.put_all("submap/", std::move(messages.submaps), time_s);
      board.put(std::move(messages.poses));
      board.put_all("closure/", std::move(messages.closures), time_s);
      board.put_all("disagreement/", std::move(comparisons.messages), time_s);
    });
    const double now_s = Clock::steady_s();
    not_before_s_ = std::max(begin_s + kPeriod_s, now_s + kRestPerWork * (now_s - begin_s));
  }

  Site site_;
  std::function<void(Level, const std::string&)> say_;
  std::function<void(const std::string&)> announce_;
  std::unique_ptr<GuardedServer> server_;
  double rate_;
  Alerts alerts_;       // the server's thread's
  Alerts maps_alerts_;  // of the thread that makes messages
  std::atomic<std::uint64_t> shown_ = 0;
  std::atomic<double> not_before_s_ = 0.0;
  std::mutex mutex_;  // of next_ and map_alerts_
  std::condition_variable_any changed_;
  std::shared_ptr<const ShownMap> next_;
  std::vector<Alert> map_alerts_;
  std::optional<Recorder> recorder_;
  std::thread listens_;
  std::jthread makes_;
};

Result<bus::HostPort> address_of(const std::string& listen) {
  const bool is_port = !listen.empty() && listen.find_first_not_of("0123456789") == std::string::npos;
  const bool is_any = is_port && std::stoul("0" + listen.substr(0, 9)) == 0;
  auto address = bus::parse_host_port(is_any ? "127.0.0.1" : is_port ? "127.0.0.1:" + listen : listen);
  if (!address) return in_context("the page's address", address.error());
  return address;
}

}  // namespace

Result<std::unique_ptr<Page>> serve_page(const PageOptions& options, const storage::TableStore& map) {
  const auto address = address_of(options.listen);
  if (!address) return tl::unexpected(address.error());
  if (options.pki.empty() && !options.allow_insecure && !bus::is_loopback(address->host))
    return fail(ErrorCode::configuration,
                "the page at {}: anybody who reaches this address could decide: needs --pki DIR (tutti pki init); "
                "--insecure forces it",
                options.listen);
  auto page = std::make_unique<ServedPage>(options, map);
  if (Status ok = page->open(*address, options.pki); !ok) return tl::unexpected(ok.error());
  return page;
}

}  // namespace tutti::page
