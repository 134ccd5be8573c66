// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/known_map.hpp"

#include <utility>

#include "tutti/mapfile/placement.hpp"
#include "tutti/node/submap_frames.hpp"
#include "tutti/perception/lidar/submap_middle.hpp"
#include "tutti/storage/map_tables.hpp"

namespace tutti::mapfile {
namespace {

/// The payloads of the submaps of a file, which it keeps open.
class FilePayloads final : public server::PayloadStore {
 public:
  explicit FilePayloads(std::unique_ptr<storage::TableStore> file)
      : file_(std::move(file)), frames_(node::SubmapFrames::of(*file_)) {}
  Status put(const Submap&) override { return {}; }
  [[nodiscard]] Result<std::shared_ptr<const PointCloud>> cloud(SubmapId id) const override {
    return frames_->cloud(id);
  }
  [[nodiscard]] Result<std::shared_ptr<const VisualPayload>> visual(SubmapId id) const override {
    return frames_->visual(id);
  }

 private:
  std::unique_ptr<storage::TableStore> file_;
  std::shared_ptr<node::SubmapFrames> frames_;
};

/// By the map's first submap, which it keeps.
Result<std::string> id_of(const Content& content, const storage::TableStore& map) {
  if (content.submaps.empty()) return std::string();
  const auto first = map.read(map_tables::kSubmaps, node::key_of(content.submaps.begin()->first));
  if (!first) return tl::unexpected(first.error());
  return localise::map_id_of(first->value_or(""));
}

}  // namespace

Result<OpenedMap> open_known_map(const std::filesystem::path& file) {
  auto store = open_copy(file);
  if (!store) return tl::unexpected(store.error());
  auto content = read(**store);
  if (!content) return in_context(file.string(), content.error());
  const auto places = node::read_places(**store);
  if (!places) return in_context(file.string(), places.error());
  OpenedMap out{.known = {}, .content = std::move(*content), .estimate = {}};
  out.estimate = estimate(out.content);
  out.floors = Floors::of(out.content, out.estimate);
  auto known = std::make_shared<localise::KnownMap>();
  const auto map_id = id_of(out.content, **store);
  if (!map_id) return in_context(file.string(), map_id.error());
  known->id = *map_id;
  known->revision = out.content.meta.revision;
  known->names = out.content.closure_names();
  known->floors = out.floors.count();
  for (const auto& [id, submap] : out.content.submaps) {
    const auto size = out.content.payload_sizes.find(id);
    if (size == out.content.payload_sizes.end()) continue;
    const auto where = place(*submap, out.estimate);
    const auto floor = where ? out.floors.of_component(where->component) : std::nullopt;
    if (!floor) {
      ++out.left_out;
      continue;
    }
    localise::KnownMap::Entry entry{
        .submap = submap, .T_world_submap = where->T_world_submap, .size = size->second, .floor = *floor};
    entry.middle = where->T_world_submap * lidar::find_middle(*submap).T_submap_keyframe.translation;
    if (const auto looks = places->find(id); looks != places->end()) entry.place = looks->second.looks;
    known->submaps.emplace(id, std::move(entry));
  }
  if (known->submaps.empty())
    return fail(ErrorCode::invalid,
                "{}: no submap has a cloud or images, expected a map of robots with LiDAR or cameras", file.string());
  known->payloads = std::make_shared<const FilePayloads>(std::move(*store));
  out.known = std::move(known);
  return out;
}

}  // namespace tutti::mapfile
