// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/shown_map.hpp"

#include <utility>

#include "tutti/node/words.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::mapfile {
namespace {

/// The store's row of this verdict, if it has one.
ClosureVerdict with_evidence(const ClosureVerdict& verdict, const storage::TableStore& store) {
  const auto row = store.read("verdicts", node::key_of(verdict.pair));
  if (!row || !*row) return verdict;
  auto stored = wire::decode_verdict(**row);
  return stored && node::without_evidence(*stored) == verdict ? std::move(*stored) : verdict;
}

}  // namespace

ShownMap ShownMaps::of(const node::ServerNode& server, Timestamp now) {
  const server::MapServer& map = server.map_server();
  const server::MapServerState& state = map.state();
  ShownMap shown{.revision = state.revision, .time = now, .map = map.map(), .broadcast = server.broadcast()};
  shown.content.submaps = state.submaps;
  shown.content.payload_sizes = state.payload_sizes;
  for (const auto& [pair, verdict] : state.verdicts) {
    const auto known = known_.find(pair);
    const bool is_known =
        known != known_.end() && !known->second.evidence.empty() && node::without_evidence(known->second) == verdict;
    shown.content.verdicts.emplace_hint(shown.content.verdicts.end(), pair,
                                        is_known ? known->second : with_evidence(verdict, store_));
  }
  known_ = shown.content.verdicts;
  shown.content.words = state.words;
  shown.content.names = server.robot_names();
  return shown;
}

}  // namespace tutti::mapfile
