// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/nats_child.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>

#include "support/bus/nats_server.hpp"
#include "tutti/base/file.hpp"

namespace tutti::bus {
namespace nats_child_test {

namespace fs = std::filesystem;

/// A test of a disk that is full is not what these are.
const NatsChildOptions kSmall{.max_store_bytes = 64U << 20U, .min_free_bytes = 0};

class NatsChildTest : public ::testing::Test {
 protected:
  void SetUp() override {
    TUTTI_SKIP_WITHOUT_NATS_SERVER();
    folder_ = fs::path(::testing::TempDir()) / ("nats_child_" + std::to_string(getpid()));
    fs::remove_all(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  [[nodiscard]] std::unique_ptr<NatsChild> start(const NatsChildOptions& options = kSmall) const {
    auto child = NatsChild::start(folder_, options);
    EXPECT_TRUE(child.has_value()) << child.error().message;
    return child ? std::move(*child) : nullptr;
  }
  [[nodiscard]] std::string refusal(const NatsChildOptions& options) const {
    const auto child = NatsChild::start(folder_, options);
    return child ? "" : child.error().message;
  }
  fs::path folder_;
};

bool is_alive(int pid) { return kill(pid, 0) == 0; }

template <class Condition>
bool soon(Condition&& condition) {
  for (int i = 0; i < 500; ++i, std::this_thread::sleep_for(std::chrono::milliseconds(10)))
    if (condition()) return true;
  return false;
}

void expect_says(const std::string& message, std::initializer_list<const char*> parts) {
  for (const char* part : parts) EXPECT_NE(message.find(part), std::string::npos) << part << " in: " << message;
}

TEST_F(NatsChildTest, IsFoundOnThisMachineWhileItRuns) {
  auto child = start();
  ASSERT_NE(child, nullptr);
  const std::string url = child->url();
  EXPECT_EQ(std::ranges::count(buses_of_this_machine(), url), 1);
  child.reset();
  EXPECT_EQ(std::ranges::count(buses_of_this_machine(), url), 0);
}

TEST_F(NatsChildTest, StartsOnAFreePortOfThisMachineAndStopsWithItsOwner) {
  auto child = start();
  ASSERT_NE(child, nullptr);
  expect_says(child->url(), {"nats://127.0.0.1:"});
  EXPECT_TRUE(child->running());
  const int pid = child->pid();
  EXPECT_TRUE(is_alive(pid));
  const std::string url = child->url();
  child.reset();
  EXPECT_FALSE(is_alive(pid));
  EXPECT_EQ(read_file((folder_ / "log").string()).value().find("[ERR]"), std::string::npos);
  child = start();
  ASSERT_NE(child, nullptr);
  EXPECT_EQ(child->url(), url);  // where robots expect it
}

TEST_F(NatsChildTest, HasNoCredentialInItsEnvironment) {
  setenv("TUTTI_CREDENTIALS", "anna:secret", 1);
  const auto child = start();
  unsetenv("TUTTI_CREDENTIALS");
  ASSERT_NE(child, nullptr);
  std::ifstream file("/proc/" + std::to_string(child->pid()) + "/environ");
  const std::string environment{std::istreambuf_iterator<char>(file), {}};
  EXPECT_NE(environment.find("PATH="), std::string::npos);
  EXPECT_EQ(environment.find("secret"), std::string::npos);
}

TEST_F(NatsChildTest, WhoKillsItGetsItAgainAtTheSameAddress) {
  const auto child = start();
  ASSERT_NE(child, nullptr);
  const std::string url = child->url();
  const int pid = child->pid();
  kill(pid, SIGKILL);
  ASSERT_TRUE(soon([&] { return !child->running(); }));
  const Status tended = child->tend();
  ASSERT_TRUE(tended.has_value()) << tended.error().message;
  EXPECT_TRUE(child->running());
  EXPECT_EQ(child->url(), url);
  EXPECT_NE(child->pid(), pid);
  EXPECT_TRUE(child->tend());
}

TEST_F(NatsChildTest, ReportsWhatPreventsIt) {
  expect_says(refusal({.program = "nats-server-of-nobody"}), {"nats-server-of-nobody: not installed"});
  expect_says(refusal({.host = "0.0.0.0"}), {"0.0.0.0", "TLS"});
  expect_says(refusal({.min_free_bytes = std::uint64_t{1} << 60U}), {folder_.c_str(), "bytes are free"});
  expect_says(refusal({.program = "/bin/false", .min_free_bytes = 0}), {"nats-server: ", "log"});

  const int taken = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{.sin_family = AF_INET, .sin_addr = {htonl(INADDR_LOOPBACK)}};
  socklen_t size = sizeof address;
  ASSERT_EQ(bind(taken, reinterpret_cast<sockaddr*>(&address), size), 0);
  ASSERT_EQ(listen(taken, 1), 0);
  ASSERT_EQ(getsockname(taken, reinterpret_cast<sockaddr*>(&address), &size), 0);
  const int port = ntohs(address.sin_port);
  NatsChildOptions options = kSmall;
  options.port = port;
  expect_says(refusal(options), {std::to_string(port).c_str(), "in use"});
  ASSERT_TRUE(write_file((folder_ / "port").string(), std::to_string(port)));  // that of the last time
  EXPECT_NE(start(), nullptr);
  close(taken);
}

TEST_F(NatsChildTest, AFolderBelongsToOne) {
  const auto child = start();
  expect_says(refusal(kSmall), {folder_.c_str(), "another nats-server"});
  EXPECT_TRUE(child->running());
}

/// Not a test: what the next one runs and kills.
TEST(NatsChildOwner, DISABLED_Waits) {
  const auto child = NatsChild::start(std::getenv("TUTTI_NATS_CHILD_FOLDER"), kSmall);
  ASSERT_TRUE(child.has_value());
  ASSERT_TRUE(
      write_file(std::string(std::getenv("TUTTI_NATS_CHILD_FOLDER")) + "/pid", std::to_string((*child)->pid())));
  pause();
}

TEST_F(NatsChildTest, EndsWithAnOwnerThatIsKilled) {
  setenv("TUTTI_NATS_CHILD_FOLDER", folder_.c_str(), 1);
  const pid_t owner = fork();
  if (owner == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    execl("/proc/self/exe", "owner", "--gtest_filter=NatsChildOwner.*", "--gtest_also_run_disabled_tests", nullptr);
    _exit(1);
  }
  const std::string file = (folder_ / "pid").string();
  ASSERT_TRUE(soon([&] { return fs::exists(file) && !read_file(file).value_or("").empty(); }));
  const int pid = std::atoi(read_file(file).value().c_str());
  EXPECT_TRUE(is_alive(pid));
  kill(owner, SIGKILL);
  waitpid(owner, nullptr, 0);
  EXPECT_NE(start(), nullptr);  // at once
  EXPECT_TRUE(soon([&] { return !is_alive(pid); }));
}

}  // namespace nats_child_test
}  // namespace tutti::bus
