// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/decisions.hpp"

#include "tutti/node/submap_frames.hpp"
#include "tutti/storage/map_tables.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::node {

std::string key_of(const SubmapPair& pair) { return key_of(pair.first) + key_of(pair.second); }

std::optional<SubmapPair> pair_of(std::string_view key) {
  const auto numbers = storage::numbers_of(key, 6);
  if (!numbers) return std::nullopt;
  const auto id = [&](std::size_t at) {
    return SubmapId{{RobotId{static_cast<std::uint32_t>((*numbers)[at])}, (*numbers)[at + 1]},
                    static_cast<std::uint32_t>((*numbers)[at + 2])};
  };
  const SubmapPair pair{id(0), id(3)};
  return key == key_of(pair) ? std::optional(pair) : std::nullopt;  // numbers of 32 bits
}

Result<DecisionSet> read_decisions(const storage::TableStore& map,
                                   const std::function<void(const std::string&)>& leave) {
  DecisionSet decisions;
  Status ok;
  const auto scanned = map.scan(map_tables::kDecisions, {}, [&](std::string_view key, std::string_view bytes) {
    const auto pair = pair_of(key);
    auto decision = wire::decode_decision(bytes);
    if (!pair)
      ok = fail(ErrorCode::parse, "the map's table 'decisions': a key that is no pair of submaps");
    else if (!decision && decision.error().code == ErrorCode::unsupported)
      leave(decision.error().message);
    else if (!decision)
      ok = in_context("the map's table 'decisions'", decision.error());
    else
      decisions.insert_or_assign(*pair, with_sessions(std::move(*decision), *pair));
    return ok.has_value();
  });
  if (!scanned) return tl::unexpected(scanned.error());
  if (!ok) return tl::unexpected(ok.error());
  return decisions;
}

ClosureVerdict without_evidence(ClosureVerdict verdict) {
  verdict.evidence.clear();
  verdict.worker = 0;
  verdict.verified_ns = 0;
  return verdict;
}

}  // namespace tutti::node
