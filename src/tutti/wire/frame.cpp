// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/wire/frame.hpp"

#include <zstd.h>

#include <memory>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/limits.hpp"

namespace tutti::wire {
namespace {

constexpr std::string_view kMagic = "TU";
constexpr std::size_t kHeaderBytes = 5;
/// Kinds that are large and written often.
constexpr bool is_state(MessageKind kind) { return kind == MessageKind::agent_state || kind == MessageKind::estimate; }
constexpr int level_of(MessageKind kind) { return is_state(kind) ? 1 : 9; }
constexpr std::size_t most_bytes(MessageKind kind) { return is_state(kind) ? kMaxStateBytes : kMaxMessageBytes; }
constexpr std::string_view kUnknown = "unknown";
constexpr auto kLastKind = static_cast<unsigned>(MessageKind::estimate);

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
    case MessageKind::receipt:
      return "receipt";
    case MessageKind::job:
      return "job";
    case MessageKind::verdicts:
      return "verdicts";
    case MessageKind::status:
      return "status";
    case MessageKind::agent_state:
      return "agent state";
    case MessageKind::submap_request:
      return "submap request";
    case MessageKind::submap_copy:
      return "submap copy";
    case MessageKind::mission_status:
      return "mission status";
    case MessageKind::decision:
      return "decision";
    case MessageKind::proxy_graph_delta:
      return "proxy graph delta";
    case MessageKind::tracked_images:
      return "tracked images";
    case MessageKind::refinement_job:
      return "refinement job";
    case MessageKind::refinement:
      return "refinement";
    case MessageKind::mark:
      return "mark";
    case MessageKind::estimate:
      return "estimate";
  }
  return kUnknown.data();
}

// A kind that gets a second version has its own line here, with what the version changed.
Versions versions(MessageKind) { return {}; }

namespace {

struct Header {
  MessageKind kind{};
  std::uint16_t version = 0;
};

Result<Header> read_header(std::string_view bytes) {
  if (bytes.size() < kHeaderBytes)
    return fail(ErrorCode::parse, "frame: {} bytes, a header alone has {}", bytes.size(), kHeaderBytes);
  if (!bytes.starts_with(kMagic)) return fail(ErrorCode::parse, "frame: does not begin with \"{}\"", kMagic);
  const auto byte = [&](std::size_t i) { return static_cast<unsigned>(static_cast<unsigned char>(bytes[i])); };
  if (byte(4) < 1 || byte(4) > kLastKind || name(static_cast<MessageKind>(byte(4))) == kUnknown)
    return fail(ErrorCode::parse, "frame: unknown message kind {}", byte(4));
  const Header header{static_cast<MessageKind>(byte(4)), static_cast<std::uint16_t>(byte(2) | (byte(3) << 8U))};
  const auto [oldest, current] = versions(header.kind);
  if (header.version < oldest || header.version > current)
    return fail(
        ErrorCode::unsupported,
        "frame: a {} of version {}, this program reads versions {} to {}: upgrade the older of the two programs "
        "(tutti --version)",
        name(header.kind), header.version, oldest, current);
  return header;
}

}  // namespace

std::optional<MessageKind> kind_of(std::string_view frame) {
  const Result<Header> header = read_header(frame);
  return header ? std::optional(header->kind) : std::nullopt;
}

std::uint16_t version_of(std::string_view frame) {
  const Result<Header> header = read_header(frame);
  TUTTI_CHECK(header.has_value(), "{}", header.error().message);
  return header->version;
}

std::string pack_frame(MessageKind kind, std::string_view payload) {
  TUTTI_CHECK(payload.size() <= most_bytes(kind), "message of {} bytes", payload.size());
  std::string frame(kMagic);
  const unsigned version = versions(kind).current;
  frame.push_back(static_cast<char>(version & 0xffU));
  frame.push_back(static_cast<char>(version >> 8U));
  frame.push_back(static_cast<char>(kind));
  frame.resize(kHeaderBytes + ZSTD_compressBound(payload.size()));

  const std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> context(ZSTD_createCCtx(), &ZSTD_freeCCtx);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, level_of(kind));
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_checksumFlag, 1);
  const std::size_t size = ZSTD_compress2(context.get(), frame.data() + kHeaderBytes, frame.size() - kHeaderBytes,
                                          payload.data(), payload.size());
  TUTTI_CHECK(ZSTD_isError(size) == 0U, "zstd: {}", ZSTD_getErrorName(size));
  frame.resize(kHeaderBytes + size);
  return frame;
}

Result<std::string> unpack_frame(MessageKind kind, std::string_view frame) {
  const Result<Header> found = read_header(frame);
  if (!found) return tl::unexpected(found.error());
  if (found->kind != kind)
    return fail(ErrorCode::parse, "frame: carries a {}, expected a {}", name(found->kind), name(kind));

  const std::string_view body = frame.substr(kHeaderBytes);
  const unsigned long long size = ZSTD_getFrameContentSize(body.data(), body.size());
  if (size == ZSTD_CONTENTSIZE_ERROR || size == ZSTD_CONTENTSIZE_UNKNOWN)
    return fail(ErrorCode::parse, "frame: not a zstd frame with a content size");
  if (size > most_bytes(kind))
    return fail(ErrorCode::invalid, "frame: claims {} bytes, at most {} are accepted", size, most_bytes(kind));
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
