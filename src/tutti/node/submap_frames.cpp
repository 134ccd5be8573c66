// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/submap_frames.hpp"

#include <charconv>

#include "tutti/storage/map_tables.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::node {

std::string key_of(SubmapId id) { return storage::key_of({id.chain.robot.value, id.chain.session, id.index}); }

std::optional<SubmapId> submap_of_key(std::string_view key) {
  const auto numbers = storage::numbers_of(key, 3);
  if (!numbers) return std::nullopt;
  const SubmapId id{{RobotId{static_cast<std::uint32_t>((*numbers)[0])}, (*numbers)[1]},
                    static_cast<std::uint32_t>((*numbers)[2])};
  return key == key_of(id) ? std::optional(id) : std::nullopt;  // numbers of 32 bits
}

std::string message_id(SubmapId id, std::uint32_t incarnation) {
  const std::string plain = fmt::format("{}/{}/{}", id.chain.robot.value, id.chain.session, id.index);
  return incarnation == 0 ? plain : fmt::format("{}/{:08x}", plain, incarnation);
}

std::optional<SubmapId> submap_of(std::string_view message_id) {
  SubmapId id;
  std::uint32_t incarnation = 0;
  const char* at = message_id.data();
  const char* const end = at + message_id.size();
  const auto read = [&](auto& number, int base) {
    const auto [stop, error] = std::from_chars(at, end, number, base);
    at = stop;
    return error == std::errc();
  };
  const auto skip = [&] { return at != end && *at++ == '/'; };
  if (!read(id.chain.robot.value, 10) || !skip() || !read(id.chain.session, 10) || !skip() || !read(id.index, 10))
    return std::nullopt;
  if (at != end && (!skip() || !read(incarnation, 16) || at != end)) return std::nullopt;
  return id;
}

std::shared_ptr<SubmapFrames> SubmapFrames::of(const storage::TableStore& map) {
  return std::make_shared<SubmapFrames>([&map](SubmapId id) { return map.read(map_tables::kSubmaps, key_of(id)); });
}

Result<std::string> SubmapFrames::frame(SubmapId id) const {
  auto found = fetch_(id);
  if (!found) return tl::unexpected(found.error());
  if (!*found) return fail(ErrorCode::io, "submap {} is not in the map", to_string(id));
  return std::move(**found);
}

Result<Submap> SubmapFrames::decode(SubmapId id) const {
  const auto frame = this->frame(id);
  if (!frame) return tl::unexpected(frame.error());
  auto message = wire::decode_submap(*frame);
  if (!message) return in_context("submap " + to_string(id), message.error());
  if (message->submap.id != id)
    return fail(ErrorCode::invalid, "submap {} in the place of {}", to_string(message->submap.id), to_string(id));
  return std::move(message->submap);
}

Result<std::shared_ptr<const Submap>> SubmapFrames::submap(SubmapId id) const {
  {
    const std::scoped_lock lock(mutex_);
    if (const auto kept = kept_.find(id); kept != kept_.end()) return kept->second;
  }
  auto decoded = decode(id);
  if (!decoded) return tl::unexpected(decoded.error());
  const auto submap = std::make_shared<const Submap>(without_payloads(std::move(*decoded)));
  const std::scoped_lock lock(mutex_);
  // Jobs go through all submaps in the order of their ids, again and again: most of them are there every time.
  if (kept_.size() >= kMostKept) kept_.erase(kept_.begin());
  kept_.insert_or_assign(id, submap);
  return submap;
}

Result<std::shared_ptr<const PointCloud>> SubmapFrames::cloud(SubmapId id) const {
  auto decoded = decode(id);
  if (!decoded) return tl::unexpected(decoded.error());
  return std::move(decoded->cloud);
}

Result<std::shared_ptr<const VisualPayload>> SubmapFrames::visual(SubmapId id) const {
  auto decoded = decode(id);
  if (!decoded) return tl::unexpected(decoded.error());
  return std::move(decoded->visual);
}

}  // namespace tutti::node
