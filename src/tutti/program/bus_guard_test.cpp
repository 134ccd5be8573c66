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

class BusGuardTest : public ::testing::Test {
 protected:
  void SetUp() override { fs::remove_all(folder_); }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path folder_ = fs::path(::testing::TempDir()) / ("guard_" + std::to_string(getpid()));
};

TEST_F(BusGuardTest, SaysWhoWasRefusedWhatAndNotTooOften) {
  auto pki = pki::Pki::make(folder_, "cave").value();
  ASSERT_TRUE(pki.add(bus::BusRole::robot, "alpha", 3));
  auto guard = BusGuard::open(folder_, "cave").value();
  EXPECT_EQ(guard.credentials().known->role, bus::BusRole::server);
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
}

TEST_F(BusGuardTest, ARobotHasTheNameOfItsCredential) {
  auto pki = pki::Pki::make(folder_, "cave").value();
  auto guard = BusGuard::open(folder_, "cave").value();
  EXPECT_EQ(guard.objection(RobotId{3}, "alpha"), "");
  ASSERT_TRUE(pki.add(bus::BusRole::robot, "alpha", 3));
  guard.look();
  EXPECT_EQ(guard.objection(RobotId{3}, "alpha"), "");
  EXPECT_NE(guard.objection(RobotId{3}, "bravo"), "");
}

TEST_F(BusGuardTest, TheFolderOfAnotherMissionIsRefused) {
  EXPECT_FALSE(BusGuard::open(folder_, "cave"));
  ASSERT_TRUE(pki::Pki::make(folder_, "cave"));
  const auto other = BusGuard::open(folder_, "tunnel");
  ASSERT_FALSE(other);
  EXPECT_NE(other.error().message.find("'cave'"), std::string::npos) << other.error().message;
}

}  // namespace bus_guard_test
}  // namespace tutti::program
