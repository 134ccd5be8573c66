// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "tutti/wire/field_bytes.hpp"
#include "tutti/wire/frame.hpp"
#include "tutti/wire/internal/payload.hpp"
#include "tutti/wire/message_kind.hpp"

/// Messages that are a list of fields.
namespace tutti::wire {

template <HasFields T>
Status check_message(MessageKind kind, const T& message) {
  if (auto ok = check_fields(message); !ok) return in_context(name(kind), ok.error());
  return {};
}

template <HasFields T>
std::string encode_fields(MessageKind kind, const T& message) {
  expect_valid(check_message(kind, message));
  return pack_frame(kind, field_bytes(message));
}

template <HasFields T>
Result<T> decode_fields(MessageKind kind, std::string_view bytes) {
  const auto frame = unpack_frame(kind, bytes);
  if (!frame) return tl::unexpected(frame.error());
  auto message = read_fields<T>(*frame);
  if (!message) return in_context(name(kind), message.error());
  if (auto ok = check_message(kind, *message); !ok) return tl::unexpected(ok.error());
  return message;
}

}  // namespace tutti::wire
