// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/lab/children.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstring>
#include <thread>

#include "tutti/base/file.hpp"

namespace tutti::lab {
namespace {

constexpr auto kPolitely = std::chrono::seconds(30);
constexpr auto kPollForEnd = std::chrono::milliseconds(20);

std::string end_of(const std::filesystem::path& output) {
  constexpr std::size_t kTail = 1000;
  const std::string text = read_file(output.string()).value_or("");
  return text.substr(text.size() - std::min(text.size(), kTail));
}

}  // namespace

Status Children::start(const std::string& name, std::vector<std::string> command, const std::filesystem::path& output) {
  std::vector<char*> arguments;
  for (std::string& argument : command) arguments.push_back(argument.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, output.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  posix_spawn_file_actions_adddup2(&files, STDOUT_FILENO, STDERR_FILENO);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);  // Ctrl-C is for us; they are stopped by us
  pid_t pid = -1;
  const int error = posix_spawn(&pid, arguments[0], &files, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
  if (error != 0) return fail(ErrorCode::io, "{}: cannot be started: {}", command[0], std::strerror(error));
  running_[name] = {pid, output};
  return {};
}

Status Children::check() {
  for (auto& [name, child] : running_) {
    int status = 0;
    if (waitpid(child.pid, &status, WNOHANG) != child.pid) continue;
    const std::string how = WIFEXITED(status) ? fmt::format("exit code {}", WEXITSTATUS(status))
                                              : fmt::format("signal {}", WTERMSIG(status));
    const std::filesystem::path output = child.output;
    const std::string who = name;
    running_.erase(name);
    return fail(ErrorCode::io, "{} has ended ({}): {} ({})", who, how, end_of(output), output.string());
  }
  return {};
}

void Children::stop(const std::vector<std::string>& names) {
  for (const std::string& name : names)
    if (const auto child = running_.find(name); child != running_.end()) kill(child->second.pid, SIGTERM);
  const auto end = std::chrono::steady_clock::now() + kPolitely;
  for (const std::string& name : names) {
    const auto child = running_.find(name);
    if (child == running_.end()) continue;
    while (waitpid(child->second.pid, nullptr, WNOHANG) == 0) {
      if (std::chrono::steady_clock::now() > end) kill(child->second.pid, SIGKILL);
      std::this_thread::sleep_for(kPollForEnd);
    }
    running_.erase(child);
  }
}

void Children::stop_all() {
  std::vector<std::string> names;
  for (const auto& [name, child] : running_) names.push_back(name);
  stop(names);
}

}  // namespace tutti::lab
