// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "tutti/base/result.hpp"
#include "tutti/wire/message_kind.hpp"

/// The envelope of every message and stored row: "TU", version of the kind (2 bytes, little endian), kind (1 byte), one
/// zstd frame with content size and checksum, nothing after it.
namespace tutti::wire {

/// A frame of the kind's current version. `payload` has at most kMaxMessageBytes, of an agent's state kMaxStateBytes.
std::string pack_frame(MessageKind kind, std::string_view payload);

/// The payload of a frame of this kind. Errors: wrong magic, kind, size or checksum, bytes left over, a version that
/// this program does not read. Only the last is ErrorCode::unsupported: another version of the program may read the
/// same bytes.
Result<std::string> unpack_frame(MessageKind kind, std::string_view frame);

/// The kind of a frame; nothing: no frame that this program reads.
std::optional<MessageKind> kind_of(std::string_view frame);
/// The version of a frame that unpack_frame() accepts; of other bytes std::logic_error.
std::uint16_t version_of(std::string_view frame);

}  // namespace tutti::wire
