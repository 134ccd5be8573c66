// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/nats_child.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "tutti/base/file.hpp"
#include "tutti/base/own_file.hpp"
#include "tutti/bus/bus_address.hpp"
#include "tutti/bus/bus_rights.hpp"
#include "tutti/bus/internal/nats_connection.hpp"

namespace tutti::bus {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr auto kWaitForPort = std::chrono::seconds(2);
constexpr auto kPollEvery = std::chrono::milliseconds(3);
constexpr auto kReadsWithin = std::chrono::seconds(10);  // or the signal to read its configuration comes again
constexpr auto kOthersMayEnd = std::chrono::seconds(2);  // the nats-server of a killed process ends a little later
constexpr std::uintmax_t kMostLog = 8U << 20U;           // then it begins again: strangers make it grow
constexpr const char* kConfiguration = "configuration";  // in its folder
constexpr std::string_view kProgram = "nats-server";
constexpr const char* kElsewhere = "/usr/sbin/nats-server";

/// Messages of up to 8 MB pass, which copies of submaps need. The default write_deadline of 10 s cuts off a receiver of
/// 2 MB over 1 Mbit/s.
std::string configuration(const fs::path& folder, const NatsChildOptions& options, int port) {
  const std::string host = to_string(HostPort{parse_host_port(options.host).value_or(HostPort{options.host}).host});
  const std::string listen_at = fmt::format("{}:{}", host, port == 0 ? -1 : port);
  return fmt::format(R"(server_name: tutti
listen: "{}"
ports_file_dir: "{}"
max_payload: 8388608
max_pending: 67108864
write_deadline: "60s"
jetstream {{ store_dir: "{}", max_mem: 64MB, max_file: {} }}
{})",
                     listen_at, folder.string(), (folder / "js").string(), options.max_store_bytes, options.rights);
}

/// The last lines that report that something is wrong, or the last ones.
std::string complaint_of(const fs::path& log) {
  const std::string text = read_file(log.string()).value_or("");
  if (const std::size_t fatal = text.rfind("[FTL]"); fatal != std::string::npos)
    return text.substr(fatal + 6, text.find('\n', fatal) - fatal - 6);
  constexpr std::size_t kTail = 400;
  return text.substr(text.size() - std::min(text.size(), kTail));
}

/// The address at which nats-server has written that it listens; "" when it is not there yet.
std::string url_in(const fs::path& ports) {
  std::error_code none;
  if (!fs::exists(ports, none)) return {};
  const std::string text = read_file(ports.string()).value_or("");
  const std::size_t begin = std::min(text.find("nats://"), text.find("tls://"));
  const std::size_t end = text.find('"', begin);
  return begin == std::string::npos || end == std::string::npos ? "" : text.substr(begin, end - begin);
}

fs::path ports_file(const fs::path& folder, int pid) { return folder / fmt::format("nats-server_{}.ports", pid); }

int port_of(const std::string& url) { return std::atoi(url.substr(url.rfind(':') + 1).c_str()); }

/// JetStream answers.
bool is_ready(const std::string& url, const NatsChildOptions& child) {
  const BusOptions where{.url = url, .allow_insecure = true, .credentials = child.credentials};
  const auto connection = NatsConnection::open(where, "child");
  return connection && (*connection)->has_jetstream();
}

}  // namespace

NatsChild::NatsChild(fs::path folder, NatsChildOptions options)
    : folder_(std::move(folder)), options_(std::move(options)) {}

NatsChild::~NatsChild() {
  process_.reset();
  if (lock_ >= 0) close(lock_);
}

bool NatsChild::running() const { return process_ && !process_->ended(); }

Status NatsChild::lock_folder() {
  const fs::path file = folder_ / "lock";
  const auto opened = open_own_file(file, O_CREAT | O_RDWR, 0600);
  if (!opened) return tl::unexpected(opened.error());
  lock_ = *opened;
  const auto end = Clock::now() + kOthersMayEnd;
  while (flock(lock_, LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK) return fail(ErrorCode::io, "{}: {}", file.string(), std::strerror(errno));
    if (Clock::now() > end)
      return fail(ErrorCode::io, "{}: another nats-server has this folder: two would destroy its messages",
                  folder_.string());
    std::this_thread::sleep_for(kPollEvery);
  }
  return {};
}

Status NatsChild::check_disk(std::uint64_t needed) const {
  struct statvfs disk {};
  if (statvfs(folder_.c_str(), &disk) != 0)
    return fail(ErrorCode::io, "{}: {}", folder_.string(), std::strerror(errno));
  const std::uint64_t free = std::uint64_t{disk.f_bavail} * disk.f_frsize;
  if (free >= needed) return {};
  return fail(ErrorCode::io,
              "{}: {} bytes are free on this disk, expected at least {}: nats-server hangs on a full one",
              folder_.string(), free, needed);
}

/// The port and the address are known, and JetStream answers.
Status NatsChild::wait_until_ready() {
  const auto end = Clock::now() + std::chrono::duration<double>(options_.start_timeout_s);
  const fs::path ports = ports_file(folder_, pid_);
  while (true) {
    if (const std::string url = url_in(ports); !url.empty() && is_ready(url, options_)) {
      url_ = url;
      return replace_file(folder_ / "port", std::to_string(port_of(url)), false);
    }
    const std::string log = (folder_ / "log").string();
    if (process_->ended()) return fail(ErrorCode::io, "nats-server: {} ({})", complaint_of(log), log);
    if (Clock::now() > end)
      return fail(ErrorCode::io, "nats-server: not ready after {} s: {} ({})", options_.start_timeout_s,
                  complaint_of(log), log);
    std::this_thread::sleep_for(kPollEvery);
  }
}

/// Nats-server 2.9 looks through who is connected with the list of certificates that it had before it read a new one
/// (`recheckPinnedCerts`). So it reads each change twice, the second time with a list that differs by nobody's.
Result<bool> NatsChild::configure(int port) {
  std::string text = configuration(folder_, options_, port);
  const bool is_new = text != configured_;
  if (!is_new && !reads_again_) return false;
  std::string written = text;
  const std::size_t pinned = text.find(kPinned);
  if (pinned != std::string::npos && !has_nobody_)
    written.insert(pinned + kPinned.size(), fmt::format("\"{:064}\", ", 0));
  if (Status done = replace_file(folder_ / kConfiguration, written, false, 0600); !done)
    return tl::unexpected(done.error());
  has_nobody_ = !has_nobody_;
  reads_again_ = is_new && running() && pinned != std::string::npos;
  configured_ = std::move(text);
  return true;
}

Status NatsChild::launch(int port) {
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder_, ignored))
    if (entry.path().extension() == ".ports") fs::remove(entry.path(), ignored);  // of killed ones
  if (const auto written = configure(port); !written) return tl::unexpected(written.error());
  const fs::path file = folder_ / kConfiguration;
  process_.reset();
  const auto log = open_own_file(folder_ / "log", O_CREAT | O_WRONLY | O_TRUNC | O_APPEND, 0600);
  if (!log) return tl::unexpected(log.error());
  log_read_ = 0;
  signalled_.reset();
  process_ = std::make_unique<ChildProcess>(ChildCommand{.words = {options_.program, "-c", file.string()},
                                                         .elsewhere = options_.program == kProgram ? kElsewhere : "",
                                                         .output = *log,
                                                         .inherits = lock_});
  close(*log);
  pid_ = process_->pid();
  if (const int error = process_->failure(); error == ENOENT)
    return fail(ErrorCode::io, "{}: not installed (Debian: apt install nats-server)", options_.program);
  else if (error != 0)
    return fail(ErrorCode::io, "{}: cannot be started: {}", options_.program, std::strerror(error));
  Status ready = wait_until_ready();
  if (!ready) process_.reset();
  return ready;
}

Result<std::unique_ptr<NatsChild>> NatsChild::start(const fs::path& folder, const NatsChildOptions& options) {
  const auto at = parse_host_port(options.host);
  if (!at) return tl::unexpected(at.error());
  if (!options.allow_insecure && options.rights.empty() && !is_loopback(at->host))
    return fail(
        ErrorCode::configuration,
        "host {}: others than this machine could write to it: needs TLS and rights (tutti pki), or allow_insecure",
        options.host);
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return fail(ErrorCode::io, "{}: cannot be made: {}", folder.string(), error.message());
  std::unique_ptr<NatsChild> child(new NatsChild(fs::absolute(folder), options));
  if (const Status locked = child->lock_folder(); !locked) return tl::unexpected(locked.error());
  if (const Status room = child->check_disk(options.max_store_bytes + options.min_free_bytes); !room)
    return tl::unexpected(room.error());
  const Status launched = options.port != 0 ? child->launch(options.port) : child->launch_anywhere();
  if (!launched) return tl::unexpected(launched.error());
  return child;
}

/// Where it was the last time: others know it by that address, so one that is still ending is waited for. Otherwise
/// below the ports that systems give to clients: there a client that reconnects to a bus which is gone can reach
/// itself, and keep its port.
Status NatsChild::launch_anywhere() {
  constexpr int kFirst = 20000, kPorts = 10000, kTries = 10;
  const int last = std::atoi(read_file((folder_ / "port").string()).value_or("0").c_str());
  const auto end = Clock::now() + kWaitForPort;
  Status launched = fail(ErrorCode::io, "nats-server: no port yet");
  while (last != 0 && !launched && Clock::now() < end) {
    launched = launch(last);
    if (!launched) std::this_thread::sleep_for(10 * kPollEvery);
  }
  for (int i = 0; i < kTries && !launched; ++i) launched = launch(kFirst + (7 * getpid() + i) % kPorts);
  return launched;
}

Status NatsChild::tend() {
  if (const Status room = check_disk(options_.min_free_bytes / 2); !room) {
    process_.reset();
    return room;
  }
  if (!running()) return launch(port_of(url_));
  read_log();
  if (signalled_ && Clock::now() < *signalled_ + kReadsWithin) return {};  // of two signals that wait it sees one
  const auto changed = signalled_ ? Result<bool>(true) : configure(port_of(url_));
  if (!changed) return tl::unexpected(changed.error());
  if (!*changed) return {};
  kill(pid_, SIGHUP);
  signalled_ = Clock::now();
  return {};
}

NatsChild::Refusals NatsChild::take_refusals() {
  read_log();
  return std::exchange(refusals_, {});
}

void NatsChild::read_log() {
  const std::string file = (folder_ / "log").string();
  std::ifstream log(file);
  log.seekg(static_cast<std::streamoff>(log_read_));
  std::string line;
  while (std::getline(log, line) && !log.eof()) {  // what ends without a newline is not whole yet
    log_read_ += line.size() + 1;
    if (has_read_configuration(line)) signalled_.reset();
    auto refusal = refusal_of(line);
    if (refusal && refusals_.all.size() < kMostRefusals)
      refusals_.all.push_back(std::move(*refusal));
    else if (refusal)
      ++refusals_.more;
  }
  if (log_read_ > kMostLog && truncate(file.c_str(), 0) == 0) log_read_ = 0;
}

std::vector<std::string> buses_of_this_machine() {
  std::vector<std::string> out;
  std::error_code gone;  // processes end while they are looked at
  for (const auto& process : fs::directory_iterator("/proc", gone)) {
    const int pid = std::atoi(process.path().filename().c_str());
    struct stat owner {};
    if (pid <= 0 || ::stat(process.path().c_str(), &owner) != 0 || (owner.st_uid != geteuid() && owner.st_uid != 0))
      continue;
    if (read_file((process.path() / "comm").string()).value_or("") != "nats-server\n") continue;
    const std::string command = read_file((process.path() / "cmdline").string()).value_or("");
    const std::size_t flag = command.find(std::string("\0-c\0", 4));  // ends of arguments are zeros
    if (flag == std::string::npos) continue;
    const fs::path file = command.substr(flag + 4).c_str();
    if (file.filename() != kConfiguration) continue;
    const fs::path folder = fs::read_symlink(process.path() / "cwd", gone) / file.parent_path();
    if (std::string url = url_in(ports_file(folder, pid)); !url.empty()) out.push_back(std::move(url));
  }
  std::ranges::sort(out);
  return out;
}

}  // namespace tutti::bus
