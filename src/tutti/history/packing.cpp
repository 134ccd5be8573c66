// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/history/packing.hpp"

#include <zstd.h>

namespace tutti::history {
namespace {

constexpr char kPlain = 'p', kZstd = 'z';
constexpr int kLevel = 6;

}  // namespace

std::string packed(std::string_view value) {
  std::string out(1 + ZSTD_compressBound(value.size()), kZstd);
  const std::size_t size = ZSTD_compress(out.data() + 1, out.size() - 1, value.data(), value.size(), kLevel);
  if (ZSTD_isError(size) != 0 || size >= value.size()) return kPlain + std::string(value);
  out.resize(1 + size);
  return out;
}

Result<std::string> unpacked(std::string_view bytes) {
  if (bytes.empty()) return fail(ErrorCode::parse, "a value of 0 bytes, expected one at least");
  const std::string_view rest = bytes.substr(1);
  if (bytes.front() == kPlain) return std::string(rest);
  if (bytes.front() != kZstd)
    return fail(ErrorCode::parse, "a value that begins with {:#x}, expected 'p' or 'z'",
                static_cast<unsigned>(static_cast<unsigned char>(bytes.front())));
  const unsigned long long size = ZSTD_getFrameContentSize(rest.data(), rest.size());
  if (size == ZSTD_CONTENTSIZE_ERROR || size == ZSTD_CONTENTSIZE_UNKNOWN || size > kMostValue)
    return fail(ErrorCode::parse, "a value that states no size, or one above {} bytes", kMostValue);
  std::string out(size, '\0');
  const std::size_t got = ZSTD_decompress(out.data(), out.size(), rest.data(), rest.size());
  if (ZSTD_isError(got) != 0) return fail(ErrorCode::parse, "zstd: {}", ZSTD_getErrorName(got));
  return out;
}

}  // namespace tutti::history
