// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <google/protobuf/arena.h>

#include <string_view>

#include "tutti/base/check.hpp"
#include "tutti/base/result.hpp"
#include "tutti/wire/frame.hpp"
#include "tutti/wire/message_kind.hpp"

namespace tutti::wire {

/// An error when the payload has more elements than limits.hpp accepts, of those that take more memory parsed than
/// they have bytes. Reads tags and lengths and takes no memory.
Status check_counts(MessageKind kind, std::string_view payload);

/// A message that is encoded is ours, and whole.
inline void expect_valid(const Status& valid) { TUTTI_CHECK(valid.has_value(), "{}", valid.error().message); }

/// Parses the frame's message into `message`.
template <class Message>
Status parse_frame(MessageKind kind, std::string_view bytes, Message& message) {
  const Result<std::string> payload = unpack_frame(kind, bytes);
  if (!payload) return tl::unexpected(payload.error());
  if (auto ok = check_counts(kind, *payload); !ok) return in_context(name(kind), ok.error());
  if (!message.ParseFromString(*payload))
    return fail(ErrorCode::parse, "{}: not the protobuf message expected", name(kind));
  return {};
}

/// The protobuf message in a frame of this kind.
template <class Message>
Result<Message> parse_frame(MessageKind kind, std::string_view bytes) {
  Message message;
  if (auto ok = parse_frame(kind, bytes, message); !ok) return tl::unexpected(ok.error());
  return message;
}

/// Likewise, in the arena's memory, which it leaves with the arena: of many parts each is an allocation otherwise.
template <class Message>
Result<const Message*> parse_frame(MessageKind kind, std::string_view bytes, google::protobuf::Arena& arena) {
  auto* const message = google::protobuf::Arena::CreateMessage<Message>(&arena);
  if (auto ok = parse_frame(kind, bytes, *message); !ok) return tl::unexpected(ok.error());
  return message;
}

}  // namespace tutti::wire
