// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "tutti/node/map_meta.hpp"
#include "tutti/server/closure_names.hpp"
#include "tutti/storage/table_store.hpp"

/// A map as a file that no server has open: looked into, told an operator's word, exported, joined with another.
namespace tutti::mapfile {

/// What a map's store holds. Clouds stay there.
struct Content {
  node::MapMeta meta;
  std::optional<node::MapCounts> counts;  ///< Of the last update.
  server::ServerConfig settings;
  server::SubmapSet submaps;
  std::map<SubmapId, PayloadSize> payload_sizes;  ///< Of submaps that carry any.
  server::VerdictSet verdicts;                    ///< With their evidence.
  WordSet words;
  server::Refinements refinements;
  std::map<RobotId, std::string> names;
  std::map<MethodId, std::size_t> refused;  ///< Pairs, by who refused them.
  std::map<MethodId, std::size_t> aside;    ///< Pairs with closures of finders that the server's was not: not believed.
  struct Table {
    std::size_t rows = 0;
    std::uint64_t bytes = 0;                          ///< Of keys and rows.
    std::map<std::uint16_t, std::size_t> versions{};  ///< Rows by the version of their message; not of `meta`.
    std::size_t unread = 0;                           ///< Rows of versions that this program does not read: left out.
  };
  std::map<std::string, Table> tables;

  [[nodiscard]] server::ClosureNames closure_names() const;
};

Result<Content> read(const storage::TableStore& map);

/// The joint map, judged as the server judges it, and refined as it has it.
server::MapEstimate estimate(const Content& content);

/// A map's file, which must be there. An error: it is open in another program, or no map.
Result<std::unique_ptr<storage::TableStore>> open(const std::filesystem::path& file);

/// Puts an operator's word into the map; the server that opens it next follows it. An error, and nothing is stored: the
/// closure is not there (server::MapServer::receive), or a word that was given later holds.
Status put_word(storage::TableStore& map, const ClosureWord& word);

}  // namespace tutti::mapfile
