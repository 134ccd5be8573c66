// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/pki/certificates.hpp"

#include <gtest/gtest.h>

#include <string>

namespace tutti::pki {
namespace certificates_test {

/// What nats-server and libnats make of them is tried in pki_test.
TEST(CertificatesTest, EachIsAnotherAndSaysUntilWhen) {
  const auto authority = make_authority("authority", 10);
  ASSERT_TRUE(authority) << authority.error().message;
  const auto one = make_certificate(*authority, "bus.tutti", true, 1);
  const auto other = make_certificate(*authority, "bus.tutti", true, 2);
  ASSERT_TRUE(one && other);
  EXPECT_NE(one->text, other->text);
  EXPECT_NE(one->key, other->key);
  EXPECT_EQ(one->text.find("-----BEGIN CERTIFICATE-----\n"), 0U);
  EXPECT_EQ(one->key.find("-----BEGIN PRIVATE KEY-----\n"), 0U);
  EXPECT_LT(valid_until(one->text).value(), valid_until(other->text).value());
  EXPECT_LT(valid_until(other->text).value(), valid_until(authority->text).value());
  EXPECT_EQ(valid_until(one->text)->size(), std::string("2027-01-31 12:00:00 UTC").size());
}

TEST(CertificatesTest, WhatIsNoCertificateIsRefused) {
  const auto authority = make_authority("authority", 10).value();
  EXPECT_FALSE(valid_until(""));
  EXPECT_FALSE(valid_until(authority.key));
  EXPECT_FALSE(make_certificate({authority.text, ""}, "a", false, 1));
  EXPECT_FALSE(make_certificate({"", authority.key}, "a", false, 1));
  EXPECT_FALSE(make_certificate(authority, std::string(100, 'a'), false, 1));  // X.509 names have 64 letters
}

}  // namespace certificates_test
}  // namespace tutti::pki
