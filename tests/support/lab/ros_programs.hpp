// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>
#include <vector>

#include "support/bus/nats_network.hpp"
#include "support/program/ros/loopback.hpp"
#include "tutti/base/file.hpp"
#include "tutti/lab/children.hpp"

namespace tutti::ros::test {

/// tutti's programs in a folder of their own, on DDS over loopback. Needs the definition TUTTI_PROGRAM.
class Programs {
 public:
  /// `name`: of the folder, which is this process's. `patience_s`: for what a program is to print.
  Programs(const std::string& name, double patience_s)
      : folder_(std::filesystem::path(::testing::TempDir()) / (name + std::to_string(getpid()))),
        patience_s_(patience_s) {
    loopback_domain();
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  ~Programs() {
    children_.stop_all();
    std::filesystem::remove_all(folder_);
  }
  Programs(const Programs&) = delete;
  Programs& operator=(const Programs&) = delete;

 protected:
  void start(const std::string& name, std::vector<std::string> command, const std::vector<std::string>& more = {}) {
    command.insert(command.begin(), TUTTI_PROGRAM);
    command.insert(command.end(), more.begin(), more.end());
    const Status started = children_.start(name, command, folder_ / (name + ".txt"));
    ASSERT_TRUE(started) << started.error().message;
  }
  [[nodiscard]] std::string output_of(const std::string& name) const {
    return name + ": " + read_file((folder_ / (name + ".txt")).string()).value_or("no output") + "\n";
  }
  /// The bus that a server has printed.
  std::string bus_of(const std::string& server) {
    const auto bus = [&] {
      const std::string output = output_of(server);
      const std::size_t at = output.find("--bus ");
      return at == std::string::npos ? "" : output.substr(at + 6, output.find(' ', at + 6) - at - 6);
    };
    EXPECT_TRUE(tutti::test::within(patience_s_, [&] { return !bus().empty(); })) << output_of(server);
    return bus();
  }

  const std::filesystem::path folder_;
  lab::Children children_;

 private:
  double patience_s_;
};

}  // namespace tutti::ros::test
