// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <thread>

#include "tutti/base/file.hpp"

namespace tutti::test {

/// A nats-server with JetStream and some lines of configuration of the test's own, such as users.
class NatsProcess {
 public:
  NatsProcess(const std::filesystem::path& folder, const std::string& lines) {
    const std::string file = (folder / "configuration").string();
    EXPECT_TRUE(write_file(file, "listen: \"127.0.0.1:-1\"\nports_file_dir: \"" + folder.string() +
                                     "\"\njetstream { store_dir: \"" + (folder / "js").string() +
                                     "\", max_file: 256MB }\n" + lines + "\n"));
    child_ = fork();
    if (child_ == 0) {
      prctl(PR_SET_PDEATHSIG, SIGKILL);
      const int nothing = open("/dev/null", O_WRONLY);
      dup2(nothing, STDOUT_FILENO);
      dup2(nothing, STDERR_FILENO);
      execlp("nats-server", "nats-server", "-c", file.c_str(), nullptr);
      execl("/usr/sbin/nats-server", "nats-server", "-c", file.c_str(), nullptr);
      _exit(1);
    }
    const std::string ports = (folder / ("nats-server_" + std::to_string(child_) + ".ports")).string();
    for (int i = 0; i < 500 && url_.empty(); ++i, std::this_thread::sleep_for(std::chrono::milliseconds(10))) {
      const std::string text = std::filesystem::exists(ports) ? read_file(ports).value_or("") : "";
      const std::size_t begin = text.find("nats://"), end = text.find('"', begin);
      if (begin != std::string::npos && end != std::string::npos) url_ = text.substr(begin, end - begin);
    }
    EXPECT_FALSE(url_.empty());
  }
  ~NatsProcess() {
    kill(child_, SIGKILL);
    waitpid(child_, nullptr, 0);
  }
  NatsProcess(const NatsProcess&) = delete;
  NatsProcess& operator=(const NatsProcess&) = delete;
  [[nodiscard]] const std::string& url() const { return url_; }

 private:
  pid_t child_ = -1;
  std::string url_;
};

}  // namespace tutti::test
