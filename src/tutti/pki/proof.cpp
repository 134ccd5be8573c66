// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/pki/proof.hpp"

#include <fmt/format.h>
#include <openssl/evp.h>
#include <openssl/rand.h>

#include <array>
#include <memory>

#include "tutti/base/check.hpp"
#include "tutti/pki/nats_key.hpp"

namespace tutti::pki {
namespace {

const unsigned char* bytes_of_text(std::string_view text) {
  return reinterpret_cast<const unsigned char*>(text.data());
}

}  // namespace

std::string random_token() {
  std::array<unsigned char, 32> bytes{};
  TUTTI_CHECK(RAND_bytes(bytes.data(), static_cast<int>(bytes.size())) == 1, "OpenSSL has no random numbers");
  return fmt::format("{:02x}", fmt::join(bytes, ""));
}

bool is_signed(const std::string& key, std::string_view message, std::string_view signature) {
  const auto open = decode_open_key(key);
  if (!open) return false;
  const std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)> verifier(
      EVP_PKEY_new_raw_public_key(EVP_PKEY_ED25519, nullptr, open->data(), open->size()), &EVP_PKEY_free);
  const std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context(EVP_MD_CTX_new(), &EVP_MD_CTX_free);
  return verifier && context && EVP_DigestVerifyInit(context.get(), nullptr, nullptr, nullptr, verifier.get()) == 1 &&
         EVP_DigestVerify(context.get(), bytes_of_text(signature), signature.size(), bytes_of_text(message),
                          message.size()) == 1;
}

}  // namespace tutti::pki
