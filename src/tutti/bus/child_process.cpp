// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/child_process.hpp"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <string_view>
#include <utility>

namespace tutti::bus {
namespace {

constexpr int kLater = 10;  // nice: beside a program of 0 it gets a tenth of a core that both want
constexpr auto kPolitely = std::chrono::seconds(3);  // then it is killed

/// Between fork and exec, where only a few calls are allowed: never returns. The error of exec goes to `errors`.
[[noreturn]] void become(const ChildCommand& command, char** arguments, char** environment, pid_t parent, int errors) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(1);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  setpgid(0, 0);  // Ctrl-C is for us; it is stopped by us
  if (command.output >= 0) {
    dup2(command.output, STDOUT_FILENO);
    dup2(command.output, STDERR_FILENO);
  }
  if (command.inherits >= 0) fcntl(command.inherits, F_SETFD, 0);
  if (command.most_data_bytes > 0) {
    const rlimit most{command.most_data_bytes, command.most_data_bytes};
    setrlimit(RLIMIT_DATA, &most);
  }
  if (command.goes_first) {
    setpriority(PRIO_PROCESS, 0, kLater);
    constexpr std::string_view kFirst = "800";
    const int score = open("/proc/self/oom_score_adj", O_WRONLY | O_CLOEXEC);
    static_cast<void>(!write(score, kFirst.data(), kFirst.size()));
  }
  execvpe(arguments[0], arguments, environment);
  if (errno == ENOENT && !command.elsewhere.empty()) execve(command.elsewhere.c_str(), arguments, environment);
  const int error = errno;
  static_cast<void>(!write(errors, &error, sizeof error));
  _exit(1);
}

}  // namespace

ChildProcess::ChildProcess(ChildCommand command) {
  thread_ = std::thread([this, command = std::move(command)]() mutable { run(command); });
  std::unique_lock guard(mutex_);
  changed_.wait(guard, [&] { return pid_ >= 0 || failure_ != 0; });
}

ChildProcess::~ChildProcess() {
  {
    std::unique_lock guard(mutex_);
    for (const int signal : {SIGINT, SIGKILL}) {
      if (!ended_ && pid_ > 0) ::kill(pid_, signal);
      if (signal == SIGINT) changed_.wait_for(guard, kPolitely, [&] { return ended_; });
    }
  }
  thread_.join();
}

int ChildProcess::failure() const {
  const std::scoped_lock guard(mutex_);
  return failure_;
}

bool ChildProcess::ended() const {
  const std::scoped_lock guard(mutex_);
  return ended_;
}

std::optional<int> ChildProcess::exit_code() const {
  const std::scoped_lock guard(mutex_);
  return exit_code_;
}

int ChildProcess::pid() const {
  const std::scoped_lock guard(mutex_);
  return pid_;
}

void ChildProcess::kill() {
  const std::scoped_lock guard(mutex_);
  if (!ended_ && pid_ > 0) ::kill(pid_, SIGKILL);
}

void ChildProcess::run(ChildCommand& command) {
  std::vector<char*> environment;
  for (char** one = environ; *one != nullptr; ++one) {
    const std::string_view variable = *one;
    const bool is_ours = variable.starts_with("TUTTI_") && !command.has_our_variables;
    if (!is_ours && !variable.starts_with("NOTIFY_SOCKET="))
      environment.push_back(*one);  // that is this program's to use
  }
  environment.push_back(nullptr);
  std::vector<char*> arguments;
  for (std::string& word : command.words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  int errors[2] = {-1, -1};
  if (pipe2(errors, O_CLOEXEC) != 0) return report(-1, errno);
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child == 0) become(command, arguments.data(), environment.data(), parent, errors[1]);
  int error = child < 0 ? errno : 0;
  close(errors[1]);
  static_cast<void>(!read(errors[0], &error, sizeof error));
  close(errors[0]);
  report(child, error);
  if (child < 0) return;
  siginfo_t ended{};
  while (waitid(P_PID, static_cast<id_t>(child), &ended, WEXITED | WNOWAIT) != 0 && errno == EINTR) continue;
  const std::scoped_lock guard(mutex_);  // nobody signals it from here on: its number is free after waitpid
  waitpid(child, nullptr, 0);
  ended_ = true;
  if (ended.si_code == CLD_EXITED) exit_code_ = ended.si_status;
  changed_.notify_all();
}

void ChildProcess::report(pid_t child, int failure) {
  const std::scoped_lock guard(mutex_);
  pid_ = child;
  failure_ = failure;
  if (child < 0) ended_ = true;
  changed_.notify_all();
}

}  // namespace tutti::bus
