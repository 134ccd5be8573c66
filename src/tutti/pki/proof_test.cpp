// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/pki/proof.hpp"

#include <gtest/gtest.h>
#include <openssl/evp.h>

#include <memory>

#include "tutti/base/file.hpp"
#include "tutti/pki/nats_key.hpp"

namespace tutti::pki {
namespace proof_test {

/// A key of ours, and what it signs.
struct Signer {
  std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)> pair{EVP_PKEY_Q_keygen(nullptr, nullptr, "ED25519"),
                                                           &EVP_PKEY_free};
  std::string key;

  Signer() {
    Ed25519 open{};
    std::size_t size = open.size();
    EVP_PKEY_get_raw_public_key(pair.get(), open.data(), &size);
    key = encode_nats_key(open, {}).open;
  }
  [[nodiscard]] std::string sign(const std::string& message) const {
    const std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context(EVP_MD_CTX_new(), &EVP_MD_CTX_free);
    std::string out(64, '\0');
    std::size_t size = out.size();
    EVP_DigestSignInit(context.get(), nullptr, nullptr, nullptr, pair.get());
    EVP_DigestSign(context.get(), reinterpret_cast<unsigned char*>(out.data()), &size,
                   reinterpret_cast<const unsigned char*>(message.data()), message.size());
    return out;
  }
};

TEST(Proof, TellsWhoHasSigned) {
  const Signer anna, mallory;
  const std::string signature = anna.sign("nonce");
  EXPECT_TRUE(is_signed(anna.key, "nonce", signature));
  EXPECT_FALSE(is_signed(mallory.key, "nonce", signature));
  EXPECT_FALSE(is_signed(anna.key, "another", signature));
  EXPECT_FALSE(is_signed(anna.key, "nonce", signature.substr(1)));
  EXPECT_FALSE(is_signed(anna.key, "nonce", ""));
}

TEST(Proof, TakesNoOtherTextForAKey) {
  const Signer anna;
  const std::string signature = anna.sign("nonce");
  std::string damaged = anna.key;
  damaged[10] = damaged[10] == 'A' ? 'B' : 'A';
  for (const std::string& key : {damaged, std::string(), std::string("U"), anna.key + "A", "S" + anna.key.substr(1)})
    EXPECT_FALSE(is_signed(key, "nonce", signature)) << key;
}

TEST(Proof, HashesAsSha256sumDoes) {
  const std::string abc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
  EXPECT_EQ(sha256("abc"), abc);
  const std::string file = ::testing::TempDir() + "/proof_test_abc", large(std::size_t{3} << 20U, 'a');
  for (const std::string& text : {std::string("abc"), std::string(), large, large + "abc"}) {
    ASSERT_TRUE(write_file(file, text).has_value());
    EXPECT_EQ(sha256_of_file(file).value(), sha256(text));
  }
  EXPECT_FALSE(sha256_of_file(file + "_none").has_value());
}

TEST(Proof, TokensDiffer) {
  EXPECT_EQ(random_token().size(), 64U);
  EXPECT_NE(random_token(), random_token());
}

}  // namespace proof_test
}  // namespace tutti::pki
