// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <google/protobuf/arena.h>

#include <cstdint>
#include <string_view>

#include "tutti/base/check.hpp"
#include "tutti/base/result.hpp"
#include "tutti/wire/frame.hpp"
#include "tutti/wire/message_kind.hpp"

namespace tutti::wire {

/// An error when the payload has more elements than limits.hpp accepts, of those that take more memory parsed than
/// they have bytes. Reads tags and lengths and takes no memory.
Status check_counts(MessageKind kind, std::string_view payload);

/// What is encoded is ours, and whole.
inline void expect_valid(const Status& valid) { TUTTI_CHECK(valid.has_value(), "{}", valid.error().message); }

template <class Message>
struct Parsed {
  std::uint16_t version = 0;  ///< The kind's; what the message means may depend on it.
  Message message;
};

/// Parses the frame's message into `message`; the frame's version.
template <class Message>
Result<std::uint16_t> parse_frame(MessageKind kind, std::string_view bytes, Message& message) {
  const Result<Unpacked> frame = unpack_frame(kind, bytes);
  if (!frame) return tl::unexpected(frame.error());
  if (auto ok = check_counts(kind, frame->payload); !ok) return in_context(name(kind), ok.error());
  if (!message.ParseFromString(frame->payload))
    return fail(ErrorCode::parse, "{}: not the protobuf message expected", name(kind));
  return frame->version;
}

/// The protobuf message in a frame of this kind.
template <class Message>
Result<Parsed<Message>> parse_frame(MessageKind kind, std::string_view bytes) {
  Parsed<Message> parsed;
  const auto version = parse_frame(kind, bytes, parsed.message);
  if (!version) return tl::unexpected(version.error());
  parsed.version = *version;
  return parsed;
}

/// Likewise, in the arena's memory, which it leaves with the arena: of many parts each is an allocation otherwise.
template <class Message>
Result<const Message*> parse_frame(MessageKind kind, std::string_view bytes, google::protobuf::Arena& arena) {
  auto* const message = google::protobuf::Arena::CreateMessage<Message>(&arena);
  const auto version = parse_frame(kind, bytes, *message);
  if (!version) return tl::unexpected(version.error());
  return message;
}

}  // namespace tutti::wire
