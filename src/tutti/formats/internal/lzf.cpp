// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/internal/lzf.hpp"

namespace tutti::formats::internal {

std::optional<std::string> lzf_decode(std::string_view bytes, std::size_t size) {
  constexpr std::size_t kLongestLiteral = 32;  // a control byte below it: one literal more than it states
  constexpr std::size_t kLongestShort = 7;     // a length in the upper three bits of the control byte
  constexpr std::size_t kBestRatio = 88;       // three bytes stand for at most 264
  if (size / kBestRatio > bytes.size()) return std::nullopt;
  std::string out;
  out.reserve(size);
  std::size_t at = 0;
  const auto next = [&] { return static_cast<std::size_t>(static_cast<unsigned char>(bytes[at++])); };
  while (at < bytes.size()) {
    const std::size_t control = next();
    if (control < kLongestLiteral) {
      if (bytes.size() - at < control + 1 || size - out.size() < control + 1) return std::nullopt;
      out.append(bytes.substr(at, control + 1));
      at += control + 1;
      continue;
    }
    std::size_t length = control >> 5U;
    if (bytes.size() - at < (length == kLongestShort ? 2U : 1U)) return std::nullopt;
    if (length == kLongestShort) length += next();
    length += 2;
    const std::size_t back = ((control & 31U) << 8U) + next() + 1;
    if (back > out.size() || size - out.size() < length) return std::nullopt;
    for (; length > 0; --length) out.push_back(out[out.size() - back]);  // may repeat what it has just written
  }
  if (out.size() != size) return std::nullopt;
  return out;
}

}  // namespace tutti::formats::internal
