// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/pki/certificates.hpp"

#include <gtest/gtest.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include <ctime>
#include <memory>
#include <string>
#include <vector>

namespace tutti::pki {
namespace certificates_test {

/// pki_test tries what nats-server and libnats make of them.
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

/// The one of `openssl x509 -pubkey -noout | openssl pkey -pubin -outform der | sha256sum`.
TEST(CertificatesTest, TheHashOfItsKeyIsThatOfOpenSsl) {
  EXPECT_EQ(key_hash_of(R"(-----BEGIN CERTIFICATE-----
MIIBdjCCAR2gAwIBAgIUJcM6xRl3zzF2SDIOs0v2PIRErcMwCgYIKoZIzj0EAwIw
DTELMAkGA1UEAwwCY2EwHhcNMjYxMTI5MjEwNzQxWhcNMjcwMTE4MjEwNzQxWjAQ
MQ4wDAYDVQQDDAVhbHBoYTBZMBMGByqGSM49AgEGCCqGSM49AwEHA0IABHqJb0th
oBGmprwvpemG82QRQ3fIF/LRcRO/hc5DG6CucWURlxPqwnKls2N9MB/KWFh0iNub
lsvq/2HwxTiPk2CjWDBWMBQGA1UdEQQNMAuCCWxvY2FsaG9zdDAdBgNVHQ4EFgQU
PbEjhzkJComNMotJv6Hv3etIP6UwHwYDVR0jBBgwFoAU6DdI/NpFxFWHyqCV73dL
SL5DT6MwCgYIKoZIzj0EAwIDRwAwRAIgR73snb7ScPo0O3lpo5zROSXE07uuLCEJ
kxawPe70uqECIHvIapziUKO010SM9XeWsC5Bgzdfz5eOWW6Me/Tk0MDm
-----END CERTIFICATE-----
)")
                .value(),
            "c8f3989ca0d6c787e3285f21c31cff11a935f17d6499c7ee13d519334796b240");
}

TEST(CertificatesTest, WhoHasSignedIsTheNameInACertificateOfTheAuthority) {
  const auto authority = make_authority("authority", 10).value(), other = make_authority("authority", 10).value();
  const auto anna = make_certificate(authority, "operator anna", false, 1).value();
  const auto late = make_certificate(authority, "operator late", false, -1).value();
  const auto bus = make_certificate(authority, "bus.tutti", true, 1).value();
  const auto signer = [](const bus::Certificate& who, const bus::Certificate& by) {
    return signer_of("message", signature_of("message", who).value(), who.text, by.text);
  };
  EXPECT_EQ(signer(anna, authority).value(), "operator anna");
  EXPECT_EQ(signer(late, authority).value(), "operator late");  // its bus knows that it has expired
  EXPECT_FALSE(signer(anna, other).has_value());
  EXPECT_FALSE(signer(bus, authority).has_value());  // of nobody who connects
  EXPECT_FALSE(signer({anna.text, bus.key}, authority).has_value());
  const std::string signature = signature_of("message", anna).value();
  EXPECT_FALSE(signer_of("another", signature, anna.text, authority.text).has_value());
  EXPECT_FALSE(signer_of("message", "", anna.text, authority.text).has_value());
  EXPECT_FALSE(signer_of("message", signature, "", authority.text).has_value());
}

TEST(CertificatesTest, ARenewedOneHasTheKeyOfTheOneBefore) {
  const auto authority = make_authority("authority", 10).value();
  const auto one = make_certificate(authority, "robot alpha", false, 1).value();
  const auto next = make_certificate(authority, "robot alpha", false, 2, {}, one.key);
  ASSERT_TRUE(next) << next.error().message;
  EXPECT_NE(next->text, one.text);
  EXPECT_EQ(next->key, one.key);
  EXPECT_EQ(key_hash_of(next->text).value(), key_hash_of(one.text).value());
  EXPECT_NE(key_hash_of(make_certificate(authority, "robot alpha", false, 1)->text).value(),
            key_hash_of(one.text).value());
  EXPECT_FALSE(make_certificate(authority, "robot alpha", false, 1, {}, "no key"));
}

TEST(CertificatesTest, ThatOfABusHasTheNamesOfItsMachineToo) {
  const auto authority = make_authority("authority", 10).value();
  const auto bus =
      make_certificate(authority, "bus.tutti", true, 1, {"base.local", "10.0.0.1", "fe80::1", "bus.tutti"});
  ASSERT_TRUE(bus) << bus.error().message;
  EXPECT_EQ(names_of(bus->text).value(), (std::vector<std::string>{"bus.tutti", "base.local", "10.0.0.1", "fe80::1"}));
  EXPECT_TRUE(names_of(authority.text)->empty());
  for (const char* wrong : {"", "a b", "base.local,DNS:bank.example", "*", "base/"}) {
    const auto refused = make_certificate(authority, "bus.tutti", true, 1, {wrong});
    ASSERT_FALSE(refused) << wrong;
    EXPECT_NE(refused.error().message.find("base.local"), std::string::npos) << "what is expected";
  }
}

/// A robot without a battery for its clock begins in 1970, or with the day of its image.
TEST(CertificatesTest, TheyAreValidForAClockThatIsYearsBehind) {
  const auto authority = make_authority("authority", 10).value();
  for (const auto& made : {authority, make_certificate(authority, "bus.tutti", true, 1).value(),
                           make_certificate(authority, "robot alpha", false, 1).value()}) {
    const std::unique_ptr<BIO, decltype(&BIO_free)> text(
        BIO_new_mem_buf(made.text.data(), static_cast<int>(made.text.size())), &BIO_free);
    const std::unique_ptr<X509, decltype(&X509_free)> read(PEM_read_bio_X509(text.get(), nullptr, nullptr, nullptr),
                                                           &X509_free);
    ASSERT_NE(read, nullptr);
    std::time_t in_1971 = 365L * 24L * 3600L;
    EXPECT_LT(X509_cmp_time(X509_get0_notBefore(read.get()), &in_1971), 0);
  }
}

TEST(CertificatesTest, WhatIsNoCertificateIsRefused) {
  const auto authority = make_authority("authority", 10).value();
  EXPECT_FALSE(valid_until(""));
  EXPECT_FALSE(key_hash_of(authority.key));
  EXPECT_FALSE(valid_until(authority.key));
  EXPECT_FALSE(make_certificate({authority.text, ""}, "a", false, 1));
  EXPECT_FALSE(make_certificate({"", authority.key}, "a", false, 1));
  EXPECT_FALSE(make_certificate(authority, std::string(100, 'a'), false, 1));  // X.509 names have 64 letters
}

}  // namespace certificates_test
}  // namespace tutti::pki
