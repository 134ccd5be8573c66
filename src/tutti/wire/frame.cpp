// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/wire/frame.hpp"

#include <zstd.h>

#include <memory>

#include "tutti/base/check.hpp"
#include "tutti/model/messages.hpp"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/limits.hpp"

namespace tutti::wire {
namespace {

constexpr std::string_view kMagic = "TU";
constexpr std::size_t kHeaderBytes = 5;
constexpr int kCompressionLevel = 9;
static_assert(kProtocolVersion <= 0xffff);

}  // namespace

const char* name(MessageKind kind) {
  switch (kind) {
    case MessageKind::submap:
      return "submap";
    case MessageKind::proxy_graph:
      return "proxy graph";
    case MessageKind::verdict:
      return "verdict";
    case MessageKind::cloud:
      return "cloud";
  }
  return "unknown";
}

Result<MessageKind> peek_kind(std::string_view bytes) {
  if (bytes.size() < kHeaderBytes)
    return fail(ErrorCode::parse, "frame: {} bytes, a header alone has {}", bytes.size(), kHeaderBytes);
  if (!bytes.starts_with(kMagic)) return fail(ErrorCode::parse, "frame: does not begin with \"{}\"", kMagic);
  const auto byte = [&](std::size_t i) { return static_cast<unsigned>(static_cast<unsigned char>(bytes[i])); };
  const unsigned version = byte(2) | (byte(3) << 8U);
  if (version != kProtocolVersion)
    return fail(ErrorCode::unsupported, "frame: protocol version {}, this program speaks version {}", version,
                kProtocolVersion);
  if (byte(4) < 1 || byte(4) > 4) return fail(ErrorCode::unsupported, "frame: unknown message kind {}", byte(4));
  return static_cast<MessageKind>(byte(4));
}

std::string pack_frame(MessageKind kind, std::string_view payload) {
  TUTTI_CHECK(payload.size() <= kMaxMessageBytes, "message of {} bytes", payload.size());
  std::string frame(kMagic);
  frame.push_back(static_cast<char>(kProtocolVersion & 0xffU));
  frame.push_back(static_cast<char>(kProtocolVersion >> 8U));
  frame.push_back(static_cast<char>(kind));
  frame.resize(kHeaderBytes + ZSTD_compressBound(payload.size()));

  const std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> context(ZSTD_createCCtx(), &ZSTD_freeCCtx);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, kCompressionLevel);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_checksumFlag, 1);
  const std::size_t size = ZSTD_compress2(context.get(), frame.data() + kHeaderBytes, frame.size() - kHeaderBytes,
                                          payload.data(), payload.size());
  TUTTI_CHECK(ZSTD_isError(size) == 0U, "zstd: {}", ZSTD_getErrorName(size));
  frame.resize(kHeaderBytes + size);
  return frame;
}

Result<std::string> unpack_frame(MessageKind kind, std::string_view frame) {
  const Result<MessageKind> found = peek_kind(frame);
  if (!found) return tl::unexpected(found.error());
  if (*found != kind) return fail(ErrorCode::parse, "frame: carries a {}, expected a {}", name(*found), name(kind));

  const std::string_view body = frame.substr(kHeaderBytes);
  const unsigned long long size = ZSTD_getFrameContentSize(body.data(), body.size());
  if (size == ZSTD_CONTENTSIZE_ERROR || size == ZSTD_CONTENTSIZE_UNKNOWN)
    return fail(ErrorCode::parse, "frame: not a zstd frame with a content size");
  if (size > kMaxMessageBytes)
    return fail(ErrorCode::invalid, "frame: claims {} bytes, at most {} are accepted", size, kMaxMessageBytes);
  const std::size_t compressed = ZSTD_findFrameCompressedSize(body.data(), body.size());
  if (ZSTD_isError(compressed) != 0U || compressed != body.size())
    return fail(ErrorCode::parse, "frame: truncated, or {} bytes are not one zstd frame", body.size());
  std::string payload(static_cast<std::size_t>(size), '\0');
  const std::size_t written = ZSTD_decompress(payload.data(), payload.size(), body.data(), body.size());
  if (ZSTD_isError(written) != 0U)
    return fail(ErrorCode::parse, "frame: cannot be decompressed: {}", ZSTD_getErrorName(written));
  if (written != payload.size())
    return fail(ErrorCode::parse, "frame: {} bytes decompressed, {} announced", written, payload.size());
  return payload;
}

}  // namespace tutti::wire
