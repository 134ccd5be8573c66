// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "tutti/base/fields.hpp"
#include "tutti/base/ids.hpp"

namespace tutti {

/// A note that somebody has made on the map: a place in a submap, so that it moves with the map, and a text.
struct MapMark {
  static constexpr std::size_t kMostBytes = 2'000;           ///< The text may have so many,
  static constexpr std::size_t kMostPhotoBytes = 1U << 20U;  ///< and the photo, which is kept beside it.
  static constexpr double kFarthest_m = 1'000.0;             ///< From the submap's first keyframe.

  SubmapId submap;
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
  std::string text;
  std::string by;
  std::int64_t given_ns = 0;
  std::string photo_type;
  template <class V>
  void describe(V& v) {
    constexpr std::size_t kLongestName = 200;
    v.field(1, "submap", submap);
    v.field(2, "x", at.x(), {.low = -kFarthest_m, .high = kFarthest_m}, "In the submap's frame, m.");
    v.field(3, "y", at.y(), {.low = -kFarthest_m, .high = kFarthest_m});
    v.field(4, "z", at.z(), {.low = -kFarthest_m, .high = kFarthest_m});
    v.field(5, "text", text, {.text = FieldRule::Text::any, .at_most = kMostBytes}, "UTF-8, any; may be empty.");
    v.field(6, "by", by, {.at_most = kLongestName}, "Who wrote it, for people; may be empty.");
    v.field(7, "given_ns", given_ns, {}, "Since the Unix epoch.");
    v.field(8, "photo_type", photo_type, {.at_most = 16}, "'image/jpeg' or 'image/png'; empty: there is no photo.");
  }
  friend bool operator==(const MapMark&, const MapMark&) = default;
};

/// An operator's order to the server: a mark to be stored under a number, or, without a mark, to be removed.
struct MarkOrder {
  std::uint64_t number = 0;
  std::optional<MapMark> mark;
  std::string photo = {};
  std::int64_t given_ns = 0;
  std::string by = {};
  template <class V>
  void describe(V& v) {
    v.field(1, "number", number);
    v.field(2, "mark", mark);
    v.field(3, "photo", photo, {.text = FieldRule::Text::any, .at_most = MapMark::kMostPhotoBytes},
            "The mark's, a JPEG or PNG file; may be empty.");
    v.field(4, "given_ns", given_ns, {}, "By the operator's clock.");
    v.field(5, "by", by, {.at_most = 200}, "For people.");
  }
  friend bool operator==(const MarkOrder&, const MarkOrder&) = default;
};

/// By number, which never names another mark.
using MarkSet = std::map<std::uint64_t, MapMark>;

/// The type of a picture that the page can show, by what its bytes begin with; empty: it is none of these.
constexpr std::string_view picture_type(std::string_view bytes) {
  if (bytes.starts_with("\xff\xd8\xff")) return "image/jpeg";
  if (bytes.starts_with("\x89PNG\r\n\x1a\n")) return "image/png";
  return {};
}

}  // namespace tutti
