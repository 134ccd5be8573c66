// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/shown_map.hpp"

#include <optional>
#include <utility>

#include "tutti/node/decisions.hpp"
#include "tutti/storage/map_tables.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::mapfile {
namespace {

/// The store's row of this verdict, if it has one.
std::optional<ClosureVerdict> stored(const ClosureVerdict& verdict, const storage::TableStore& store) {
  const auto row = store.read(map_tables::kVerdicts, node::key_of(verdict.pair));
  if (!row || !*row) return std::nullopt;
  auto out = wire::decode_verdict(**row);
  return out && node::without_evidence(*out) == verdict ? std::optional(std::move(*out)) : std::nullopt;
}

}  // namespace

ShownMap ShownMaps::of(const node::ServerNode& server, Timestamp now) {
  const server::MapServer& map = server.map_server();
  const server::MapServerState& state = map.state();
  ShownMap shown{.revision = state.revision, .time = now, .map = map.map(), .broadcast = server.broadcast()};
  shown.content.submaps = state.submaps;
  shown.content.payload_sizes = state.payload_sizes;
  server::VerdictSet known;
  for (const auto& [pair, verdict] : state.verdicts) {
    auto row = known_.extract(pair);
    if (row.empty() || node::without_evidence(row.mapped()) != verdict) {
      auto found = stored(verdict, store_);
      shown.content.verdicts.emplace_hint(shown.content.verdicts.end(), pair, found ? *found : verdict);
      if (found) known.emplace_hint(known.end(), pair, std::move(*found));
      continue;
    }
    shown.content.verdicts.emplace_hint(shown.content.verdicts.end(), pair, row.mapped());
    known.insert(known.end(), std::move(row));
  }
  known_ = std::move(known);
  shown.content.decisions = state.decisions;
  shown.content.names = server.robot_names();
  return shown;
}

}  // namespace tutti::mapfile
