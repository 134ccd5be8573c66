// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/format.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "tutti/base/fields.hpp"

namespace tutti {

/// Why a pair of submaps, or a closure, was refused. The numbers are sent and stored, so they are never reused.
enum class RefusalReason : std::uint8_t {
  other = 0,  ///< No reason was given.
  // About one submap, whatever it is compared with.
  too_small = 1,
  too_few_keyframes = 2,
  too_short = 3,  ///< Too short in time, and also in distance.
  // About two clouds.
  unlike_from_above = 4,
  no_alignment = 5,
  overlap = 6,
  plane_rmse = 7,
  misfit = 8,
  free_to_slide = 9,
  viewpoints = 10,
  both_ways_distance = 11,
  both_ways_angle = 12,
  contradicted = 13,
  ambiguous = 14,
  ambiguous_along = 15,
  // About reference closures.
  same_submap = 16,
  neighbours = 17,
  no_reference = 18,
  no_keyframes_near = 19,
  distant = 20,
  // A found closure that contradicts the joint map.
  inconsistent = 21,
  // About one submap's images, whatever they are compared with.
  no_images = 22,
  too_few_landmarks = 23,
  landmark_residual = 24,  ///< Landmarks miss their own pixels: the calibration is wrong.
  // About the images of two submaps.
  descriptor_kinds = 25,
  too_few_matches = 26,
  too_few_inliers = 27,
  position_sigma = 28,
  image_spread = 29,
  // A pair at which every worker failed or crashed.
  unverified = 30,
};

/// The quantity that is measured for a reason, and its words for people and for report.json.
struct RefusalKind {
  enum class Bound { none, at_least, at_most };
  const char* words;
  Bound bound = Bound::none;
  const char* unit = "";
  int digits = 0;  ///< Decimals in text.
};

inline constexpr std::array<RefusalKind, 31> kRefusalKinds = {{
    {"other"},
    {"too small", RefusalKind::Bound::at_least, "points"},
    {"too few keyframes", RefusalKind::Bound::at_least, "keyframes"},
    {"too short", RefusalKind::Bound::at_least, "s", 1},
    {"too unlike from above"},
    {"no alignment comes near"},
    {"overlap", RefusalKind::Bound::at_least, "", 2},
    {"plane RMSE", RefusalKind::Bound::at_most, "m", 3},
    {"misfit", RefusalKind::Bound::at_most, "", 2},
    {"free to slide", RefusalKind::Bound::at_least, "", 3},
    {"viewpoints", RefusalKind::Bound::at_most, "m", 1},
    {"registered both ways", RefusalKind::Bound::at_most, "m", 3},
    {"registered both ways, angle", RefusalKind::Bound::at_most, "deg", 2},
    {"contradicted by what was seen through", RefusalKind::Bound::at_most, "", 2},
    {"ambiguous", RefusalKind::Bound::at_most, "", 2},
    {"ambiguous along it", RefusalKind::Bound::at_most, "", 2},
    {"one and the same submap"},
    {"neighbours", RefusalKind::Bound::at_least, "submaps apart"},
    {"no reference pose"},
    {"no keyframes near each other"},
    {"distant places"},
    {"inconsistent with the others"},
    {"no images"},
    {"too few landmarks", RefusalKind::Bound::at_least, "landmarks"},
    {"landmarks miss their own pixels: wrong calibration", RefusalKind::Bound::at_most, "px", 1},
    {"descriptors of different kinds"},
    {"too few matches", RefusalKind::Bound::at_least, "matches"},
    {"too few inliers", RefusalKind::Bound::at_least, "inliers"},
    {"position sigma", RefusalKind::Bound::at_most, "m", 3},
    {"spread over the image", RefusalKind::Bound::at_least, "", 2},
    {"no worker could verify it"},
}};

/// The kind of a reason; numbers of newer versions count as `other`.
constexpr const RefusalKind& kind_of(RefusalReason reason) {
  return kRefusalKinds[static_cast<std::size_t>(reason) < kRefusalKinds.size() ? static_cast<std::size_t>(reason) : 0];
}

/// A reason with the measured value.
struct Refusal {
  RefusalReason reason = RefusalReason::other;
  double value = 0.0;  ///< In the unit of the reason; 0, like the limit, when nothing is measured.
  double limit = 0.0;
  using InColumns = void;
  template <class V>
  void describe(V& v) {
    v.field(1, "reason", reason, {.low = 0, .high = kRefusalKinds.size() - 1});
    v.field(2, "value", value);
    v.field(3, "limit", limit);
  }
  friend bool operator==(const Refusal&, const Refusal&) = default;
};

/// True if the refusal has a measured value. A value that equals its limit is never refused, so equality means "none".
constexpr bool is_measured(const Refusal& refusal) {
  return kind_of(refusal.reason).bound != RefusalKind::Bound::none && refusal.value != refusal.limit;
}

/// True if the value violates its limit.
constexpr bool misses(const Refusal& measured) {
  const auto bound = kind_of(measured.reason).bound;
  return bound == RefusalKind::Bound::at_least
             ? measured.value < measured.limit
             : bound == RefusalKind::Bound::at_most && measured.value > measured.limit;
}

/// Text such as "overlap: 0.16, at least 0.30 needed".
inline std::string to_string(const Refusal& refusal) {
  const auto& [words, bound, unit, digits] = kind_of(refusal.reason);
  if (!is_measured(refusal)) return words;
  const std::string_view after = *unit == '\0' ? "" : " ";
  return fmt::format("{}: {:.{}f}{}{}, {} {:.{}f} {}", words, refusal.value, digits, after, unit,
                     bound == RefusalKind::Bound::at_least ? "at least" : "at most", refusal.limit, digits,
                     bound == RefusalKind::Bound::at_least ? "needed" : "allowed");
}

}  // namespace tutti
