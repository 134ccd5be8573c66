// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/renumber.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "tutti/mapfile/changed_tables.hpp"
#include "tutti/mapfile/meta_rows.hpp"
#include "tutti/node/decisions.hpp"
#include "tutti/node/map_meta.hpp"
#include "tutti/node/robot_registry.hpp"
#include "tutti/node/submap_frames.hpp"
#include "tutti/storage/map_tables.hpp"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/refinement_codec.hpp"

namespace tutti::mapfile {
namespace {

using storage::TableStore;
using Chains = std::map<ChainId, ChainId>;

ChainId renamed(const ChainId& chain, const Chains& chains) {
  const auto found = chains.find(chain);
  return found == chains.end() ? chain : found->second;
}
SubmapId renamed(const SubmapId& id, const Chains& chains) { return {renamed(id.chain, chains), id.index}; }
KeyframeId renamed(const KeyframeId& id, const Chains& chains) { return {renamed(id.chain, chains), id.index}; }

/// A robot's number once its sessions are renamed.
RobotId renamed(RobotId robot, const Chains& chains) {
  const auto found = chains.lower_bound(robot);
  return found != chains.end() && found->first.robot == robot ? found->second.robot : robot;
}

/// A closure between the same two keyframes; turned round when their submaps change places.
LoopClosure renamed(LoopClosure closure, const Chains& chains, bool is_turned) {
  closure.from = renamed(closure.from, chains);
  closure.to = renamed(closure.to, chains);
  if (is_turned) closure = {closure.to, closure.from, inverse(closure.measurement)};
  return closure;
}

/// The pair with its smaller submap first, and whether that is the other one than before.
std::pair<SubmapPair, bool> renamed(const SubmapPair& pair, const Chains& chains) {
  const SubmapId first = renamed(pair.first, chains), second = renamed(pair.second, chains);
  return second < first ? std::pair(SubmapPair{second, first}, true) : std::pair(SubmapPair{first, second}, false);
}

Result<NewRows> renamed_submap(std::string_view bytes, const Chains& chains) {
  auto message = wire::decode_submap(bytes);
  if (!message) return tl::unexpected(message.error());
  SubmapId& id = message->submap.id;
  std::vector<RobotRange>& ranges = message->submap.ranges;
  if (!chains.contains(id.chain) && ranges.empty())
    return NewRows{{map_tables::kSubmaps, node::key_of(id), std::string(bytes)}};
  for (RobotRange& range : ranges) range.to = renamed(range.to, chains);
  id = renamed(id, chains);
  message->header.robot = id.chain.robot;
  message->header.session = id.chain.session;
  return NewRows{{map_tables::kSubmaps, node::key_of(id), wire::encode(*message)}};
}

ClosureVerdict renamed(ClosureVerdict verdict, const Chains& chains) {
  const auto [pair, is_turned] = renamed(verdict.pair, chains);
  verdict.pair = pair;
  for (LoopClosure& closure : verdict.closures) closure = renamed(closure, chains, is_turned);
  return verdict;
}

Result<NewRows> renamed_verdict(std::string_view bytes, const Chains& chains) {
  auto verdict = wire::decode_verdict(bytes);
  if (!verdict) return tl::unexpected(verdict.error());
  *verdict = renamed(std::move(*verdict), chains);
  return NewRows{{map_tables::kVerdicts, node::key_of(verdict->pair), wire::encode(*verdict)}};
}

Result<NewRows> renamed_decision(std::string_view key, std::string_view bytes, const Chains& chains) {
  const auto former = node::pair_of(key);
  if (!former) return fail(ErrorCode::parse, "a row of table 'decisions' has no pair of submaps as its key");
  auto decision = wire::decode_decision(bytes);
  if (!decision) return tl::unexpected(decision.error());
  *decision = with_sessions(std::move(*decision), *former);
  const auto [pair, is_turned] = renamed(*former, chains);
  for (LoopClosure& closure : decision->by_hand) closure = renamed(closure, chains, is_turned);
  decision->closure = to_string(pair.first) + "-" + to_string(pair.second);
  return NewRows{{map_tables::kDecisions, node::key_of(pair), wire::encode(*decision)}};
}

Refinement renamed(Refinement refinement, const Chains& chains) {
  for (SubmapId& id : refinement.submaps) id = renamed(id, chains);
  std::ranges::sort(refinement.submaps);
  for (SubmapPair& pair : refinement.closed) pair = renamed(pair, chains).first;
  std::ranges::sort(refinement.closed);
  for (RefinedStep& step : refinement.steps) step.from = renamed(step.from, chains);
  std::ranges::sort(refinement.steps, {}, &RefinedStep::from);
  std::map<KeyframeId, Pose3> poses;
  for (const auto& [id, pose] : refinement.T_world_body) poses.emplace(renamed(id, chains), pose);
  refinement.T_world_body = std::move(poses);
  return refinement;
}

/// The sessions of a robot under the number that one of them gets; all of a robot's are renamed to one number.
node::RobotRow renamed(node::RobotRow row, RobotId robot, const Chains& chains) {
  const auto session = [&](std::uint64_t s) { return renamed(ChainId(robot, s), chains).session; };
  row.session = session(row.session);
  for (auto* sessions : {&row.former, &row.rivals}) {
    std::set<std::uint64_t> changed;
    for (const std::uint64_t s : *sessions) changed.insert(session(s));
    *sessions = std::move(changed);
  }
  return row;
}

Result<NewRows> renamed_meta(std::string_view key, std::string_view bytes, const Chains& chains) {
  const auto damaged = [&] { return fail(ErrorCode::parse, "the row '{}' of table 'meta' is damaged", key); };
  const MetaRow& row = meta_row(key);
  if (row.renumber_drops) return NewRows();
  switch (row.of) {
    using enum MetaRow::Of;
    case map:
    case version:
      break;
    case submap: {
      const auto id = node::submap_of_key(key.substr(row.key.size()));
      if (!id) return damaged();
      return NewRows{
          {map_tables::kMeta, std::string(row.key) + node::key_of(renamed(*id, chains)), std::string(bytes)}};
    }
    case robot: {
      const auto of = node::RobotRegistry::robot_of(key);
      if (!of) break;
      const auto known = node::decode_robot(bytes);
      if (!known) return damaged();
      RobotId number = *of;
      for (const auto& [from, to] : chains)
        if (from.robot == *of) number = to.robot;
      return NewRows{{map_tables::kMeta, node::RobotRegistry::key(number), encode(renamed(*known, *of, chains))}};
    }
    case place: {
      auto known = node::place_of_row(key, bytes);
      if (!known) return NewRows();  // as who opens the map: it is made again
      for (server::Alike& alike : known->second.candidates) alike.submap = renamed(alike.submap, chains);
      return NewRows{node::to_row(renamed(known->first, chains), known->second)};
    }
    case refinement: {
      auto known = wire::decode_refinement(bytes);
      if (!known) return NewRows();  // likewise
      return NewRows{{map_tables::kMeta, std::string(key), wire::encode(renamed(std::move(*known), chains))}};
    }
  }
  return NewRows{{map_tables::kMeta, std::string(key), std::string(bytes)}};
}

std::map<std::string, RobotId> numbers_of(const std::map<RobotId, std::string>& names) {
  std::map<std::string, RobotId> out;
  for (const auto& [robot, name] : names) out.emplace(name, robot);
  return out;
}

/// True if any submap of the chain is in both maps with other bytes.
Result<bool> differs(const TableStore& a, const TableStore& b, const server::SubmapSet& of_b, const ChainId& chain) {
  for (auto it = of_b.lower_bound({chain, 0}); it != of_b.end() && it->first.chain == chain; ++it) {
    const std::string key = node::key_of(it->first);
    const auto one = a.read(map_tables::kSubmaps, key), other = b.read(map_tables::kSubmaps, key);
    if (!one) return tl::unexpected(one.error());
    if (!other) return tl::unexpected(other.error());
    if (*one && *other && **one != **other) return true;
  }
  return false;
}

}  // namespace

Result<Chains> chains_to_renumber(const TableStore& a, const Content& of_a, const TableStore& b, const Content& of_b) {
  const auto numbers = numbers_of(of_a.names);
  const std::set<ChainId> there = of_a.chains(), added = of_b.chains();
  std::set<RobotId> taken;
  std::map<RobotId, std::uint64_t> newest;  // session, by robot of the merged map
  for (const ChainId& chain : there) {
    taken.insert(chain.robot);
    newest[chain.robot] = std::max(newest[chain.robot], chain.session);
  }
  for (const auto& [robot, name] : of_a.names) taken.insert(robot);
  std::map<RobotId, RobotId> robots;
  for (const ChainId& chain : added) {
    if (robots.contains(chain.robot)) continue;
    const auto name = of_b.names.find(chain.robot), name_there = of_a.names.find(chain.robot);
    const auto same = name == of_b.names.end() ? numbers.end() : numbers.find(name->second);
    const bool is_another =
        name != of_b.names.end() && name_there != of_a.names.end() && name->second != name_there->second;
    RobotId number = same != numbers.end() ? same->second : chain.robot;
    if (same == numbers.end() && is_another)
      for (number = {0}; taken.contains(number) || of_b.names.contains(number);) ++number.value;
    taken.insert(number);
    robots[chain.robot] = number;
  }
  Chains out;
  for (const ChainId& chain : added) {
    ChainId to(robots.at(chain.robot), chain.session);
    if (there.contains(to)) {
      const auto is_other_run = to == chain ? differs(a, b, of_b.submaps, chain) : Result<bool>(true);
      if (!is_other_run) return tl::unexpected(is_other_run.error());
      if (*is_other_run) to.session = newest[to.robot] + 1;
    }
    newest[to.robot] = std::max(newest[to.robot], to.session);
    if (to != chain) out.emplace(chain, to);
  }
  return out;
}

Status renumber(const TableStore& map, const Chains& chains, TableStore& out) {
  const auto submap = [&](std::string_view, std::string_view bytes) { return renamed_submap(bytes, chains); };
  const auto verdict = [&](std::string_view, std::string_view bytes) { return renamed_verdict(bytes, chains); };
  const auto refusals = [&](std::string_view, std::string_view bytes) {
    return refusals_of(bytes, [&](ClosureVerdict& refused) {
      refused = renamed(std::move(refused), chains);
      return true;
    });
  };
  const auto decision = [&](auto key, auto bytes) { return renamed_decision(key, bytes, chains); };
  const auto meta = [&](auto key, auto bytes) { return renamed_meta(key, bytes, chains); };
  return copy_changed(map,
                      {{map_tables::kSubmaps, submap},
                       {map_tables::kVerdicts, verdict},
                       {map_tables::kAnswers, refusals},
                       {map_tables::kDecisions, decision},
                       {map_tables::kMeta, meta}},
                      out);
}

}  // namespace tutti::mapfile
