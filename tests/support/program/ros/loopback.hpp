// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "tutti/program/ros/dds.hpp"

namespace tutti::ros::test {

/// A domain that no other test on this machine is in: two in one hear each other. Held until the process ends.
inline std::uint32_t free_domain() {
  constexpr std::uint32_t kFirst = 100, kLast = 199;
  for (std::uint32_t domain = kFirst; domain < kLast; ++domain) {
    const auto path = std::filesystem::temp_directory_path() / ("tutti_test_domain_" + std::to_string(domain));
    const int file = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (file >= 0 && flock(file, LOCK_EX | LOCK_NB) == 0) return domain;
    if (file >= 0) close(file);
  }
  return kLast;
}

/// free_domain(), for this process and those that it starts.
inline std::uint32_t loopback_domain() {
  static const std::uint32_t domain = free_domain();
  setenv("ROS_DOMAIN_ID", std::to_string(domain).c_str(), 1);
  return domain;
}

inline std::shared_ptr<Participant> join_loopback() {
  return Participant::open(loopback_domain(), Reach::this_machine).value();
}

/// A reader that loses nothing.
inline constexpr Qos kKeepAll{.reliable = true, .latched = false, .depth = 0};

inline std::vector<std::string> taken(Reader& reader) {
  std::vector<std::string> out;
  reader.take([&](const Message& message) { out.emplace_back(message.cdr); });
  return out;
}

}  // namespace tutti::ros::test
