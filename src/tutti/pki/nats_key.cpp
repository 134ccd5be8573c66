// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/pki/nats_key.hpp"

#include <openssl/evp.h>

#include <algorithm>
#include <memory>
#include <string_view>
#include <vector>

#include "tutti/base/check.hpp"

namespace tutti::pki {
namespace {

constexpr std::uint8_t kUser = 20U << 3U;  // 'U', the first of five bits of base32
constexpr std::uint8_t kSeed = 18U << 3U;  // 'S'

/// CRC-16/XMODEM.
std::uint16_t crc_of(const std::vector<std::uint8_t>& bytes) {
  unsigned crc = 0;
  for (const std::uint8_t byte : bytes) {
    crc ^= static_cast<unsigned>(byte) << 8U;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 0x8000U) != 0 ? (crc << 1U) ^ 0x1021U : crc << 1U;
  }
  return static_cast<std::uint16_t>(crc);
}

constexpr std::string_view kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZ234567";  // of base32 (RFC 4648)

/// Without padding.
std::string base32(const std::vector<std::uint8_t>& bytes) {
  std::string out;
  unsigned pending = 0, bits = 0;
  for (const std::uint8_t byte : bytes) {
    pending = (pending << 8U) | byte;
    for (bits += 8; bits >= 5; bits -= 5) out += kLetters[(pending >> (bits - 5)) & 31U];
  }
  if (bits > 0) out += kLetters[(pending << (5 - bits)) & 31U];
  return out;
}

std::string encoded(std::vector<std::uint8_t> bytes, const Ed25519& half) {
  bytes.insert(bytes.end(), half.begin(), half.end());
  const std::uint16_t crc = crc_of(bytes);
  bytes.push_back(static_cast<std::uint8_t>(crc & 0xFFU));
  bytes.push_back(static_cast<std::uint8_t>(crc >> 8U));
  return base32(bytes);
}

}  // namespace

/// A seed has two prefixes in 16 bits: that it is one, and whose.
bus::NatsKey encode_nats_key(const Ed25519& open, const Ed25519& secret) {
  return {encoded({kUser}, open),
          encoded({static_cast<std::uint8_t>(kSeed | (kUser >> 5U)), static_cast<std::uint8_t>((kUser & 31U) << 3U)},
                  secret)};
}

std::optional<Ed25519> decode_open_key(const std::string& text) {
  std::vector<std::uint8_t> bytes;
  unsigned pending = 0, bits = 0;
  for (const char letter : text) {
    const std::size_t value = kLetters.find(letter);
    if (value == std::string_view::npos) return std::nullopt;
    pending = ((pending << 5U) | static_cast<unsigned>(value)) & 0xFFFFU;
    if (bits += 5; bits < 8) continue;
    bits -= 8;
    bytes.push_back(static_cast<std::uint8_t>((pending >> bits) & 0xFFU));
  }
  Ed25519 open{};
  if (bytes.size() != 1 + open.size() + 2 || bytes.front() != kUser) return std::nullopt;
  std::copy_n(bytes.begin() + 1, open.size(), open.begin());
  return encoded({kUser}, open) == text ? std::optional(open) : std::nullopt;  // or its checksum is wrong
}

bus::NatsKey make_nats_key() {
  const std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)> key(EVP_PKEY_Q_keygen(nullptr, nullptr, "ED25519"),
                                                                &EVP_PKEY_free);
  TUTTI_CHECK(key != nullptr, "OpenSSL makes no Ed25519 key");
  Ed25519 open{}, secret{};
  std::size_t open_size = open.size(), secret_size = secret.size();
  const bool done = EVP_PKEY_get_raw_public_key(key.get(), open.data(), &open_size) == 1 &&
                    EVP_PKEY_get_raw_private_key(key.get(), secret.data(), &secret_size) == 1;
  TUTTI_CHECK(done && open_size == open.size() && secret_size == secret.size(), "an Ed25519 key of {} bytes",
              open_size);
  return encode_nats_key(open, secret);
}

}  // namespace tutti::pki
