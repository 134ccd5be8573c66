// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "tutti/model/messages.hpp"
#include "tutti/node/map_meta.hpp"
#include "tutti/node/robot_registry.hpp"
#include "tutti/node/stored_rows.hpp"
#include "tutti/server/map_server.hpp"
#include "tutti/storage/table_store.hpp"
#include "tutti/wire/submap_outline.hpp"

namespace tutti::node {

/// The state that a server finds in its store.
struct OpenedMap {
  server::MapServerState state;
  std::map<RobotId, Receipt> receipts;
  std::map<std::string, UnreadRows> unread_rows;  ///< By table.
  RobotRegistry registry;
  std::uint64_t epoch = 0;
  std::uint64_t start = 0;
  bool news = false;
  std::optional<MapCounts> counts;
  std::optional<LastUpdate> last_update;

  static Result<OpenedMap> from(const storage::TableStore& store, MethodId verifier);

 private:
  Status read_meta(const storage::TableStore& store);
  Status read_robot_or_refusals(std::string_view key, std::string_view bytes);
  void leave(const std::string& table, const std::string& why);
  void note_stored(SubmapId id);
  void add(wire::SubmapOutline outline);
  void add(ClosureVerdict verdict);
  void add_answer(ClosureVerdict verdict);

  std::size_t former_ = 0;  // verdicts of earlier verifiers
};

}  // namespace tutti::node
