// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>

#include "tutti/base/result.hpp"

namespace tutti::bags::internal {

/// How much of a chunk is taken into memory at most, by its stated size; and of a message.
inline constexpr std::uint64_t kMaxChunkBytes = std::uint64_t{1} << 30;
inline constexpr std::uint64_t kMaxMessageBytes = std::uint64_t{256} << 20;

/// The most that so many packed bytes may unpack to. A recording does not become a thousandth as a whole, but a chunk
/// of black images may: up to `little` bytes are taken whatever they come from.
constexpr std::uint64_t most_unpacked(std::uint64_t packed, std::uint64_t little = std::uint64_t{64} << 20) {
  return std::max(little, 1000 * packed);
}

/// MCAP's CRC32: that of zlib and PNG, polynomial 0xedb88320. `before`: of the bytes in front of these.
std::uint32_t crc32(std::string_view bytes, std::uint32_t before = 0);

/// One zstd frame that states its size.
std::string pack_zstd(std::string_view bytes);

/// Unpacks the records of a chunk: compression "" (none), "zstd", "lz4" (its frame format) or "bz2" (ROS 1's), `size`
/// bytes unpacked. Memory grows with what really comes out, so that a length that lies costs nothing, and not beyond
/// most_unpacked(). A chunk that is `cut` off gives what comes out before the cut. The error names what was expected.
/// `memory` is used again, whatever is in it: to take it from the system anew costs more than to unpack.
Result<std::string> unpack_chunk(std::string_view packed, std::string_view compression, std::uint64_t size, bool cut,
                                 std::string memory = {});

}  // namespace tutti::bags::internal
