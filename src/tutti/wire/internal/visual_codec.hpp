// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "tutti/base/result.hpp"
#include "tutti/model/submap.hpp"

namespace tutti::v1 {
class Visual;
}

namespace tutti::wire {

/// Encodes what the cameras saw along a submap that begins with keyframe `first_keyframe`.
void encode_visual(const VisualPayload& visual, std::uint32_t first_keyframe, v1::Visual& out);
/// Indices are in range of what they point at; all else is for check_visual() to judge.
Result<std::shared_ptr<const VisualPayload>> decode_visual(const v1::Visual& in, std::uint32_t first_keyframe);

/// Is submap.visual, not null, sound and of this submap?
Status check_visual(const Submap& submap);

}  // namespace tutti::wire
