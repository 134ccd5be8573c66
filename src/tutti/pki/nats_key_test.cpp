// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/pki/nats_key.hpp"

#include <gtest/gtest.h>

#include <set>
#include <string>

namespace tutti::pki {
namespace nats_key_test {

/// The pair that NATS's documentation shows; the halves are those that Python's `cryptography` finds for its seed.
TEST(NatsKeyTest, IsWrittenAsNatsDocumentsIt) {
  const Ed25519 open{0xef, 0x4e, 0x44, 0x52, 0x4b, 0x72, 0xe4, 0x40, 0xf9, 0x6d, 0xae, 0x7b, 0xba, 0x23, 0x7c, 0x66,
                     0x66, 0xa4, 0x07, 0x01, 0xcb, 0x13, 0x65, 0xa4, 0x22, 0x44, 0xf8, 0x4e, 0x7a, 0x67, 0xda, 0xb1};
  const Ed25519 secret{0x29, 0x49, 0x7b, 0xa0, 0x0f, 0x41, 0xdd, 0x45, 0x93, 0x6b, 0x4c, 0xc4, 0xbd, 0xa1, 0xde, 0xcb,
                       0x67, 0xc1, 0x28, 0xe6, 0x9f, 0xb3, 0xd4, 0x90, 0xee, 0x82, 0x0d, 0xaf, 0x7c, 0x31, 0x8c, 0x0a};
  const bus::NatsKey key = encode_nats_key(open, secret);
  EXPECT_EQ(key.open, "UDXU4RCSJNZOIQHZNWXHXORDPRTGNJAHAHFRGZNEEJCPQTT2M7NLCNF4");
  EXPECT_EQ(key.seed, "SUACSSL3UAHUDXKFSNVUZRF5UHPMWZ6BFDTJ7M6USDXIEDNPPQYYYCU3VY");
}

TEST(NatsKeyTest, EachIsAnother) {
  std::set<std::string> seeds;
  for (int i = 0; i < 20; ++i) {
    const bus::NatsKey key = make_nats_key();
    EXPECT_EQ(key.open.size(), 56U);
    EXPECT_EQ(key.seed.size(), 58U);
    seeds.insert(key.seed);
  }
  EXPECT_EQ(seeds.size(), 20U);
}

}  // namespace nats_key_test
}  // namespace tutti::pki
