// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/mapfile/shown_map.hpp"
#include "tutti/model/closure_decision.hpp"
#include "tutti/model/map_mark.hpp"
#include "tutti/model/status.hpp"
#include "tutti/program/event_log.hpp"
#include "tutti/server/closure_verifier.hpp"
#include "tutti/storage/table_store.hpp"

namespace tutti::page {

/// An operator's order on its way to the server, and the promise of an answer: why it is not stored, or empty when it
/// is. The promise is broken when nobody will answer.
struct AskedOrder {
  std::variant<ClosureDecision, MarkOrder> order;
  std::promise<std::string> answer;
};

/// Where the page of a running mission is served, and what it shows.
struct PageOptions {
  std::string listen;           ///< "PORT" or "HOST:PORT"; without a host: this machine only. Port 0: any.
  bool allow_insecure = false;  ///< Other machines reach it without credentials.
  std::string mission;
  std::string description;  ///< The mission, in a sentence.
  std::string version;
  std::shared_ptr<const server::ClosureVerifier> verifier;
  double rate = 1.0;          ///< Mission time per wall time.
  std::filesystem::path pki;  ///< Folder of `tutti pki`; empty: whoever reaches the page may do all.
  /// Where it keeps what it has shown, for those who come late; empty: nowhere.
  std::filesystem::path history;
  std::function<void(program::Level, const std::string&)> say;
  /// Called once with the page's address; may be empty.
  std::function<void(const std::string& url)> announce;
};

/// The page of a running mission (docs/page.md), while it is served. Callers of these functions wait for none of those
/// who look at it.
class Page {
 public:
  virtual ~Page() = default;
  /// True if it has time for this revision and does not show it yet.
  [[nodiscard]] virtual bool wants(std::uint64_t revision) const = 0;
  virtual void show(std::shared_ptr<const mapfile::ShownMap> map) = 0;
  virtual void show_status(const MissionStatus& status) = 0;
  /// All marks of the map; those that it has, too.
  virtual void show_marks(const MarkSet& marks) = 0;
  /// The operators' decisions and marks since the last call.
  [[nodiscard]] virtual std::vector<AskedOrder> take_orders() = 0;

 protected:
  Page() = default;
  Page(const Page&) = delete;
  Page& operator=(const Page&) = delete;
};

/// Serves the page over HTTP, or over HTTPS where there is a folder of `tutti pki`. It has threads of its own, at most
/// as many as connections are served at a time; connections beyond that wait with the kernel. `map` is the map's store,
/// which is only read, and outlives the page. Fails when the address is malformed or taken, or is another machine's to
/// reach with neither credentials nor allow_insecure.
Result<std::unique_ptr<Page>> serve_page(const PageOptions& options, const storage::TableStore& map);

}  // namespace tutti::page
