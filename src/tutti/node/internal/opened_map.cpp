// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/internal/opened_map.hpp"

#include <fmt/core.h>

#include <memory>
#include <utility>

#include "tutti/node/decisions.hpp"
#include "tutti/node/meta_keys.hpp"
#include "tutti/node/submap_frames.hpp"
#include "tutti/storage/map_tables.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::node {

void OpenedMap::add(wire::SubmapOutline outline) {
  const SubmapId id = outline.submap.id;
  if (outline.size != PayloadSize()) state.payload_sizes[id] = outline.size;
  state.submaps[id] = std::make_shared<const Submap>(std::move(outline.submap));
  state.answered.add_submap(id);
  note_stored(id);
}

void OpenedMap::note_stored(SubmapId id) {
  Receipt& receipt = receipts[id.chain.robot];
  receipt.robot = id.chain.robot;
  receipt.stored[id.chain.session].insert(id.index);
  registry.note_session(id.chain);
}

void OpenedMap::leave(const std::string& table, const std::string& why) {
  UnreadRows& rows = unread_rows[table];
  ++rows.count;
  rows.why = why;
}

Status OpenedMap::read_robot_or_refusals(std::string_view key, std::string_view bytes) {
  if (const auto robot = RobotRegistry::robot_of(key)) {
    if (!registry.restore(*robot, bytes)) return fail(ErrorCode::parse, "the map's row '{}' is damaged", key);
  } else if (key.starts_with(kRefusedPrefix)) {
    auto receipt = wire::decode_receipt(bytes);
    if (receipt)
      receipts[receipt->robot] = std::move(*receipt);
    else if (receipt.error().code == ErrorCode::unsupported)
      leave(map_tables::kMeta, receipt.error().message);
    else
      return in_context(fmt::format("the map's row '{}'", key), receipt.error());
  }
  return {};
}

Status OpenedMap::read_meta(const storage::TableStore& store) {
  Status ok;
  const auto visit = [&](std::string_view key, std::string_view bytes) {
    if (const auto why = thrown_by([&] { ok = read_robot_or_refusals(key, bytes); })) leave(map_tables::kMeta, *why);
    return ok.has_value();
  };
  if (auto scanned = store.scan(map_tables::kMeta, {}, visit); !scanned) return scanned;
  return ok;
}

/// As MapServer::take() leaves it: the closures of earlier verifiers count until this one has answered. A pair without
/// both of its submaps, as in a map that was salvaged, is asked again when they come.
void OpenedMap::add(ClosureVerdict verdict) {
  const SubmapPair pair = verdict.pair;
  if (!state.answered.has_both(pair)) return;
  if (verdict.refusal) return add_answer(std::move(verdict));
  if (verdict.verifier == state.verifier)
    state.answered.insert(pair);
  else
    ++former_;
  state.verdicts.insert_or_assign(pair, without_evidence(std::move(verdict)));
}

/// To be called after those. Refusals by other verifiers need not be known; closures that were set aside are believed
/// when their verifier is the server's.
void OpenedMap::add_answer(ClosureVerdict verdict) {
  const SubmapPair pair = verdict.pair;
  if (!state.answered.has_both(pair)) return;
  if (verdict.verifier != state.verifier) return;
  if (says(state.decisions, pair, Wish::accept) && state.verdicts.contains(pair)) return;
  if (!state.answered.insert(pair)) return;
  if (verdict.refusal) {
    count_refusal(*verdict.refusal, pair.first.chain.robot, pair.second.chain.robot, state.refused);
    if (former_ > 0) former_ -= state.verdicts.erase(pair);  // of millions of refusals there are few
  } else {
    state.verdicts.insert_or_assign(pair, without_evidence(std::move(verdict)));
  }
}

Result<OpenedMap> OpenedMap::from(const storage::TableStore& store, MethodId verifier) {
  OpenedMap opened;
  opened.state.verifier = std::move(verifier);
  const auto meta = read_map_meta(store);
  if (!meta) return tl::unexpected(meta.error());
  if (!*meta) return opened;
  opened.epoch = (*meta)->epoch;
  opened.state.revision = (*meta)->revision;
  opened.news = (*meta)->news;
  opened.start = (*meta)->start;
  const auto add = [&](auto decoded) { opened.add(std::move(decoded)); };
  const auto add_answers = [&](Verdicts answer) {
    for (ClosureVerdict& verdict : answer.verdicts) opened.add_answer(std::move(verdict));
  };
  if (auto ok = opened.read_meta(store); !ok) return tl::unexpected(ok.error());
  const auto leave_decision = [&](const std::string& why) { opened.leave(map_tables::kDecisions, why); };
  auto decisions = read_decisions(store, leave_decision);
  if (!decisions) return tl::unexpected(decisions.error());
  opened.state.decisions = std::move(*decisions);
  auto counts = read_map_counts(store);
  if (!counts) return tl::unexpected(counts.error());
  opened.counts = *counts;
  auto last_update = read_last_update(store);
  if (!last_update) return tl::unexpected(last_update.error());
  opened.last_update = *last_update;
  auto refinements = read_refinements(store);
  if (!refinements) return tl::unexpected(refinements.error());
  opened.state.refinements = std::move(*refinements);
  auto places = read_places(store);
  if (!places) return tl::unexpected(places.error());
  opened.state.places = std::move(*places);
  auto held = read_held_poses(store);
  if (!held) return tl::unexpected(held.error());
  if (!held->empty()) opened.state.held = std::make_shared<const server::HeldPoses>(std::move(*held));
  auto retired = read_retired(store);
  if (!retired) return tl::unexpected(retired.error());
  opened.state.retired = std::move(*retired);
  const auto leave_submap = [&](std::string_view key, const std::string& why) {  // it is in the map all the same
    if (const auto id = submap_of_key(key)) opened.note_stored(*id);
    opened.leave(map_tables::kSubmaps, why);
  };
  const auto leave = [&](const char* table) {
    return [&opened, table](std::string_view, const std::string& why) { opened.leave(table, why); };
  };
  if (auto ok = read_rows(store, map_tables::kSubmaps, wire::decode_outline, add, leave_submap); !ok)
    return tl::unexpected(ok.error());
  if (auto ok = read_rows(store, map_tables::kVerdicts, wire::decode_verdict, add, leave(map_tables::kVerdicts)); !ok)
    return tl::unexpected(ok.error());
  if (auto ok = read_rows(store, map_tables::kAnswers, wire::decode_verdicts, add_answers, leave(map_tables::kAnswers));
      !ok)
    return tl::unexpected(ok.error());
  return opened;
}

}  // namespace tutti::node
