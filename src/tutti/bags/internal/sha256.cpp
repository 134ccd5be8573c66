// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/internal/sha256.hpp"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <array>

#include "tutti/base/check.hpp"

namespace tutti::bags::internal {

std::string sha256(std::string_view bytes) {
  std::array<unsigned char, 32> digest{};
  unsigned size = 0;
  const int done = EVP_Digest(bytes.data(), bytes.size(), digest.data(), &size, EVP_sha256(), nullptr);
  TUTTI_CHECK(done == 1 && size == digest.size(), "SHA-256 of {} bytes", bytes.size());
  return fmt::format("{:02x}", fmt::join(digest, ""));
}

}  // namespace tutti::bags::internal
