// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "tutti/base/result.hpp"
#include "tutti/wire/frame.hpp"
#include "tutti/wire/message_kind.hpp"

namespace tutti::wire {

/// An error when the payload has more elements than limits.hpp accepts, of those that take more memory parsed than
/// they have bytes. Looks at tags and lengths and takes no memory.
Status check_counts(MessageKind kind, std::string_view payload);

/// The protobuf message in a frame of this kind.
template <class Message>
Result<Message> parse_frame(MessageKind kind, std::string_view bytes) {
  const Result<std::string> payload = unpack_frame(kind, bytes);
  if (!payload) return tl::unexpected(payload.error());
  if (auto ok = check_counts(kind, *payload); !ok) return in_context(name(kind), ok.error());
  Message message;
  if (!message.ParseFromString(*payload))
    return fail(ErrorCode::parse, "{}: not the protobuf message expected", name(kind));
  return message;
}

}  // namespace tutti::wire
