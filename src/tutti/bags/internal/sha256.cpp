// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/internal/sha256.hpp"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace tutti::bags::internal {
namespace {

constexpr std::size_t kBlockBytes = 64, kRounds = 64;
using State = std::array<std::uint32_t, 8>;

/// The first 32 bits behind the point of the roots of the first 64 primes: cube roots, and square roots of eight.
struct Constants {
  std::array<std::uint32_t, kRounds> cube{};
  State square{};
  Constants() {
    std::size_t count = 0;
    for (std::uint32_t n = 2; count < kRounds; ++n) {
      bool is_prime = true;
      for (std::uint32_t d = 2; d * d <= n; ++d) is_prime = is_prime && n % d != 0;
      if (!is_prime) continue;
      const auto bits = [](long double root) {
        return static_cast<std::uint32_t>(std::floor((root - std::floor(root)) * 0x1p32L));
      };
      if (count < square.size()) square[count] = bits(std::sqrt(static_cast<long double>(n)));
      cube[count++] = bits(std::cbrt(static_cast<long double>(n)));
    }
  }
};
const Constants& constants() {
  static const Constants all;
  return all;
}

void take_block(const char* block, State& state) {
  std::array<std::uint32_t, kRounds> w{};
  for (std::size_t i = 0; i < kRounds; ++i)
    if (i < 16) {
      for (std::size_t k = 0; k < 4; ++k) w[i] = w[i] << 8U | static_cast<unsigned char>(block[4 * i + k]);
    } else {
      const std::uint32_t a = w[i - 15], b = w[i - 2];
      w[i] = w[i - 16] + (std::rotr(a, 7) ^ std::rotr(a, 18) ^ a >> 3U) + w[i - 7] +
             (std::rotr(b, 17) ^ std::rotr(b, 19) ^ b >> 10U);
    }
  State s = state;
  for (std::size_t i = 0; i < kRounds; ++i) {
    const std::uint32_t choice = (s[4] & s[5]) ^ (~s[4] & s[6]);
    const std::uint32_t majority = (s[0] & s[1]) ^ (s[0] & s[2]) ^ (s[1] & s[2]);
    const std::uint32_t first =
        s[7] + (std::rotr(s[4], 6) ^ std::rotr(s[4], 11) ^ std::rotr(s[4], 25)) + choice + constants().cube[i] + w[i];
    const std::uint32_t second = (std::rotr(s[0], 2) ^ std::rotr(s[0], 13) ^ std::rotr(s[0], 22)) + majority;
    s = {first + second, s[0], s[1], s[2], s[3] + first, s[4], s[5], s[6]};
  }
  for (std::size_t i = 0; i < s.size(); ++i) state[i] += s[i];
}

}  // namespace

std::string sha256(std::string_view bytes) {
  std::string padded(bytes);
  padded += '\x80';
  while (padded.size() % kBlockBytes != kBlockBytes - 8) padded += '\0';
  for (int shift = 56; shift >= 0; shift -= 8) padded += static_cast<char>(std::uint64_t{8} * bytes.size() >> shift);
  State state = constants().square;
  for (std::size_t at = 0; at < padded.size(); at += kBlockBytes) take_block(padded.data() + at, state);
  std::string out;
  for (const std::uint32_t word : state) out += fmt::format("{:08x}", word);
  return out;
}

}  // namespace tutti::bags::internal
