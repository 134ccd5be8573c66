// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/internal/packed_file.hpp"

#include <unistd.h>
#include <zstd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <system_error>

#include "tutti/bags/internal/chunk.hpp"
#include "tutti/base/file.hpp"

namespace tutti::bags::internal {

PackedFile::~PackedFile() {
  if (path_.empty()) return;
  std::error_code failure;
  std::filesystem::remove(path_, failure);
}

Result<PackedFile> PackedFile::unpack(const std::string& path, std::uint64_t little) {
  std::error_code failure;
  std::string name = (std::filesystem::temp_directory_path(failure) / "tutti_bag_XXXXXX").string();
  const int handle = failure ? -1 : mkstemp(name.data());
  if (handle < 0) return fail(ErrorCode::io, "{}: no file to unpack it into: {}", path, name);
  close(handle);
  PackedFile out(name);
  auto opened = open_file(path);
  if (!opened) return tl::unexpected(opened.error());
  std::ifstream& in = *opened;
  std::ofstream to(name, std::ios::binary);
  const std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context(ZSTD_createDCtx(), ZSTD_freeDCtx);
  std::string packed(ZSTD_DStreamInSize(), '\0'), plain(ZSTD_DStreamOutSize(), '\0');
  std::uint64_t read = 0, written = 0;
  while (in) {
    in.read(packed.data(), static_cast<std::streamsize>(packed.size()));
    read += static_cast<std::uint64_t>(in.gcount());
    ZSTD_inBuffer from{packed.data(), static_cast<std::size_t>(in.gcount()), 0};
    bool full = true;
    while (from.pos < from.size || full) {
      ZSTD_outBuffer piece{plain.data(), plain.size(), 0};
      const std::size_t hint = ZSTD_decompressStream(context.get(), &piece, &from);
      if (ZSTD_isError(hint)) return fail(ErrorCode::parse, "{}: zstd: {}", path, ZSTD_getErrorName(hint));
      to.write(plain.data(), static_cast<std::streamsize>(piece.pos));
      written += piece.pos;
      if (const std::uint64_t most = most_unpacked(read, little); written > most)
        return fail(ErrorCode::unsupported, "{}: zstd: {} bytes unpack to more than {}", path, read, most);
      full = piece.pos == piece.size;
    }
  }
  to.close();
  if (!to) return fail(ErrorCode::io, "{}: cannot be unpacked into {}: is there room?", path, name);
  return out;
}

Result<std::string> unpack_message(std::string_view packed) {
  const auto size = ZSTD_getFrameContentSize(packed.data(), packed.size());
  if (size == ZSTD_CONTENTSIZE_UNKNOWN || size == ZSTD_CONTENTSIZE_ERROR)
    return fail(ErrorCode::parse, "zstd: a frame that does not say its size");
  return unpack_chunk(packed, "zstd", size, false);
}

}  // namespace tutti::bags::internal
