// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "tutti/node/map_meta.hpp"
#include "tutti/server/closure_names.hpp"
#include "tutti/storage/table_store.hpp"

/// Reads a map's file that no server has open, recomputes its estimate, and stores operators' decisions in it.
namespace tutti::mapfile {

/// The contents of a map's store, except for the submaps' payloads.
struct Content {
  node::MapMeta meta;
  std::optional<node::MapCounts> counts;  ///< Counts of the last update.
  server::ServerConfig settings;
  server::SubmapSet submaps;
  std::map<SubmapId, PayloadSize> payload_sizes;  ///< Only submaps that carry a payload are in it.
  server::VerdictSet verdicts;                    ///< With their evidence.
  DecisionSet decisions;
  server::Refinements refinements;
  server::HeldPoses held;             ///< The poses of a map that does not move.
  std::set<SubmapId> retired;         ///< Submaps that show known ground.
  server::CandidatePairs candidates;  ///< Verdicts of other pairs are not in the map.
  std::map<RobotId, std::string> names;
  std::map<MethodId, std::size_t> refused;  ///< Refused pairs, by the verifier that refused them.
  /// Pairs with closures of other verifiers than the server's, which are not believed.
  std::map<MethodId, std::size_t> aside;
  struct Table {
    std::size_t rows = 0;
    std::uint64_t bytes = 0;                          ///< Size of keys and rows.
    std::map<std::uint16_t, std::size_t> versions{};  ///< Rows by the version of their message; empty for `meta`.
    std::size_t unread = 0;  ///< Rows of versions that this program does not read, which are left out.
  };
  std::map<std::string, Table> tables;

  /// All that have submaps.
  [[nodiscard]] std::set<ChainId> chains() const;
  [[nodiscard]] server::ClosureNames closure_names() const;
};

/// Reads all tables of a map. A row that is damaged is an error; one of a version that is not read is counted in
/// Table::unread.
Result<Content> read(const storage::TableStore& map);

/// The joint map, estimated as the server does with its settings: closures judged, refinements applied, laid on the
/// earth where submaps carry fixes.
server::MapEstimate estimate(const Content& content);

/// Opens an existing map's file, for this program alone. Errors: there is no such file, it is no map, or another
/// program has it open.
Result<std::unique_ptr<storage::TableStore>> open(const std::filesystem::path& file);

/// Opens a copy of a map's file that a server may have open, now or at any time: it is neither changed nor locked. The
/// copy is in the system's folder for temporary files, and gone when the store is destroyed. Errors: there is no such
/// file, it is no map, or it cannot be copied.
Result<std::unique_ptr<storage::TableStore>> open_copy(const std::filesystem::path& file);

/// The bytes of such a copy.
Result<std::string> read_copy(const std::filesystem::path& file);

/// Stores an operator's decision, which the server that opens the map next follows. On an error nothing is stored: the
/// closure's name or submaps are unknown, there is no closure to accept, or there is a later decision.
Status put_decision(storage::TableStore& map, const ClosureDecision& decision);

}  // namespace tutti::mapfile
