// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstdint>
#include <future>
#include <mutex>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "tutti/history/history.hpp"
#include "tutti/node/submap_frames.hpp"
#include "tutti/program/incarnation.hpp"
#include "tutti/program/page/acknowledged.hpp"
#include "tutti/program/page/holders.hpp"
#include "tutti/program/page/internal/mark_book.hpp"
#include "tutti/program/page/live_board.hpp"
#include "tutti/program/page/metrics.hpp"
#include "tutti/program/page/page_server.hpp"
#include "tutti/program/page/sign_in.hpp"

namespace httplib {
class Server;
struct Response;
}  // namespace httplib

namespace tutti::page {

/// Operators' orders on their way to the server.
class OrderInbox {
 public:
  /// The server's answer will be in the future: why it is not stored, or empty. Nothing when too many wait.
  std::optional<std::future<std::string>> ask(std::variant<ClosureDecision, MarkOrder> order) {
    const std::scoped_lock lock(mutex_);
    if (is_closed_ || asked_.size() >= kMost) return std::nullopt;
    asked_.push_back({std::move(order), {}});
    return asked_.back().answer.get_future();
  }
  std::vector<AskedOrder> take() {
    const std::scoped_lock lock(mutex_);
    return std::exchange(asked_, {});
  }
  /// Nobody takes any more: who waits for an answer learns that there is none.
  void close() {
    const std::scoped_lock lock(mutex_);
    is_closed_ = true;
    asked_.clear();
  }

 private:
  static constexpr std::size_t kMost = 100;
  bool is_closed_ = false;
  std::mutex mutex_;
  std::vector<AskedOrder> asked_;
};

/// The last map that the server has shown.
class LastMap {
 public:
  void set(std::shared_ptr<const mapfile::ShownMap> map) {
    const std::scoped_lock lock(mutex_);
    map_ = std::move(map);
  }
  /// Null: there was none yet.
  [[nodiscard]] std::shared_ptr<const mapfile::ShownMap> get() const {
    const std::scoped_lock lock(mutex_);
    return map_;
  }

 private:
  mutable std::mutex mutex_;
  std::shared_ptr<const mapfile::ShownMap> map_;
};

/// A value for several threads.
template <class Value>
class Guarded {
 public:
  template <class Call>
  auto with(Call&& call) {
    const std::scoped_lock lock(mutex_);
    return std::forward<Call>(call)(value_);
  }

 private:
  std::mutex mutex_;
  Value value_;
};

/// The state that the page's threads share.
struct Site {
  Site(const PageOptions& options, const storage::TableStore& map)
      : mission_name(options.mission),
        store(map),
        verifier(options.verifier),
        sign_in(options.pki),
        clouds(node::SubmapFrames::of(map)) {}

  bool is_secure = false;
  std::vector<std::string> names;  ///< Those of the certificate, under which it is served, too.
  const std::string mission_name;
  const storage::TableStore& store;  ///< The map's.
  const std::shared_ptr<const server::ClosureVerifier> verifier;
  const std::uint32_t incarnation = program::any_incarnation();
  SignIn sign_in;
  LiveBoard board;
  OrderInbox orders;
  Metrics metrics;
  std::shared_ptr<const node::SubmapFrames> clouds;
  LastMap last_map;
  Guarded<MarkBook> marks;
  Guarded<Holders> held;
  Guarded<Acknowledged> acknowledged;
  std::unique_ptr<history::History> history;  ///< Set before the server starts.
  std::atomic<double> time_s = 0.0;           ///< Mission time of the last status.
};

/// Everything that the page asks for (docs/page.md). `site` outlives the server.
void add_routes(httplib::Server& server, Site& site);
/// Asks the server to store an operator's order, and waits. False: the answer states why it is not stored, with the
/// status `refused` where the server refuses it.
bool ask_server(Site& site, std::variant<ClosureDecision, MarkOrder> order, int refused, httplib::Response& response);
/// This machine's name; empty: it has none.
std::string own_host_name();

}  // namespace tutti::page
