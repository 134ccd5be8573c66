// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/versions.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "tutti/mapfile/changed_tables.hpp"
#include "tutti/mapfile/make_map.hpp"
#include "tutti/mapfile/meta_rows.hpp"
#include "tutti/node/decisions.hpp"
#include "tutti/node/map_meta.hpp"
#include "tutti/node/meta_keys.hpp"
#include "tutti/node/robot_registry.hpp"
#include "tutti/node/submap_frames.hpp"
#include "tutti/storage/map_tables.hpp"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/refinement_codec.hpp"

namespace tutti::mapfile {
namespace {

using storage::TableStore;
using LaterChains = std::set<ChainId>;  // those that are left out

std::optional<std::uint64_t> number_of(std::string_view key) {
  key.remove_prefix(node::kVersionPrefix.size());
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(key.data(), key.data() + key.size(), number);
  return error == std::errc() && end == key.data() + key.size() ? std::optional(number) : std::nullopt;
}

std::optional<Version> version_of(std::string_view key, std::string_view bytes) {
  const auto number = number_of(key);
  const auto numbers = storage::numbers_of(bytes, bytes.size() / 8);
  if (!number || !numbers || numbers->size() % 2 != 1) return std::nullopt;
  Version out{.number = *number, .held_ns = static_cast<std::int64_t>(numbers->front())};
  for (std::size_t i = 1; i < numbers->size(); i += 2)
    out.chains.emplace(RobotId{static_cast<std::uint32_t>((*numbers)[i])}, (*numbers)[i + 1]);
  return out;
}

/// A map without some of its chains.
class Without {
 public:
  explicit Without(const LaterChains& chains) : chains_(chains) {}
  [[nodiscard]] bool has(const SubmapId& id) const { return !chains_.contains(id.chain); }
  [[nodiscard]] bool has(const SubmapPair& pair) const { return has(pair.first) && has(pair.second); }
  [[nodiscard]] bool has(const Refinement& refinement) const {
    const auto its = [&](const auto& id) { return has(id); };
    return std::ranges::all_of(refinement.submaps, its) && std::ranges::all_of(refinement.closed, its) &&
           std::ranges::all_of(refinement.T_world_body,
                               [&](const auto& of) { return !chains_.contains(of.first.chain); });
  }

 private:
  const LaterChains& chains_;
};

/// The row of table `meta`, or none, in a map that ends before version `until`, and has the robots `stays`.
NewRows meta_without(std::string_view key, std::string_view bytes, const Without& without,
                     const std::set<RobotId>& stays, std::uint64_t until) {
  const auto same_if = [&](bool is_kept) {
    return is_kept ? NewRows{{map_tables::kMeta, std::string(key), std::string(bytes)}} : NewRows();
  };
  const MetaRow& row = meta_row(key);
  if (row.revert_drops) return {};
  switch (row.of) {
    using enum MetaRow::Of;
    case map:
      return same_if(true);
    case version:
      return same_if(number_of(key).value_or(until) < until);
    case robot: {
      const auto number = node::RobotRegistry::robot_of(key);
      return same_if(!number || stays.contains(*number));
    }
    case submap: {
      const auto id = node::submap_of_key(key.substr(row.key.size()));
      return same_if(id && without.has(*id));
    }
    case place: {
      auto known = node::place_of_row(key, bytes);
      if (!known || !without.has(known->first)) return {};
      std::erase_if(known->second.candidates, [&](const server::Alike& alike) { return !without.has(alike.submap); });
      return {node::to_row(known->first, known->second)};
    }
    case refinement: {
      const auto known = wire::decode_refinement(bytes);
      return same_if(known && without.has(*known));
    }
  }
  return {};
}

/// Everything but what later versions, from number `until` on, added.
Status copy_without(const TableStore& map, const LaterChains& later, std::uint64_t until, TableStore& to) {
  const Without without(later);
  std::set<RobotId> stays;
  const auto pairs_of = [&](const char* table) {
    return [&, table](std::string_view key, std::string_view bytes) {
      const auto pair = node::pair_of(key);
      return pair && without.has(*pair) ? NewRows{{table, std::string(key), std::string(bytes)}} : NewRows();
    };
  };
  const auto submap = [&](std::string_view key, std::string_view bytes) {
    const auto id = node::submap_of_key(key);
    if (!id || !without.has(*id)) return NewRows();
    stays.insert(id->chain.robot);
    return NewRows{{map_tables::kSubmaps, std::string(key), std::string(bytes)}};
  };
  const auto refusals = [&](std::string_view, std::string_view bytes) {
    return refusals_of(bytes, [&](const ClosureVerdict& refused) { return without.has(refused.pair); });
  };
  const auto meta = [&](std::string_view key, std::string_view bytes) {
    return meta_without(key, bytes, without, stays, until);
  };
  return copy_changed(map,
                      {{map_tables::kSubmaps, submap},
                       {map_tables::kVerdicts, pairs_of(map_tables::kVerdicts)},
                       {map_tables::kDecisions, pairs_of(map_tables::kDecisions)},
                       {map_tables::kAnswers, refusals},
                       {map_tables::kMeta, meta}},  // last: it has the robots whose submaps stay
                      to);
}

}  // namespace

storage::Write to_row(const Version& version) {
  std::string bytes = storage::key_of({static_cast<std::uint64_t>(version.held_ns)});
  for (const ChainId& chain : version.chains) bytes += storage::key_of({chain.robot.value, chain.session});
  return {map_tables::kMeta, fmt::format("{}{}", node::kVersionPrefix, version.number), std::move(bytes)};
}

Result<std::vector<Version>> versions(const TableStore& map) {
  std::vector<Version> out;
  const Status ok = node::each_row_of(map, node::kVersionPrefix, [&](std::string_view key, auto bytes) -> Status {
    auto version = version_of(key, bytes);
    if (!version)
      return fail(ErrorCode::parse, "the row '{}' of table 'meta' is damaged, expected a version's sessions", key);
    out.push_back(std::move(*version));
    return {};
  });
  if (!ok) return tl::unexpected(ok.error());
  std::ranges::sort(out, {}, &Version::number);
  Version newest{.number = out.empty() ? 1 : out.back().number + 1};
  const auto sized = map.sizes(map_tables::kSubmaps, [&](std::string_view key, std::size_t) {
    if (const auto id = node::submap_of_key(key)) newest.chains.insert(id->chain);
  });
  if (!sized) return tl::unexpected(sized.error());
  for (const Version& version : out)
    for (const ChainId& chain : version.chains) newest.chains.erase(chain);
  if (out.empty() || !newest.chains.empty()) out.push_back(std::move(newest));
  return out;
}

std::vector<VersionSize> sizes_of(const std::vector<Version>& all, const Content& content,
                                  const server::MapEstimate& map) {
  std::vector<VersionSize> out(all.size());
  std::map<ChainId, std::size_t> added_by;
  for (std::size_t k = 0; k < all.size(); ++k)
    for (const ChainId& chain : all[k].chains) added_by.emplace(chain, k);
  for (const auto& [id, submap] : content.submaps) {
    const auto by = added_by.find(id.chain);
    if (by == added_by.end()) continue;
    VersionSize& size = out[by->second];
    ++size.submaps;
    size.keyframes += submap->keyframes.size();
    size.minutes += (submap->keyframes.back().stamp - submap->keyframes.front().stamp) / 60.0;
  }
  for (const server::JudgedClosure& judged : map.closures) {
    const auto from = added_by.find(judged.closure.from.chain), to = added_by.find(judged.closure.to.chain);
    if (!judged.accepted || from == added_by.end() || to == added_by.end()) continue;
    VersionSize& later = out[std::max(from->second, to->second)];
    ++(from->second == to->second ? later.own_closures : later.earlier_closures);
  }
  return out;
}

Result<std::size_t> revert(const std::filesystem::path& map, std::uint64_t number, const std::filesystem::path& out) {
  const auto from = open_copy(map);
  if (!from) return tl::unexpected(from.error());
  const auto all = versions(**from);
  if (!all) return in_context(map.string(), all.error());
  const auto at = std::ranges::find(*all, number, &Version::number);
  if (at == all->end() || at + 1 == all->end())
    return fail(ErrorCode::invalid, "{}: has versions 1 to {}, expected one before the last, not {}", map.string(),
                all->back().number, number);
  LaterChains later;
  for (auto version = at + 1; version != all->end(); ++version) later.merge(LaterChains(version->chains));
  std::size_t left_out = 0;
  const auto sized = (*from)->sizes(map_tables::kSubmaps, [&](std::string_view key, std::size_t) {
    const auto id = node::submap_of_key(key);
    left_out += id && later.contains(id->chain) ? 1 : 0;
  });
  if (!sized) return tl::unexpected(sized.error());
  const Status made = make_map(out, [&](TableStore& to) { return copy_without(**from, later, number + 1, to); });
  if (!made) return tl::unexpected(made.error());
  return left_out;
}

}  // namespace tutti::mapfile
