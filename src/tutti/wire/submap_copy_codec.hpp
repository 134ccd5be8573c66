// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "tutti/base/result.hpp"
#include "tutti/model/submap_copy.hpp"

/// As wire/codec.hpp, for workers' requests of submaps and the server's copies. Exact.
namespace tutti::wire {

std::string encode(const SubmapRequest& request);
Result<SubmapRequest> decode_submap_request(std::string_view bytes);
std::string encode(const SubmapCopy& copy);
Result<SubmapCopy> decode_submap_copy(std::string_view bytes);

/// A request names at most 1000 submaps.
Status validate(const SubmapRequest& request);
/// A copy carries a frame that is not empty and for which a message has room. The content of the frame is checked by
/// decode_submap(), not here.
Status validate(const SubmapCopy& copy);

}  // namespace tutti::wire
