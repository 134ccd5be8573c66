// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>

namespace tutti {

inline constexpr std::size_t kPlainTextBytes = 1'000;

/// The first `most` bytes of a text, with '?' for every byte that is no printable ASCII. Text from strangers (names,
/// frames, reasons) passes through here before it reaches a terminal or a text field of protobuf, which must be UTF-8.
inline std::string plain_text(std::string_view text, std::size_t most = kPlainTextBytes) {
  std::string out(text.substr(0, most));
  std::ranges::replace_if(
      out, [](char c) { return c < ' ' || c > '~'; }, '?');
  return out;
}

}  // namespace tutti
