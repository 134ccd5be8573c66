// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/base64.hpp"

#include <cstdint>
#include <string_view>

namespace tutti::page {
namespace {

constexpr std::string_view kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

}  // namespace

std::string base64(const std::string& bytes) {
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t three = 0;
    for (std::size_t k = 0; k < 3; ++k)
      three = (three << 8U) | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k) out += i + k > bytes.size() ? '=' : kLetters[(three >> (18 - 6 * k)) & 63U];
  }
  return out;
}

std::optional<std::string> bytes_of_base64(const std::string& text) {
  std::string out;
  unsigned pending = 0, bits = 0;
  for (const char letter : text) {
    if (letter == '=') break;
    const std::size_t value = kLetters.find(letter);
    if (value == std::string_view::npos) return std::nullopt;
    pending = ((pending << 6U) | static_cast<unsigned>(value)) & 0xFFFFU;
    if (bits += 6; bits < 8) continue;
    bits -= 8;
    out += static_cast<char>((pending >> bits) & 0xFFU);
  }
  return out;
}

}  // namespace tutti::page
