// SPDX-License-Identifier: BSD-3-Clause
// The marks that operators have put on the map, as messages.
#include <fmt/format.h>

#include "tutti/node/marks.hpp"
#include "tutti/program/field_json.hpp"
#include "tutti/program/page/base64.hpp"
#include "tutti/program/page/view.hpp"

namespace tutti::page {

Message mark_message(std::uint64_t number, const MapMark& mark, const std::string& photo, double time_s) {
  const std::string id = std::to_string(number);
  return {"mark/" + id, time_s,
          text_of({{"id", id},
                   {"submap", to_string(mark.submap)},
                   {"at", {mark.at.x(), mark.at.y(), mark.at.z()}},
                   {"text", mark.text},
                   {"by", mark.by},
                   {"wall_ns", mark.given_ns},
                   {"photo", photo.empty() ? FieldJson(nullptr) : FieldJson(photo)}})};
}

Result<std::vector<Message>> marks_with_photos(const storage::TableStore& map, double time_s) {
  const auto marks = node::read_marks(map);
  if (!marks) return tl::unexpected(marks.error());
  std::vector<Message> out;
  for (const auto& [number, mark] : *marks) {
    const auto photo = node::read_photo(map, number);
    if (!photo) return tl::unexpected(photo.error());
    const std::string_view type = *photo ? picture_type(**photo) : std::string_view();
    out.push_back(mark_message(number, mark,
                               type.empty() ? "" : fmt::format("data:{};base64,{}", type, base64(**photo)), time_s));
  }
  return out;
}

}  // namespace tutti::page
