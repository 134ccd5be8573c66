// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/internal/request_head.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>

namespace tutti::page {
namespace {

constexpr std::string_view kEnd = "\r\n";

tl::unexpected<HeadRefusal> refuse(int status, std::string why) {
  return tl::unexpected(HeadRefusal{status, std::move(why)});
}

std::string lower(std::string_view text) {
  std::string out(text);
  std::ranges::transform(out, out.begin(), [](char c) { return 'A' <= c && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  return out;
}

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t") - begin + 1);
}

bool is_token(std::string_view text) {
  return !text.empty() && std::ranges::all_of(text, [](char c) {
    return ('a' <= c && c <= 'z') || ('A' <= c && c <= 'Z') || ('0' <= c && c <= '9') ||
           std::string_view("!#$%&'*+-.^_`|~").find(c) != std::string_view::npos;
  });
}

bool is_text(std::string_view line) {
  return std::ranges::all_of(line,
                             [](char c) { return c == '\t' || (static_cast<unsigned char>(c) >= 32 && c != 127); });
}

/// Collects the headers while they are read.
struct Reader {
  RequestHead head;
  std::optional<std::size_t> length;

  tl::expected<void, HeadRefusal> take(std::string_view line) {
    const std::size_t colon = line.find(':');
    const std::string_view name = line.substr(0, colon);
    if (colon == std::string_view::npos || !is_token(name) || !is_text(line))
      return refuse(400, "a header's line is malformed: expected NAME: VALUE");
    const std::string key = lower(name);
    const std::string_view value = trimmed(line.substr(colon + 1));
    if (key == "transfer-encoding") return refuse(411, "a body in chunks is not taken: state its Content-Length");
    if (key == "content-encoding") return refuse(415, "a compressed body is not taken");
    if (key == "content-type" && lower(value).starts_with("multipart/"))
      return refuse(415, "a body of several parts is not taken: expected application/json");
    if (key == "content-length") return take_length(value);
    if (key == "range" || key == "if-range") return {};
    if (key == "accept-encoding") {
      if (lower(value).find("gzip") != std::string::npos) keep("Accept-Encoding: gzip");
      return {};
    }
    keep(line);
    return {};
  }

 private:
  void keep(std::string_view line) { head.text.append(line).append(kEnd); }
  tl::expected<void, HeadRefusal> take_length(std::string_view value) {
    std::size_t bytes = 0;
    const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), bytes);
    if (error == std::errc::result_out_of_range) bytes = kMostBody + 1;
    if (value.empty() || error == std::errc::invalid_argument || end != value.data() + value.size() || length)
      return refuse(400, "Content-Length: expected one number");
    if (bytes > kMostBody) return refuse(413, fmt::format("a body has at most {} bytes here", kMostBody));
    length = bytes;
    keep(fmt::format("Content-Length: {}", bytes));
    return {};
  }
};

tl::expected<std::string_view, HeadRefusal> method_of(std::string_view line) {
  if (line.size() > kMostLine) return refuse(414, fmt::format("a request's line has at most {} bytes here", kMostLine));
  const std::size_t first = line.find(' '), last = line.rfind(' ');
  if (!is_text(line) || first == std::string_view::npos || first == last ||
      !line.substr(last + 1).starts_with("HTTP/1."))
    return refuse(400, "this is no line of HTTP/1.1: expected METHOD PATH HTTP/1.1");
  const std::string_view method = line.substr(0, first);
  constexpr std::array<std::string_view, 3> kTaken{"GET", "HEAD", "POST"};
  if (std::ranges::find(kTaken, method) == kTaken.end()) return refuse(405, "expected GET, HEAD or POST");
  return method;
}

}  // namespace

tl::expected<RequestHead, HeadRefusal> checked_head(std::string_view head) {
  if (head.size() > kMostHead) return refuse(431, fmt::format("a request's head has at most {} bytes here", kMostHead));
  if (!head.ends_with("\r\n\r\n")) return refuse(400, "a request's head ends with an empty line");
  const std::size_t first = head.find(kEnd);
  const auto method = method_of(head.substr(0, first));
  if (!method) return tl::unexpected(method.error());
  Reader reader;
  reader.head.text.assign(head.substr(0, first + kEnd.size()));
  std::size_t lines = 0;
  for (std::size_t begin = first + kEnd.size(); begin + kEnd.size() < head.size();) {
    const std::size_t end = head.find(kEnd, begin);
    if (++lines > kMostHeaders) return refuse(431, fmt::format("a request has at most {} headers here", kMostHeaders));
    if (const auto taken = reader.take(head.substr(begin, end - begin)); !taken) return tl::unexpected(taken.error());
    begin = end + kEnd.size();
  }
  if (*method == "POST" && !reader.length) return refuse(411, "a POST states its Content-Length");
  if (*method != "POST" && reader.length.value_or(0) > 0) return refuse(400, "only a POST has a body");
  reader.head.body = reader.length.value_or(0);
  reader.head.text.append(kEnd);
  return std::move(reader.head);
}

}  // namespace tutti::page
