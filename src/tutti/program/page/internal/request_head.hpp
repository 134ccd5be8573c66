// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <tl/expected.hpp>

namespace tutti::page {

constexpr std::size_t kMostHead = 16U << 10U;     ///< Bytes of a request's line and headers.
constexpr std::size_t kMostLine = 2048;           ///< Bytes of a request's line: std::regex recurses over its path.
constexpr std::size_t kMostHeaders = 64;          ///< Lines.
constexpr std::size_t kMostBody = 2U << 20U;      ///< Bytes: a mark's photo of 1 MiB as base64, and its text.
constexpr std::size_t kMostOrder = 64U << 10U;    ///< Bytes: any other body.
constexpr std::size_t kMostStrangersBody = 4096;  ///< Bytes: a log-in.

/// The head of a request, as cpp-httplib is given it.
struct RequestHead {
  std::string text;      ///< The line and the headers that count here, with the empty line at the end.
  std::size_t body = 0;  ///< Bytes that follow: at most kMostBody.
};

/// Why a request is not taken: an HTTP status, and a sentence.
struct HeadRefusal {
  int status = 400;
  std::string why;
};

/// Takes the head of a request, from its first byte to the empty line: GET, HEAD or POST, with a body of a stated
/// length that is neither compressed nor in chunks nor of several parts, because cpp-httplib 0.11 takes such without
/// bound. A wish for ranges is passed over (RFC 9110, 14.2 allows it), and so are compressions other than gzip. Lengths
/// of head and lines are the caller's to bound while they are read; they are looked at again here.
tl::expected<RequestHead, HeadRefusal> checked_head(std::string_view head);

}  // namespace tutti::page
