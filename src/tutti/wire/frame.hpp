// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "tutti/base/result.hpp"
#include "tutti/wire/message_kind.hpp"

/// A frame: "TU", protocol version (2 bytes, little endian), kind (1 byte), one zstd frame with content size and
/// checksum, nothing after it.
namespace tutti::wire {

/// `payload` is at most kMaxMessageBytes.
std::string pack_frame(MessageKind kind, std::string_view payload);

/// Payload of a frame of this kind. Wrong magic, version, kind, size, checksum, or anything left over is an error.
Result<std::string> unpack_frame(MessageKind kind, std::string_view frame);

}  // namespace tutti::wire
