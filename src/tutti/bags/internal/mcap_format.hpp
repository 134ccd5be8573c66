// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string_view>

/// Constants that reader and writer of MCAP share (https://mcap.dev/spec).
namespace tutti::bags::internal {

inline constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);
inline constexpr std::uint64_t kRecordHeadBytes = 9;  ///< opcode, length
inline constexpr std::uint64_t kFooterBytes = 20;
enum Opcode : std::uint8_t {
  kHeader = 1,
  kFooter,
  kSchema,
  kChannel,
  kMessage,
  kChunk,
  kMessageIndex,
  kChunkIndex,
  kAttachment,
  kAttachmentIndex,
  kStatistics,
  kMetadata,
  kMetadataIndex,
  kSummaryOffset,
  kDataEnd,
};

}  // namespace tutti::bags::internal
