// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "tutti/base/result.hpp"
#include "tutti/wire/message_kind.hpp"

/// A frame: "TU", version of the kind (2 bytes, little endian), kind (1 byte), one zstd frame with content size and
/// checksum, nothing after it.
namespace tutti::wire {

/// Of the kind's current version. `payload` is at most kMaxMessageBytes, an agent's state kMaxStateBytes.
std::string pack_frame(MessageKind kind, std::string_view payload);

struct Unpacked {
  std::uint16_t version = 0;  ///< One of versions(kind).
  std::string payload;
};

/// What a frame of this kind holds. Wrong magic, kind, size, checksum, a version that cannot be read, or anything left
/// over is an error; ErrorCode::unsupported is a version alone: the same bytes may be good for another program.
Result<Unpacked> unpack_frame(MessageKind kind, std::string_view frame);

/// The version that a frame which could be read is of.
std::uint16_t version_of(std::string_view frame);

}  // namespace tutti::wire
