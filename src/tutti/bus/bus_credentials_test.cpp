// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/bus_credentials.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>

#include "tutti/base/file.hpp"

namespace tutti::bus {
namespace bus_credentials_test {

std::string block(const std::string& label, const std::string& line) {
  return "-----BEGIN " + label + "-----\n" + line + "\n-----END " + label + "-----\n";
}

BusCredentials alpha() {
  BusCredentials out;
  out.known = {.role = BusRole::robot, .name = "alpha", .number = 7, .mission = "cave"};
  out.key = {"UOPEN", "SUSEED"};
  out.certificate = {block("CERTIFICATE", "OWN"), block("PRIVATE KEY", "KEY")};
  out.authority = block("CERTIFICATE", "CA");
  return out;
}

TEST(BusCredentialsTest, WhatIsWrittenIsRead) {
  for (const BusRole role : {BusRole::server, BusRole::robot, BusRole::worker, BusRole::operates, BusRole::views}) {
    BusCredentials credentials = alpha();
    credentials.known->role = role;
    EXPECT_EQ(parse_credentials(credentials_text(credentials)).value(), credentials);
    EXPECT_EQ(role_of(name(role)), role);
  }
  EXPECT_EQ(to_string(*alpha().known), "robot alpha");
}

/// And errors never show what is in it.
TEST(BusCredentialsTest, AFileThatLacksALineIsRefused) {
  const std::string whole = credentials_text(alpha());
  for (std::size_t begin = whole.find('\n') + 1; begin < whole.size();) {
    const std::size_t end = whole.find('\n', begin) + 1;
    const auto read = parse_credentials(whole.substr(0, begin) + whole.substr(end));
    ASSERT_FALSE(read) << "without " << whole.substr(begin, end - begin);
    EXPECT_EQ(read.error().code, ErrorCode::configuration);
    EXPECT_EQ(read.error().message.find("SEED"), std::string::npos);
    begin = end;
  }
}

TEST(BusCredentialsTest, ARenewedFileIsTakenAndAnothersIsNot) {
  BusCredentials before = alpha(), renewed = alpha(), other = alpha();
  renewed.certificate.text = block("CERTIFICATE", "NEW");
  other.known->name = "bravo";
  before.file = (std::filesystem::path(::testing::TempDir()) / ("renewed_" + std::to_string(getpid()))).string();
  EXPECT_EQ(read_again(before), before);  // there is none
  for (const BusCredentials& now : {renewed, other}) {
    ASSERT_TRUE(write_file(before.file, credentials_text(now)));
    EXPECT_EQ(read_again(before).certificate.text, now == renewed ? renewed.certificate.text : before.certificate.text);
    EXPECT_EQ(read_again(before).file, before.file);
  }
  std::filesystem::remove(before.file);
}

TEST(BusCredentialsTest, AUserIsAnsweredWhereNobodyElseListens) {
  EXPECT_EQ(inbox_of(alpha(), "lease_cave"), "_INBOX.robot.7");
  EXPECT_EQ(inbox_of({"user", "password"}, "robot_7"), "_INBOX.robot_7");
}

}  // namespace bus_credentials_test
}  // namespace tutti::bus
