// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string_view>

#include "tutti/base/result.hpp"
#include "tutti/model/submap.hpp"

namespace tutti::wire {

/// A submap without its payloads, and how large these are.
struct SubmapOutline {
  Submap submap;  ///< Without its payloads.
  PayloadSize size;
};

/// Decodes keyframes and odometry as decode_submap() does, and of the payloads only their sizes, for a fraction of the
/// time. The payloads are not validated: use it for frames that decode_submap() has accepted before and whose bytes are
/// known not to have changed since. Errors as of decode_submap().
Result<SubmapOutline> decode_outline(std::string_view bytes);

}  // namespace tutti::wire
