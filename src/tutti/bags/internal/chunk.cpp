// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/internal/chunk.hpp"

#include <bzlib.h>
#include <lz4frame.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <memory>
#include <utility>

#include "tutti/base/check.hpp"

namespace tutti::bags::internal {
namespace {

constexpr std::size_t kFirstBytes = std::size_t{1} << 16;

struct Progress {
  std::size_t taken = 0, written = 0;
  bool ended = false;           ///< The compressed frame is complete.
  const char* error = nullptr;  ///< In the library's words.
};

/// `step(in, out, room)` unpacks some of `in`. A chunk that is cut off gives as much as what is there contains.
template <class Step>
Result<std::string> unpack(std::string_view packed, std::uint64_t size, bool cut, std::string out, const char* name,
                           const Step& step) {
  const std::uint64_t most = most_unpacked(packed.size());
  if (size > most && !cut)
    return fail(ErrorCode::unsupported, "{}: {} bytes unpack to {}, expected at most {}", name, packed.size(), size,
                most);
  const std::uint64_t wanted = std::min(size, most);
  out.clear();
  std::size_t filled = 0;
  bool ended = false;
  while (true) {
    // One byte more than expected, so that a frame that contains more is seen.
    if (filled == out.size()) out.resize(std::min<std::uint64_t>(wanted + 1, std::max(kFirstBytes, 2 * out.size())));
    const Progress now = step(packed, out.data() + filled, out.size() - filled);
    if (now.error && !cut) return fail(ErrorCode::parse, "{}: {}, after {} of {} bytes", name, now.error, filled, size);
    packed.remove_prefix(std::min(now.taken, packed.size()));
    filled += now.written;
    ended = now.ended;
    const bool stuck = now.taken == 0 && now.written == 0;
    if (now.error || filled > wanted || stuck || (ended && packed.empty())) break;
  }
  if (filled > size) return fail(ErrorCode::parse, "{}: unpacks to more than the {} bytes it says", name, size);
  out.resize(std::min<std::uint64_t>(filled, wanted));
  if (!cut && (filled != size || (!ended && size > 0)))
    return fail(ErrorCode::parse, "{}: unpacks to {} bytes, expected {}", name, filled, size);
  return out;
}

Result<std::string> unpack_zstd(std::string_view packed, std::uint64_t size, bool cut, std::string memory) {
  const std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context(ZSTD_createDCtx(), ZSTD_freeDCtx);
  return unpack(packed, size, cut, std::move(memory), "zstd", [&](std::string_view in, char* out, std::size_t room) {
    ZSTD_inBuffer from{in.data(), in.size(), 0};
    ZSTD_outBuffer to{out, room, 0};
    const std::size_t hint = ZSTD_decompressStream(context.get(), &to, &from);
    return Progress{from.pos, to.pos, hint == 0, ZSTD_isError(hint) ? ZSTD_getErrorName(hint) : nullptr};
  });
}

Result<std::string> unpack_lz4(std::string_view packed, std::uint64_t size, bool cut, std::string memory) {
  LZ4F_dctx* made = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&made, LZ4F_VERSION)))
    return fail(ErrorCode::io, "lz4: no memory for a decoder");
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(made,
                                                                                     LZ4F_freeDecompressionContext);
  return unpack(packed, size, cut, std::move(memory), "lz4", [&](std::string_view in, char* out, std::size_t room) {
    std::size_t taken = in.size(), written = room;
    const std::size_t hint = LZ4F_decompress(context.get(), out, &written, in.data(), &taken, nullptr);
    if (LZ4F_isError(hint)) return Progress{0, 0, false, LZ4F_getErrorName(hint)};
    return Progress{taken, written, hint == 0, nullptr};
  });
}

/// In one stream, as ROS 1 writes it.
Result<std::string> unpack_bz2(std::string_view packed, std::uint64_t size, bool cut, std::string memory) {
  bz_stream stream{};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) return fail(ErrorCode::io, "bz2: no memory for a decoder");
  const std::unique_ptr<bz_stream, decltype(&BZ2_bzDecompressEnd)> end(&stream, BZ2_bzDecompressEnd);
  bool ended = false;
  return unpack(packed, size, cut, std::move(memory), "bz2", [&](std::string_view in, char* out, std::size_t room) {
    if (ended) return Progress{0, 0, true, in.empty() ? nullptr : "bytes behind its end"};
    const auto most = [](std::size_t bytes) {
      return static_cast<unsigned>(std::min<std::size_t>(bytes, std::numeric_limits<unsigned>::max()));
    };
    stream.next_in = const_cast<char*>(in.data());  // which it only reads
    stream.avail_in = most(in.size());
    stream.next_out = out;
    stream.avail_out = most(room);
    const unsigned before_in = stream.avail_in, before_out = stream.avail_out;
    const int code = BZ2_bzDecompress(&stream);
    ended = code == BZ_STREAM_END;
    return Progress{before_in - stream.avail_in, before_out - stream.avail_out, ended,
                    code == BZ_OK || ended ? nullptr : "is damaged"};
  });
}

}  // namespace

std::uint32_t crc32(std::string_view bytes, std::uint32_t before) {
  return static_cast<std::uint32_t>(crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

std::string pack_zstd(std::string_view bytes) {
  constexpr int kLevel = 1;  // floats of sensors hardly become smaller for more
  std::string out(ZSTD_compressBound(bytes.size()), '\0');
  const std::size_t size = ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), kLevel);
  TUTTI_CHECK(!ZSTD_isError(size));
  out.resize(size);
  return out;
}

Result<std::string> unpack_chunk(std::string_view packed, std::string_view compression, std::uint64_t size, bool cut,
                                 std::string memory) {
  if (size > kMaxChunkBytes)
    return fail(ErrorCode::unsupported, "unpacks to {} bytes, expected at most {}", size, kMaxChunkBytes);
  if (compression.empty()) {
    if (!cut && packed.size() != size) return fail(ErrorCode::parse, "has {} bytes, expected {}", packed.size(), size);
    memory.assign(packed);
    return memory;
  }
  if (compression == "zstd") return unpack_zstd(packed, size, cut, std::move(memory));
  if (compression == "lz4") return unpack_lz4(packed, size, cut, std::move(memory));
  if (compression == "bz2") return unpack_bz2(packed, size, cut, std::move(memory));
  return fail(ErrorCode::unsupported, "compression '{:.40}', expected none, zstd, lz4 or bz2", compression);
}

}  // namespace tutti::bags::internal
