// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/bus_address.hpp"

#include <gtest/gtest.h>

#include <string>

namespace tutti::bus {
namespace bus_address_test {

TEST(BusAddressTest, OnlyAddressesOfThisMachineAreItsOwn) {
  for (const char* host : {"127.0.0.1", "127.1.2.3", "::1", "::ffff:127.0.0.1", "localhost"})
    EXPECT_TRUE(is_loopback(host)) << host;
  for (const char* host : {"127.0.0.1.example.invalid", "127.example.invalid", "10.0.0.1", "0.0.0.0", "::", "::2",
                           "::ffff:10.0.0.1", "[::1]", "", "localhost.example.invalid"})
    EXPECT_FALSE(is_loopback(host)) << host;
}

TEST(BusAddressTest, HostsAndPortsAreRead) {
  const auto read = [](const char* text) { return parse_host_port(text).value(); };
  EXPECT_EQ(read("base"), (HostPort{"base", 0}));
  EXPECT_EQ(read("10.0.0.1:4222"), (HostPort{"10.0.0.1", 4222}));
  EXPECT_EQ(read("::1"), (HostPort{"::1", 0}));
  EXPECT_EQ(read("[::1]:4222"), (HostPort{"::1", 4222}));
  EXPECT_EQ(to_string(HostPort{"::1", 4222}), "[::1]:4222");
  for (const char* text : {"", ":4222", "base:", "base:0", "base:65536", "base:4222x", "[::1", "[::1]4222", "a b",
                           "a\"b", "a/b:1", "a,b:1", "[]:1", "[base]:1", "a\nb"})
    EXPECT_FALSE(parse_host_port(text).has_value()) << text;
}

TEST(BusAddressTest, CredentialsLeaveAUrlWhereItIsRead) {
  const BusUrl url = parse_bus_url("tls://alpha:se:cr@t@base:4222").value();
  EXPECT_EQ(url.plain, "tls://base:4222");
  EXPECT_EQ(url.scheme, "tls");
  EXPECT_EQ(url.at, (HostPort{"base", 4222}));
  EXPECT_EQ(url.credentials, (BusCredentials{"alpha", "se:cr@t"}));
  EXPECT_EQ(parse_bus_url("nats://token@base:4222")->credentials, (BusCredentials{"", "token"}));
  EXPECT_EQ(parse_bus_url("127.0.0.1:4222")->plain, "nats://127.0.0.1:4222");
  EXPECT_EQ(parse_bus_url("nats://[::1]:4222/")->plain, "nats://[::1]:4222");
}

TEST(BusAddressTest, WhatIsNoUrlIsRefusedWithoutItsPassword) {
  for (const std::string text :
       {"nats://alpha:hidden@", "nats://alpha:hidden@a b:1", "nats://:hidden@base:1", "na ts://alpha:hidden@base:1",
        "://alpha:hidden@base:1", "alpha:hidden@base/elsewhere:1"}) {
    const auto read = parse_bus_url(text);
    ASSERT_FALSE(read.has_value()) << text;
    EXPECT_EQ(read.error().message.find("hidden"), std::string::npos) << read.error().message;
    EXPECT_EQ(without_credentials(text).find("hidden"), std::string::npos);
  }
  EXPECT_EQ(without_credentials("nats://base:4222"), "nats://base:4222");
}

TEST(BusAddressTest, CredentialsAreTheFirstLineOfAFile) {
  EXPECT_EQ(parse_credentials("alpha:secret\r\nmore").value(), (BusCredentials{"alpha", "secret"}));
  for (const char* text : {"", "\n", "alpha:", ":secret", "two words"}) {
    const auto read = parse_credentials(text);
    ASSERT_FALSE(read.has_value()) << text;
    EXPECT_EQ(read.error().message.find("secret"), std::string::npos) << read.error().message;
  }
}

}  // namespace bus_address_test
}  // namespace tutti::bus
