// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/bus_guard.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>

#include "tutti/pki/pki.hpp"

namespace tutti::program {
namespace bus_guard_test {

namespace fs = std::filesystem;

const std::string kNow = "2026-01-31 12:00:00 UTC", kMuchLater = "2126-01-31 12:00:00 UTC";

class BusGuardTest : public ::testing::Test {
 protected:
  void SetUp() override { fs::remove_all(folder_); }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path folder_ = fs::path(::testing::TempDir()) / ("guard_" + std::to_string(getpid()));
};

TEST_F(BusGuardTest, SaysWhoWasRefusedWhatAndNotTooOften) {
  auto pki = pki::Pki::make(folder_, "cave").value();
  ASSERT_TRUE(pki.add(bus::BusRole::robot, "alpha", 3));
  auto guard = BusGuard::open(folder_, "cave", kNow).value();
  EXPECT_EQ(guard.credentials().known->role, bus::BusRole::server);
  EXPECT_TRUE(guard.check(kNow).empty());
  const std::string key = pki.members().back().key;
  bus::NatsChild::Refusals many;
  for (int i = 0; i < 500; ++i) many.all.push_back({"10.0.0.7:1", key, "publish mission.cave.robot.4.submap"});
  many.more = 100;
  const auto lines = guard.lines(many, 0.0);
  ASSERT_FALSE(lines.empty());
  EXPECT_LE(lines.size(), 20U);
  EXPECT_EQ(guard.refused(), 600U);
  for (const char* part : {"robot alpha", "10.0.0.7:1", "publish mission.cave.robot.4.submap"})
    EXPECT_NE(lines.front().find(part), std::string::npos) << lines.front();
  const auto stranger = guard.lines({{{"10.0.0.9:1", "", "authentication error"}}, 0}, 0.0);
  ASSERT_EQ(stranger.size(), 1U);
  EXPECT_NE(stranger.front().find("a stranger"), std::string::npos) << stranger.front();
  ASSERT_TRUE(pki.revoke("alpha"));
  EXPECT_TRUE(guard.check(kNow).empty());
  const auto lost = guard.lines({{{"10.0.0.9:2", "", "authentication error - Nkey \"" + key + "\""}}, 0}, 0.0);
  ASSERT_EQ(lost.size(), 1U);
  for (const char* part : {"a stranger", "robot alpha, revoked"})
    EXPECT_NE(lost.front().find(part), std::string::npos) << lost.front();
}

TEST_F(BusGuardTest, WhoseCertificateHasExpiredHasNoRightsUntilItIsRenewed) {
  auto pki = pki::Pki::make(folder_, "cave").value();
  ASSERT_TRUE(pki.add(bus::BusRole::robot, "alpha", 3));
  ASSERT_TRUE(pki.add(bus::BusRole::robot, "bravo", 4, -1));  // since yesterday
  const auto key = [&](const std::string& name) {
    for (const pki::Member& member : pki.members())
      if (member.user.name == name) return member.key;
    return std::string();
  };
  auto guard = BusGuard::open(folder_, "cave", kNow).value();
  const auto has = [&](const std::string& name) { return guard.rights().find(key(name)) != std::string::npos; };
  EXPECT_TRUE(has("bravo"));
  const std::string until = pki.members().back().until;
  EXPECT_TRUE(guard.check(until).empty());
  EXPECT_TRUE(has("bravo"));
  const auto lines = guard.check(until + "x");  // just after
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_NE(lines.front().find("robot bravo has expired (" + until), std::string::npos) << lines.front();
  EXPECT_FALSE(has("bravo"));
  EXPECT_TRUE(has("alpha"));
  EXPECT_TRUE(guard.check(until + "x").empty()) << "said once";
  ASSERT_TRUE(pki.renew("bravo"));
  EXPECT_TRUE(guard.check(until + "x").empty());
  EXPECT_TRUE(has("bravo"));
  EXPECT_EQ(guard.check(kMuchLater).size(), 2U);
  EXPECT_FALSE(has("alpha"));
  EXPECT_TRUE(has("server")) << "without its own bus there is no mission";
}

TEST_F(BusGuardTest, AFolderThatCannotBeReadIsTroubleAndWhatWasReadCounts) {
  ASSERT_TRUE(pki::Pki::make(folder_, "cave"));
  auto guard = BusGuard::open(folder_, "cave", kNow).value();
  const std::string rights = guard.rights();
  std::filesystem::rename(folder_ / "users", folder_ / "elsewhere");
  std::vector<std::string> lines;
  for (int i = 0; i < BusGuard::kMostUnread; ++i) {
    EXPECT_EQ(guard.trouble(), "") << "it may be being changed";
    lines = guard.check(kNow);
  }
  EXPECT_NE(guard.trouble().find("users"), std::string::npos) << guard.trouble();
  EXPECT_EQ(lines, std::vector<std::string>{guard.trouble()}) << "it is in the log, once";
  EXPECT_TRUE(guard.check(kNow).empty());
  EXPECT_EQ(guard.rights(), rights);
  std::filesystem::rename(folder_ / "elsewhere", folder_ / "users");
  EXPECT_TRUE(guard.check(kNow).empty());
  EXPECT_EQ(guard.trouble(), "");
}

TEST_F(BusGuardTest, ARobotHasTheNameOfItsCredential) {
  auto pki = pki::Pki::make(folder_, "cave").value();
  auto guard = BusGuard::open(folder_, "cave", kNow).value();
  EXPECT_EQ(guard.objection(RobotId{3}, "alpha"), "");
  ASSERT_TRUE(pki.add(bus::BusRole::robot, "alpha", 3));
  EXPECT_TRUE(guard.check(kNow).empty());
  EXPECT_EQ(guard.objection(RobotId{3}, "alpha"), "");
  EXPECT_NE(guard.objection(RobotId{3}, "bravo"), "");
}

TEST_F(BusGuardTest, TheFolderOfAnotherMissionIsRefused) {
  EXPECT_FALSE(BusGuard::open(folder_, "cave", kNow));
  ASSERT_TRUE(pki::Pki::make(folder_, "cave"));
  const auto other = BusGuard::open(folder_, "tunnel", kNow);
  ASSERT_FALSE(other);
  EXPECT_NE(other.error().message.find("'cave'"), std::string::npos) << other.error().message;
}

}  // namespace bus_guard_test
}  // namespace tutti::program
