// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/stop.hpp"

#include <sys/prctl.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdint>
#include <string>
#include <utility>

#include "tutti/program/clock.hpp"

namespace tutti::program {
namespace {

std::atomic<bool> asked = false;
static_assert(std::atomic<bool>::is_always_lock_free);  // a handler writes it

std::atomic<const std::string*> announcement = nullptr;  // of this program's life
static_assert(decltype(announcement)::is_always_lock_free);

void ask(int /*signal*/) {
  asked = true;
  for (const int signal : {SIGTERM, SIGINT}) static_cast<void>(std::signal(signal, SIG_DFL));
  if (const std::string* said = announcement)
    if (write(STDERR_FILENO, said->data(), said->size()) < 0) return;  // nobody listens
}

}  // namespace

const std::atomic<bool>& stop_asked() { return asked; }

void stop_on_signals(std::string said_at_once) {
  if (!said_at_once.empty()) announcement = new std::string(std::move(said_at_once));
  struct sigaction action {};
  action.sa_handler = &ask;
  sigemptyset(&action.sa_mask);
  sigaction(SIGTERM, &action, nullptr);
  sigaction(SIGINT, &action, nullptr);
  // A file that may not grow is a full disk, which is for who writes to report.
  static_cast<void>(std::signal(SIGXFSZ, SIG_IGN));
}

void end_with_parent(int parent) {
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (getppid() != parent) asked = true;
}

void notify_service_manager(const char* state) { sd_notify(0, state); }

std::uint64_t wall_clock_ns() {
  return static_cast<std::uint64_t>(
      std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count());
}

}  // namespace tutti::program
