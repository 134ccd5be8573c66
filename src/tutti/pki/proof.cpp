// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/pki/proof.hpp"

#include <fmt/format.h>
#include <openssl/evp.h>
#include <openssl/rand.h>

#include <array>
#include <fstream>
#include <memory>

#include "tutti/base/check.hpp"
#include "tutti/base/file.hpp"
#include "tutti/pki/nats_key.hpp"

namespace tutti::pki {
namespace {

const unsigned char* bytes_of_text(std::string_view text) {
  return reinterpret_cast<const unsigned char*>(text.data());
}

class Sha256 {
 public:
  Sha256() { TUTTI_CHECK(EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr) == 1, "OpenSSL has no SHA-256"); }
  void add(std::string_view bytes) {
    TUTTI_CHECK(EVP_DigestUpdate(context_.get(), bytes.data(), bytes.size()) == 1, "SHA-256");
  }
  [[nodiscard]] std::string finish() {
    std::array<unsigned char, 32> hash{};
    TUTTI_CHECK(EVP_DigestFinal_ex(context_.get(), hash.data(), nullptr) == 1, "SHA-256");
    return fmt::format("{:02x}", fmt::join(hash, ""));
  }

 private:
  std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context_{EVP_MD_CTX_new(), &EVP_MD_CTX_free};
};

}  // namespace

std::string random_token() {
  std::array<unsigned char, 32> bytes{};
  TUTTI_CHECK(RAND_bytes(bytes.data(), static_cast<int>(bytes.size())) == 1, "OpenSSL has no random numbers");
  return fmt::format("{:02x}", fmt::join(bytes, ""));
}

std::string sha256(std::string_view bytes) {
  Sha256 hash;
  hash.add(bytes);
  return hash.finish();
}

Result<std::string> sha256_of_file(const std::string& file) {
  auto in = open_file(file);
  if (!in) return tl::unexpected(in.error());
  Sha256 hash;
  std::string piece(std::size_t{1} << 20U, '\0');
  while (in->read(piece.data(), static_cast<std::streamsize>(piece.size())) || in->gcount() > 0)
    hash.add(std::string_view(piece).substr(0, static_cast<std::size_t>(in->gcount())));
  if (!in->eof()) return fail(ErrorCode::io, "{}: cannot be read", file);
  return hash.finish();
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
