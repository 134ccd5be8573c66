// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "tutti/base/result.hpp"
#include "tutti/model/submap_copy.hpp"

/// As wire/codec.hpp, for what workers and server say of submaps. Exact.
namespace tutti::wire {

std::string encode(const SubmapRequest& request);
Result<SubmapRequest> decode_submap_request(std::string_view bytes);
std::string encode(const SubmapCopy& copy);
Result<SubmapCopy> decode_submap_copy(std::string_view bytes);

/// At most kMaxRequested submaps.
Status validate(const SubmapRequest& request);
/// A frame that is not empty and that a message has room for; what is in it is checked by who decodes it.
Status validate(const SubmapCopy& copy);

}  // namespace tutti::wire
