// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/map_beside.hpp"

#include <unordered_map>
#include <vector>

#include "tutti/base/file.hpp"
#include "tutti/mapfile/estimate_file.hpp"
#include "tutti/node/decisions.hpp"
#include "tutti/node/map_meta.hpp"
#include "tutti/storage/map_tables.hpp"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/submap_outline.hpp"

namespace tutti::mapfile {
namespace {

using Sizes = std::map<std::string, std::size_t>;

Result<Sizes> sizes_of(const storage::TableStore& store, const char* table) {
  Sizes out;
  const Status ok = store.sizes(table, [&](std::string_view key, std::size_t size) { out.emplace(key, size); });
  return ok ? Result<Sizes>(std::move(out)) : tl::unexpected(ok.error());
}

/// Fills in what the submaps state of a map's nodes.
void complete(std::vector<MapNode>& nodes, const server::SubmapSet& submaps) {
  std::unordered_map<KeyframeId, const Keyframe*> keyframes;
  for (const auto& [id, submap] : submaps)
    for (const Keyframe& keyframe : submap->keyframes) keyframes.try_emplace({id.chain, keyframe.index}, &keyframe);
  for (MapNode& node : nodes)
    if (const auto found = keyframes.find(node.id); found != keyframes.end()) {
      node.stamp = found->second->stamp;
      node.representative = found->second->representative;
      node.T_odom_body = found->second->T_odom_body;
    }
}

}  // namespace

MapBeside::Written MapBeside::written() const {
  std::error_code none;
  const auto time = std::filesystem::last_write_time(estimate_, none);
  const std::uintmax_t size = none ? 0 : std::filesystem::file_size(estimate_, none);
  return none ? Written() : Written(time, size);
}

bool MapBeside::has_news() const {
  const Written now = written();
  return now != Written() && now != read_;
}

/// Submaps never change. A verdict does when the server has another verifier.
Status MapBeside::read_rows() {
  const auto submaps = sizes_of(store_, map_tables::kSubmaps);
  if (!submaps) return tl::unexpected(submaps.error());
  for (const auto& [key, size] : *submaps) {
    const auto numbers = storage::numbers_of(key, 3);
    if (!numbers) continue;
    const SubmapId id{{RobotId{static_cast<std::uint32_t>((*numbers)[0])}, (*numbers)[1]},
                      static_cast<std::uint32_t>((*numbers)[2])};
    if (content_.submaps.contains(id)) continue;
    const auto row = store_.read(map_tables::kSubmaps, key);
    if (!row) return tl::unexpected(row.error());
    auto outline = *row ? wire::decode_outline(**row) : Result<wire::SubmapOutline>(fail(ErrorCode::io, "gone"));
    if (!outline) continue;  // of a version that is not read; the server reports it
    if (outline->size != PayloadSize()) content_.payload_sizes[id] = outline->size;
    content_.submaps[id] = std::make_shared<const Submap>(std::move(outline->submap));
  }
  auto verdicts = sizes_of(store_, map_tables::kVerdicts);
  if (!verdicts) return tl::unexpected(verdicts.error());
  for (const auto& [key, size] : *verdicts) {
    if (const auto known = verdicts_.find(key); known != verdicts_.end() && known->second == size) continue;
    const auto row = store_.read(map_tables::kVerdicts, key);
    if (!row) return tl::unexpected(row.error());
    auto verdict = *row ? wire::decode_verdict(**row) : Result<ClosureVerdict>(fail(ErrorCode::io, "gone"));
    if (verdict) content_.verdicts.insert_or_assign(verdict->pair, std::move(*verdict));
  }
  std::erase_if(content_.verdicts, [&](const auto& entry) { return !verdicts->contains(node::key_of(entry.first)); });
  verdicts_ = std::move(*verdicts);
  auto decisions = node::read_decisions(store_, [](const std::string&) {});
  if (!decisions) return tl::unexpected(decisions.error());
  content_.decisions = std::move(*decisions);
  auto names = node::read_robot_names(store_);
  if (!names) return tl::unexpected(names.error());
  content_.names = std::move(*names);
  return {};
}

Result<std::shared_ptr<const ShownMap>> MapBeside::newest() {
  const Written now = written();
  const auto bytes = read_file(estimate_.string());
  if (!bytes) return tl::unexpected(bytes.error());
  read_ = now;  // also one that is of no use: it is not decoded again and again
  auto computed = decode_estimate(*bytes);
  if (!computed) return in_context(estimate_.string(), computed.error());
  const auto meta = node::read_map_meta(store_);
  if (!meta) return tl::unexpected(meta.error());
  if (!*meta || (*meta)->epoch != computed->epoch) return nullptr;  // left of a map that was here before
  if (Status ok = read_rows(); !ok) {
    read_ = {};  // the store may give them later
    return tl::unexpected(ok.error());
  }
  complete(computed->map.nodes, content_.submaps);
  return std::make_shared<const ShownMap>(ShownMap{.revision = computed->revision,
                                                   .time = computed->time,
                                                   .content = content_,
                                                   .map = std::move(computed->map),
                                                   .broadcast = std::move(computed->broadcast)});
}

}  // namespace tutti::mapfile
