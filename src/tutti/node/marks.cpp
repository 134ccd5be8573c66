// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/marks.hpp"

#include <fmt/format.h>

#include <charconv>
#include <string_view>
#include <utility>

#include "tutti/node/map_meta.hpp"
#include "tutti/node/meta_keys.hpp"
#include "tutti/node/picture.hpp"
#include "tutti/storage/map_tables.hpp"
#include "tutti/wire/field_bytes.hpp"

namespace tutti::node {
namespace {

std::string key(std::string_view prefix, std::uint64_t number) { return fmt::format("{}{:020}", prefix, number); }

std::optional<std::uint64_t> number_of(std::string_view key, std::string_view prefix) {
  key.remove_prefix(prefix.size());
  std::uint64_t out = 0;
  const auto [end, error] = std::from_chars(key.data(), key.data() + key.size(), out);
  return error == std::errc() && end == key.data() + key.size() ? std::optional(out) : std::nullopt;
}

Status check(const MapMark& mark, const std::string& photo, std::size_t known) {
  if (known >= kMostMarks) return fail(ErrorCode::invalid, "the map has {} marks already: remove one first", known);
  if (photo.size() > MapMark::kMostPhotoBytes)
    return fail(ErrorCode::invalid, "the photo has {} bytes, expected at most {}", photo.size(),
                MapMark::kMostPhotoBytes);
  if (!photo.empty())
    if (Status ok = check_picture(photo); !ok) return ok;
  if (mark.text.empty() && photo.empty()) return fail(ErrorCode::invalid, "a mark has a text or a photo");
  if (auto ok = wire::check_fields(mark); !ok) return in_context("mark", ok.error());
  return {};
}

}  // namespace

Result<MarkSet> read_marks(const storage::TableStore& map) {
  MarkSet out;
  const Status ok = each_row_of(map, kMarkPrefix, [&](std::string_view key, std::string_view bytes) {
    const auto number = number_of(key, kMarkPrefix);
    auto mark = wire::read_fields<MapMark>(bytes);
    if (number && mark && wire::check_fields(*mark)) out.emplace(*number, std::move(*mark));
    return Status();
  });
  if (!ok) return tl::unexpected(ok.error());
  return out;
}

Result<std::optional<std::string>> read_photo(const storage::TableStore& map, std::uint64_t number) {
  return map.read(map_tables::kMeta, key(kPhotoPrefix, number));
}

Result<std::vector<storage::Write>> follow(const MarkOrder& order, MarkSet& known) {
  const auto found = known.find(order.number);
  std::vector<storage::Write> rows{{map_tables::kMeta, key(kMarkPrefix, order.number), std::nullopt},
                                   {map_tables::kMeta, key(kPhotoPrefix, order.number), std::nullopt}};
  if (!order.mark) {
    if (found == known.end()) return fail(ErrorCode::invalid, "there is no such mark");
    known.erase(found);
    return rows;
  }
  MapMark mark = *order.mark;
  mark.photo_type = picture_type(order.photo);
  if (found != known.end() && found->second != mark)
    return fail(ErrorCode::invalid, "mark {}: there is another one of this number", order.number);
  if (auto ok = check(mark, order.photo, known.size() - known.count(order.number)); !ok)
    return tl::unexpected(ok.error());
  rows.front().bytes = wire::field_bytes(mark);
  if (!order.photo.empty()) rows.back().bytes = order.photo;
  known.insert_or_assign(order.number, std::move(mark));
  return rows;
}

}  // namespace tutti::node
