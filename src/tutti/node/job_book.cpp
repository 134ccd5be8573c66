// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/job_book.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <system_error>
#include <utility>

namespace tutti::node {
namespace {

constexpr unsigned kMostDoubled = 10;
constexpr double kFailedAgain = 0.1;  // of the time for an answer

}  // namespace

double try_again_after_s(double timeout_s, unsigned failures) {
  return kFailedAgain * timeout_s * static_cast<double>(1U << std::min(failures - 1, kMostDoubled));
}

std::string JobBook::next_name() const { return fmt::format("{}{}", prefix_, given_); }

std::optional<std::uint64_t> JobBook::number_of(std::string_view name) const {
  std::uint64_t number = 0;
  if (!name.starts_with(prefix_)) return std::nullopt;
  const char* const end = name.data() + name.size();
  const auto read = std::from_chars(name.data() + prefix_.size(), end, number);
  const bool is_given = read.ec == std::errc() && read.ptr == end && number < given_;
  return is_given ? std::optional(number) : std::nullopt;
}

std::set<SubmapId> JobBook::submaps_of(const OpenJob& job) {
  std::set<SubmapId> out;
  for (const SubmapPair& pair : job.pairs) out.insert({pair.first, pair.second});
  if (job.refinement)
    for (const RefinementJob::Part& part : job.refinement->parts) out.insert(part.submap);
  return out;
}

void JobBook::open(OpenJob job) {
  std::ranges::sort(job.pairs);
  for (const SubmapId& submap : submaps_of(job)) ++needed_[submap];
  open_.emplace(given_++, std::move(job));
}

std::optional<JobBook::OpenJob> JobBook::close(std::string_view name, Timestamp now) {
  const auto number = number_of(name);
  if (!number) return std::nullopt;
  auto job = open_.extract(*number);
  if (job)
    for (const SubmapId& submap : submaps_of(job.mapped()))
      if (const auto needed = needed_.find(submap); --needed->second == 0) needed_.erase(needed);
  for (auto later = open_.upper_bound(*number); later != open_.end(); ++later) later->second.since = now;
  return job ? std::optional(std::move(job.mapped())) : std::nullopt;
}

std::optional<JobBook::OpenJob> JobBook::find(std::string_view name) const {
  const auto number = number_of(name);
  const auto found = number ? open_.find(*number) : open_.end();
  return found == open_.end() ? std::nullopt : std::optional(found->second);
}

Timestamp JobBook::due(const OpenJob& job) const {
  return job.since + timeout_s_ * static_cast<double>(1U << std::min(job.asked, kMostDoubled));
}

std::vector<JobBook::OpenJob> JobBook::take_late(Timestamp now) {
  std::vector<OpenJob> late;
  if (timeout_s_ <= 0.0) return late;
  for (auto& [number, job] : open_) {
    if (job.is_replaced || due(job) > now) continue;
    late.push_back(job);
    job.is_replaced = true;
  }
  return late;
}

std::optional<Timestamp> JobBook::next_due() const {
  std::optional<Timestamp> next;
  if (timeout_s_ <= 0.0) return next;
  for (const auto& [number, job] : open_)
    if (!job.is_replaced) next = std::min(next.value_or(due(job)), due(job));
  return next;
}

FailedPairs::Next FailedPairs::note(const SubmapPair& pair, Timestamp now) {
  Failed& failed = failed_[pair];
  if (failed.again) return Next::nothing;
  if (++failed.times >= most_tries_) {
    failed_.erase(pair);
    return Next::give_up;
  }
  if (timeout_s_ <= 0.0) return Next::ask_now;
  failed.again = now + try_again_after_s(timeout_s_, failed.times);
  return Next::ask_later;
}

std::vector<SubmapPair> FailedPairs::take_due(Timestamp now) {
  std::vector<SubmapPair> due;
  for (auto& [pair, failed] : failed_)
    if (failed.again && *failed.again <= now) {
      failed.again.reset();
      due.push_back(pair);
    }
  return due;
}

std::optional<Timestamp> FailedPairs::next_due() const {
  std::optional<Timestamp> next;
  for (const auto& [pair, failed] : failed_)
    if (failed.again) next = std::min(next.value_or(*failed.again), *failed.again);
  return next;
}

std::size_t FailedPairs::waiting() const {
  return static_cast<std::size_t>(
      std::ranges::count_if(failed_, [](const auto& failed) { return failed.second.again.has_value(); }));
}

}  // namespace tutti::node
