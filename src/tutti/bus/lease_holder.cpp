// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/lease_holder.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <limits>
#include <system_error>

#include "tutti/base/file.hpp"
#include "tutti/base/plain_text.hpp"
#include "tutti/base/utc_text.hpp"

namespace tutti::bus {
namespace {

constexpr std::size_t kLongestLease = 8192;  // bytes; the bus takes no larger value
constexpr std::size_t kFields = 6;

template <class Number>
bool read_whole(std::string_view text, Number& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size();
}

/// The space in which a process has its number: "pid:[4026531836]". Empty without /proc.
std::string space_of_numbers() {
  std::array<char, 64> name{};
  const ssize_t size = readlink("/proc/self/ns/pid", name.data(), name.size());
  return size <= 0 ? "" : std::string(name.data(), static_cast<std::size_t>(size));
}

/// Field 22 of /proc/N/stat, in ticks since boot; empty when there is no such process, or it is not shown.
std::string start_of(std::uint64_t process) {
  const auto stat = read_file(fmt::format("/proc/{}/stat", process));
  if (!stat) return {};
  std::string_view rest = *stat;
  rest.remove_prefix(std::min(rest.size(), rest.rfind(')') + 1));  // the program's name may have blanks
  constexpr int kFieldsToStart = 20;
  for (int i = 0; i < kFieldsToStart; ++i) {
    const std::size_t blank = rest.find(' ');
    if (blank == std::string_view::npos) return {};
    rest.remove_prefix(blank + 1);
  }
  return std::string(rest.substr(0, rest.find(' ')));
}

std::string mark_before_random(std::uint64_t process) {
  return fmt::format("{} {} ", space_of_numbers(), start_of(process));
}

}  // namespace

std::string to_string(const LeaseHolder& holder) {
  return fmt::format("process {} on {}, state {}, since {}", holder.process, holder.host, holder.state,
                     utc_text(holder.since_ns));
}

std::string lease_text(const LeaseHolder& holder) {
  return fmt::format("{}\n{}\n{}\n{}\n{}\n{}\n", plain_text(holder.host), holder.process, plain_text(holder.state),
                     holder.since_ns, plain_text(holder.seat), plain_text(holder.mark));
}

std::optional<LeaseHolder> lease_of(std::string_view text) {
  if (text.size() > kLongestLease || !text.ends_with('\n')) return std::nullopt;
  std::array<std::string_view, kFields> fields;
  std::size_t count = 0;
  for (; !text.empty(); ++count) {
    if (count == fields.size()) return std::nullopt;
    const std::size_t end = text.find('\n');
    fields[count] = text.substr(0, end);
    text.remove_prefix(end + 1);
  }
  LeaseHolder holder;
  const bool is_lease = count == kFields && read_whole(fields[1], holder.process) &&
                        read_whole(fields[3], holder.since_ns) && !fields[4].empty();
  if (!is_lease) return std::nullopt;
  holder.host = plain_text(std::string(fields[0]));
  holder.state = plain_text(std::string(fields[2]));
  holder.seat = plain_text(std::string(fields[4]));
  holder.mark = plain_text(std::string(fields[5]));
  return holder;
}

std::string process_mark(std::uint64_t random) {
  return fmt::format("{}{:016x}", mark_before_random(static_cast<std::uint64_t>(getpid())), random);
}

bool has_ended(const LeaseHolder& holder, const LeaseHolder& own) {
  const std::string space = space_of_numbers();
  if (holder.seat != own.seat || space.empty() || !holder.mark.starts_with(space + " ")) return false;
  const auto process = static_cast<pid_t>(holder.process);
  if (process <= 0 || static_cast<std::uint64_t>(process) != holder.process) return false;
  if (kill(process, 0) != 0 && errno == ESRCH) return true;
  const std::string start = start_of(holder.process);
  return !start.empty() && !holder.mark.starts_with(fmt::format("{} {} ", space, start));
}

}  // namespace tutti::bus
