// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/map_meta.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "tutti/base/config_io.hpp"
#include "tutti/node/meta_keys.hpp"
#include "tutti/node/robot_registry.hpp"
#include "tutti/node/submap_frames.hpp"
#include "tutti/wire/refinement_codec.hpp"

namespace tutti::node {
Status each_row_of(const storage::TableStore& map, std::string_view prefix,
                   const std::function<Status(std::string_view key, std::string_view bytes)>& visit) {
  Status ok;
  const auto scanned = map.scan(map_tables::kMeta, prefix, [&](std::string_view key, std::string_view bytes) {
    if (!key.starts_with(prefix)) return false;
    ok = visit(key, bytes);
    return ok.has_value();
  });
  return scanned ? ok : scanned;
}

storage::Write to_row(const MapMeta& meta) {
  return {map_tables::kMeta, std::string(kMapKey),
          storage::key_of({meta.epoch, meta.revision, meta.news ? 1U : 0U, meta.start})};
}

Result<std::optional<MapMeta>> read_map_meta(const storage::TableStore& map) {
  const auto row = map.read(map_tables::kMeta, kMapKey);
  if (!row) return tl::unexpected(row.error());
  if (!*row) return std::nullopt;
  const auto numbers = storage::numbers_of(**row, 4);
  if (!numbers) return fail(ErrorCode::parse, "the map's own row has {} bytes, expected 32", (*row)->size());
  return MapMeta{(*numbers)[0], (*numbers)[1], (*numbers)[2] != 0, (*numbers)[3]};
}

storage::Write to_row(const MapCounts& counts) {
  return {map_tables::kMeta, std::string(kCountsKey),
          storage::key_of({counts.revision, counts.keyframes, counts.closures, counts.components})};
}

Result<std::optional<MapCounts>> read_map_counts(const storage::TableStore& map) {
  const auto row = map.read(map_tables::kMeta, kCountsKey);
  if (!row) return tl::unexpected(row.error());
  const auto numbers = storage::numbers_of(row->value_or(""), 4);
  if (!numbers) return std::nullopt;
  return MapCounts{(*numbers)[0], (*numbers)[1], (*numbers)[2], (*numbers)[3]};
}

storage::Write to_row(const LastUpdate& update) {
  return {
      map_tables::kMeta, std::string(kLastUpdateKey),
      storage::key_of({std::bit_cast<std::uint64_t>(update.begun.ns), std::bit_cast<std::uint64_t>(update.cost_s)})};
}

Result<std::optional<LastUpdate>> read_last_update(const storage::TableStore& map) {
  constexpr double kMost_s = 3600.0;
  const auto row = map.read(map_tables::kMeta, kLastUpdateKey);
  if (!row) return tl::unexpected(row.error());
  const auto numbers = storage::numbers_of(row->value_or(""), 2);
  if (!numbers) return std::nullopt;
  const auto cost_s = std::bit_cast<double>((*numbers)[1]);
  if (!(cost_s >= 0.0)) return std::nullopt;
  return LastUpdate{{std::bit_cast<std::int64_t>((*numbers)[0])}, std::min(cost_s, kMost_s)};
}

storage::Write to_row(const server::ServerConfig& settings) {
  return {map_tables::kMeta, std::string(kSettingsKey), to_yaml(dump_config(settings))};
}

Result<server::ServerConfig> read_settings(const storage::TableStore& map) {
  server::ServerConfig settings;
  const auto row = map.read(map_tables::kMeta, kSettingsKey);
  if (!row) return tl::unexpected(row.error());
  if (!*row) return settings;
  const auto node = parse_yaml(**row, "the map's settings");
  if (!node) return tl::unexpected(node.error());
  ConfigLoader loader;
  loader.load(*node, settings);
  if (auto ok = loader.finish_with_unknown("the map's settings"); !ok) return tl::unexpected(ok.error());
  return settings;
}

std::string refinement_key(std::uint64_t revision) { return fmt::format("{}{:020}", kRefinementPrefix, revision); }

Result<server::Refinements> read_refinements(const storage::TableStore& map) {
  server::Refinements refinements;
  const Status ok = each_row_of(map, kRefinementPrefix, [&](std::string_view, std::string_view bytes) {
    if (auto refinement = wire::decode_refinement(bytes)) refinements.add(std::move(*refinement));
    return Status();
  });
  if (!ok) return tl::unexpected(ok.error());
  return refinements;
}

std::string place_key(SubmapId id) { return std::string(kPlacePrefix) + key_of(id); }

storage::Write to_row(SubmapId id, const server::Place& place) {
  std::string bytes = storage::key_of({place.is_ranked ? 1U : 0U, place.candidates.size()});
  for (const auto& [other, likeness, sensor] : place.candidates)
    bytes += storage::key_of({other.chain.robot.value, other.chain.session,
                              other.index + (std::uint64_t{sensor} << 32U), std::bit_cast<std::uint64_t>(likeness)});
  return {map_tables::kMeta, place_key(id), bytes + place.looks};
}

std::optional<std::pair<SubmapId, server::Place>> place_of_row(std::string_view key, std::string_view bytes) {
  constexpr std::size_t kHead = 16, kNumbers = 4, kCandidate = 8 * kNumbers;
  if (!key.starts_with(kPlacePrefix)) return std::nullopt;
  const auto id = submap_of_key(key.substr(kPlacePrefix.size()));
  const auto head = storage::numbers_of(bytes.substr(0, kHead), 2);
  if (!id || !head) return std::nullopt;
  bytes.remove_prefix(kHead);
  const std::uint64_t candidates = (*head)[1];
  if (candidates > bytes.size() / kCandidate) return std::nullopt;
  const auto numbers = storage::numbers_of(bytes.substr(0, kCandidate * candidates), kNumbers * candidates);
  bytes.remove_prefix(kCandidate * candidates);
  server::Place place{.looks = {}, .is_ranked = (*head)[0] != 0, .candidates = {}};
  place.candidates.reserve(candidates);
  for (auto at = numbers->begin(); at != numbers->end(); at += kNumbers) {
    const std::uint64_t robot = at[0], index = at[2], sensor = index >> 32U;
    const auto likeness = std::bit_cast<double>(at[3]);
    if (robot >> 32U != 0 || sensor >= server::ClosureVerifier::kMostSensors || !std::isfinite(likeness))
      return std::nullopt;
    const SubmapId other{{RobotId{static_cast<std::uint32_t>(robot)}, at[1]}, static_cast<std::uint32_t>(index)};
    place.candidates.push_back({other, likeness, static_cast<std::uint32_t>(sensor)});
  }
  place.looks = bytes;
  return std::pair(*id, std::move(place));
}

Result<server::PlaceSet> read_places(const storage::TableStore& map) {
  server::PlaceSet places;
  const Status ok = each_row_of(map, kPlacePrefix, [&](std::string_view key, std::string_view bytes) {
    if (auto place = place_of_row(key, bytes)) places.insert(std::move(*place));
    return Status();
  });
  if (!ok) return tl::unexpected(ok.error());
  return places;
}

storage::Write to_row(SubmapId id, const std::vector<std::pair<std::uint32_t, server::HeldPose>>& held) {
  std::string bytes;
  const auto bits = [](double value) { return std::bit_cast<std::uint64_t>(value); };
  for (const auto& [index, pose] : held) {
    const Eigen::Vector3d& t = pose.T_world_body.translation;
    const Eigen::Quaterniond& q = pose.T_world_body.rotation;
    bytes += storage::key_of({index | std::uint64_t{pose.floor} << 32U, bits(t.x()), bits(t.y()), bits(t.z()),
                              bits(q.x()), bits(q.y()), bits(q.z()), bits(q.w())});
  }
  return {map_tables::kMeta, std::string(kHeldPrefix) + key_of(id), std::move(bytes)};
}

Result<server::HeldPoses> read_held_poses(const storage::TableStore& map) {
  constexpr std::size_t kNumbers = 8;
  server::HeldPoses held;
  const Status ok = each_row_of(map, kHeldPrefix, [&](std::string_view key, std::string_view bytes) -> Status {
    const auto id = submap_of_key(key.substr(kHeldPrefix.size()));
    const std::size_t poses = bytes.size() / (8 * kNumbers);
    const auto numbers = storage::numbers_of(bytes, kNumbers * poses);
    if (!id || !numbers)
      return fail(ErrorCode::parse, "the row '{}' of table 'meta' is damaged, expected poses that are held", key);
    const auto value = [&](std::size_t at) { return std::bit_cast<double>((*numbers)[at]); };
    for (std::size_t at = 0; at < numbers->size(); at += kNumbers) {
      const Pose3 pose{{value(at + 7), value(at + 4), value(at + 5), value(at + 6)},
                       {value(at + 1), value(at + 2), value(at + 3)}};
      if (!is_valid(pose)) return fail(ErrorCode::parse, "the row '{}' of table 'meta' has no valid poses", key);
      const std::uint64_t index = (*numbers)[at];
      held.emplace(KeyframeId{id->chain, static_cast<std::uint32_t>(index)},
                   server::HeldPose{pose, static_cast<std::uint32_t>(index >> 32U)});
    }
    return {};
  });
  if (!ok) return tl::unexpected(ok.error());
  return held;
}

storage::Write retired_row(SubmapId id) { return {map_tables::kMeta, std::string(kRetiredPrefix) + key_of(id), ""}; }

Result<std::set<SubmapId>> read_retired(const storage::TableStore& map) {
  std::set<SubmapId> out;
  const Status ok = each_row_of(map, kRetiredPrefix, [&](std::string_view key, std::string_view) -> Status {
    const auto id = submap_of_key(key.substr(kRetiredPrefix.size()));
    if (!id) return fail(ErrorCode::parse, "the row '{}' of table 'meta' is damaged, expected a submap's numbers", key);
    out.insert(*id);
    return {};
  });
  if (!ok) return tl::unexpected(ok.error());
  return out;
}

std::string encode(const RobotRow& row) {
  std::string bytes = storage::key_of({row.session, row.former.size(), row.rivals.size()});
  for (const auto* sessions : {&row.former, &row.rivals})
    for (const std::uint64_t session : *sessions) bytes += storage::key_of({session});
  return bytes + row.name;
}

std::optional<RobotRow> decode_robot(std::string_view bytes) {
  const auto head = storage::numbers_of(bytes.substr(0, 24), 3);
  if (!head || (*head)[1] > RobotRow::kMostSessions || (*head)[2] > RobotRow::kMostSessions) return std::nullopt;
  bytes.remove_prefix(24);
  RobotRow row{.session = (*head)[0]};
  for (std::size_t which = 1; which <= 2; ++which)
    for (std::uint64_t i = 0; i < (*head)[which]; ++i) {
      const auto session = storage::numbers_of(bytes.substr(0, 8), 1);
      if (!session) return std::nullopt;
      (which == 1 ? row.former : row.rivals).insert(session->front());
      bytes.remove_prefix(8);
    }
  row.name = bytes;
  return row;
}

Result<std::map<RobotId, std::string>> read_robot_names(const storage::TableStore& map) {
  std::map<RobotId, std::string> names;
  const auto scanned = map.scan(map_tables::kMeta, {}, [&](std::string_view key, std::string_view bytes) {
    const auto robot = RobotRegistry::robot_of(key);
    const auto row = robot ? decode_robot(bytes) : std::nullopt;
    if (row) names[*robot] = row->name;
    return true;
  });
  if (!scanned) return tl::unexpected(scanned.error());
  return names;
}

}  // namespace tutti::node
