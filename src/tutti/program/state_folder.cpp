// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/state_folder.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <set>

#include "tutti/base/file.hpp"
#include "tutti/base/own_file.hpp"
#include "tutti/program/clock.hpp"

namespace tutti::program {

namespace fs = std::filesystem;

double StateFolder::age_s() const {
  const std::uint64_t now_ns = wall_clock_ns();
  return now_ns > made_ns_ ? static_cast<double>(now_ns - made_ns_) * 1e-9 : 0.0;  // clocks are set back at times
}

Result<StateFolder> StateFolder::open(const fs::path& folder, const std::string& owner, const std::string& brought) {
  umask(umask(0) | S_IWGRP | S_IRWXO);  // the program's, before it makes any file: 0640, folders 0750
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return fail(ErrorCode::io, "state folder {}: cannot be made: {}", folder.string(), error.message());
  StateFolder made(fs::absolute(folder));
  if (Status locked = made.lock(); !locked) return tl::unexpected(locked.error());
  if (Status read = made.read_or_make(owner, brought); !read) return tl::unexpected(read.error());
  return made;
}

StateFolder::~StateFolder() {
  if (lock_ >= 0) close(lock_);
}

Status StateFolder::lock() {
  const fs::path file = path_ / "lock";
  const auto opened = open_own_file(file, O_CREAT | O_RDWR, 0600);
  if (!opened) return tl::unexpected(opened.error());
  lock_ = *opened;
  if (flock(lock_, LOCK_EX | LOCK_NB) == 0) return {};
  return fail(ErrorCode::io, "state folder {}: another program that is running has it; two would spoil it",
              path_.string());
}

/// "tutti robot alpha" and the nanoseconds, a line each.
Status StateFolder::read_or_make(const std::string& owner, const std::string& brought) {
  const fs::path file = path_ / "owner";
  const std::string first = "tutti " + owner;
  std::error_code error;
  if (fs::exists(file, error)) {
    const auto text = read_file(file.string());
    if (!text) return tl::unexpected(text.error());
    const std::size_t end = text->find('\n');
    if (text->substr(0, end) != first)
      return fail(ErrorCode::io, "state folder {}: it is that of '{}', not of '{}'; every program has its own",
                  path_.string(), text->substr(0, end), first);
    made_ns_ = end == std::string::npos ? 0 : std::strtoull(text->c_str() + end + 1, nullptr, 10);
    if (made_ns_ > 0) return {};
    return fail(ErrorCode::parse, "{}: does not say when the folder was made", file.string());
  }
  // A program that was killed here before has left the beginnings of lock and owner.
  std::set<fs::path> known{path_ / "lock", beside_of(file)};
  if (fs::is_directory(path_ / "lost+found", error)) known.insert(path_ / "lost+found");  // a disk of its own
  if (!brought.empty())
    for (const char* end : {"", "-wal", "-shm"}) known.insert(path_ / (brought + end));
  for (const auto& entry : fs::directory_iterator(path_, error))
    if (!known.contains(entry.path()))
      return fail(ErrorCode::io, "state folder {}: holds '{}' and is none of tutti's; a new or an empty one is needed",
                  path_.string(), entry.path().filename().string());
  is_new_ = true;
  made_ns_ = wall_clock_ns();
  return replace_file(file, fmt::format("{}\n{}\n", first, made_ns_), true);
}

}  // namespace tutti::program
