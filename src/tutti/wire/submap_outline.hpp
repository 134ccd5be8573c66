// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string_view>

#include "tutti/base/result.hpp"
#include "tutti/model/submap.hpp"

namespace tutti::wire {

struct SubmapOutline {
  Submap submap;  ///< Without its payloads.
  PayloadSize size;
};

/// What decode_submap() says of a submap's way, and of its payloads how much they are, for a fraction of the time: the
/// payloads are not decoded, nor validated. For frames that were decoded when they came and are known not to have
/// changed since.
Result<SubmapOutline> decode_outline(std::string_view bytes);

}  // namespace tutti::wire
