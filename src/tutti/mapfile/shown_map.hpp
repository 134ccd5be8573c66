// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "tutti/base/timestamp.hpp"
#include "tutti/mapfile/content.hpp"
#include "tutti/node/server_node.hpp"
#include "tutti/storage/table_store.hpp"

namespace tutti::mapfile {

/// A map as a server has it at one time; its clouds are in the server's store.
struct ShownMap {
  std::uint64_t revision = 0;
  Timestamp time;   ///< Mission time.
  Content content;  ///< Submaps with the sizes of their payloads only, names, verdicts with closures, decisions.
  server::MapEstimate map;
  ProxyGraph broadcast;  ///< The last proxy graph; empty: there was none yet.
};

/// Makes copies of a server's map: none of their parts is the server's any more, but for the submaps, which never
/// change. The server does not keep in memory what a verdict's verifier measured, where and when: it is read from the
/// server's store, each row once. Where that has no such row yet, or cannot be read, it is missing.
class ShownMaps {
 public:
  /// `store` must outlive this.
  explicit ShownMaps(const storage::TableStore& store) : store_(store) {}
  [[nodiscard]] ShownMap of(const node::ServerNode& server, Timestamp now);

 private:
  const storage::TableStore& store_;
  server::VerdictSet known_;  // rows of the store that were last shown
};

}  // namespace tutti::mapfile
