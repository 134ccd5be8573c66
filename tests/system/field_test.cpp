// SPDX-License-Identifier: BSD-3-Clause
// The programs, in one process, where it is bad: a slow link that breaks at any byte and is away for ten minutes, a
// robot that joins late, disks that are full. Afterwards the map is that of nodes that talk to each other directly.
#include <gtest/gtest.h>
#include <nats/nats.h>
#include <sys/mount.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "support/bus/nats_network.hpp"
#include "support/bus/tcp_relay.hpp"
#include "support/lab/small_mission.hpp"
#include "tutti/base/file.hpp"
#include "tutti/lab/mission_source.hpp"
#include "tutti/program/robot_program.hpp"
#include "tutti/program/server_program.hpp"

namespace tutti {
namespace field_test {

namespace fs = std::filesystem;
using test::kNames;
using test::kPatience_s;
using test::kSession;
using test::mission_of;
using test::Running;
using test::TcpRelay;
using test::within;

class Field : public ::testing::Test {
 protected:
  void SetUp() override {
    TUTTI_SKIP_WITHOUT_NATS_SERVER();
    folder_ = fs::path(::testing::TempDir()) / fmt::format("field_{}", getpid());
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  void start_server(const lab::MissionSource& source, double rate) {
    server_.emplace([this, source, rate](const std::atomic<bool>& stop) {
      program::ServerOptions options{
          .state = folder_ / "server", .settings = lab::server_settings(source).value(), .rate = rate};
      options.announce = [this](const std::string& command) {
        const std::string url = command.substr(command.find("nats://"));
        bus_port_ = std::atoi(url.substr(url.rfind(':') + 1).c_str());
      };
      return program::run_server(options, stop);
    });
    ASSERT_TRUE(within(kPatience_s, [&] { return bus_port_ > 0 || server_->over(); }));
    ASSERT_FALSE(server_->over()) << server_->ended().error().message;
  }
  void start_robot(const lab::MissionSource& source, double rate, const std::string& name, int port) {
    robots_.push_back(std::make_unique<Running>([=, this](const std::atomic<bool>& stop) {
      program::RobotOptions options{.name = name,
                                    .bus = {.url = fmt::format("nats://127.0.0.1:{}", port)},
                                    .state = folder_ / name,
                                    .rate = rate,
                                    .session = kSession};
      if (Status ok = lab::fill_robot_options(source, options); !ok) return ok;
      return program::run_robot(options, stop);
    }));
  }
  [[nodiscard]] bool robots_end(double seconds) const {
    return within(seconds, [&] { return std::ranges::all_of(robots_, [](const auto& r) { return r->over(); }); });
  }
  [[nodiscard]] fs::path status_file() const { return folder_ / "server" / program::kStatusFile; }
  /// The map's status, as the server reports it; empty: it cannot be read.
  [[nodiscard]] std::string server_status() const { return read_file(status_file().string()).value_or(""); }

  fs::path folder_;
  std::atomic<int> bus_port_ = 0;
  std::optional<Running> server_;
  std::vector<std::unique_ptr<Running>> robots_;
};

/// A hundred times faster than real time 200 ms are 20 s of the mission and 8 Mbit/s are 80 kbit/s; torn at random
/// bytes; ten minutes of the mission without a link; the second robot joins after these.
TEST_F(Field, AfterTenMinutesOutOfRangeOnABadLinkNothingIsLost) {
  constexpr double kRate = 100.0;
  const auto source = mission_of(720, 30);
  start_server(source, kRate);
  ASSERT_FALSE(HasFatalFailure());
  TcpRelay relay(bus_port_, {.delay_s = 0.2, .bytes_per_s = 1e6, .bytes_between_cuts = 300'000});
  start_robot(source, kRate, kNames[0], relay.port());
  within(1.0, [] { return false; });
  relay.hold(true);
  within(600.0 / kRate, [] { return false; });
  relay.hold(false);
  start_robot(source, 2.0 * kRate, kNames[1], relay.port());
  EXPECT_TRUE(robots_end(kPatience_s)) << server_status();
  for (const auto& robot : robots_) EXPECT_TRUE(robot->over() && robot->ended().has_value());
  RecordProperty("cuts", static_cast<int>(relay.cuts()));
  EXPECT_GE(relay.cuts(), 1U);
  EXPECT_TRUE(test::server_ends(folder_ / "server")) << server_status();
  robots_.clear();
  server_.reset();
  test::expect_undisturbed_map(test::World(source), folder_ / "server");
}

/// A disk of memory, for root.
class SmallDisk {
 public:
  explicit SmallDisk(fs::path folder) : folder_(std::move(folder)) {
    mounted_ = mount("tutti_test", folder_.c_str(), "tmpfs", 0, "size=6g") == 0;  // which takes nothing yet
  }
  ~SmallDisk() {
    if (mounted_) umount2(folder_.c_str(), MNT_DETACH);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;
  [[nodiscard]] bool mounted() const { return mounted_; }
  /// To the last byte, or not any more.
  [[nodiscard]] bool fill(bool full) const {
    struct statvfs disk {};
    if (statvfs(folder_.c_str(), &disk) != 0) return false;
    const std::uint64_t used = std::uint64_t{disk.f_blocks - disk.f_bfree} * disk.f_frsize;
    const std::string size = full ? fmt::format("size={}", used) : "size=6g";
    return mount("tutti_test", folder_.c_str(), "tmpfs", MS_REMOUNT, size.c_str()) == 0;
  }

 private:
  fs::path folder_;
  bool mounted_ = false;
};

TEST_F(Field, OnFullDisksEverythingWaitsAndGoesOnWhenThereIsRoom) {
  constexpr double kRate = 25.0;
  const SmallDisk disk(folder_);
  if (!disk.mounted()) GTEST_SKIP() << "only root can make a small disk: nothing was tried";
  const auto source = mission_of(150, 10);
  start_server(source, kRate);
  ASSERT_FALSE(HasFatalFailure());
  for (const std::string& name : kNames) start_robot(source, kRate, name, bus_port_);
  const auto bus_runs = [&] {
    natsConnection* connection = nullptr;
    const bool runs =
        natsConnection_ConnectTo(&connection, fmt::format("nats://127.0.0.1:{}", bus_port_.load()).c_str()) == NATS_OK;
    natsConnection_Destroy(connection);
    return runs;
  };
  EXPECT_TRUE(bus_runs());
  within(2.0, [] { return false; });
  bool filled = false;
  EXPECT_TRUE(within(kPatience_s, [&] { return filled = filled || disk.fill(true); }));  // somebody may write meanwhile
  EXPECT_TRUE(within(kPatience_s, [&] { return !bus_runs(); }));  // it hangs on a full disk: it was stopped
  within(2.0, [] { return false; });
  for (const auto& robot : robots_) EXPECT_FALSE(robot->over());
  EXPECT_FALSE(server_->over());
  EXPECT_TRUE(disk.fill(false));
  EXPECT_TRUE(within(kPatience_s, bus_runs));
  EXPECT_TRUE(robots_end(kPatience_s)) << server_status();
  for (const auto& robot : robots_) EXPECT_TRUE(robot->over() && robot->ended().has_value());
  EXPECT_TRUE(test::server_ends(folder_ / "server")) << server_status();
  robots_.clear();
  server_.reset();
  test::expect_undisturbed_map(test::World(source), folder_ / "server");
}

}  // namespace field_test
}  // namespace tutti
