// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/later_answers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "tutti/base/check.hpp"

namespace tutti::node {

void LaterAnswers::note_newest(Timestamp newest, Timestamp now) {
  const std::int64_t ahead_ns = now.ns - newest.ns;
  ahead_ns_ = knows_ahead_ ? std::min(ahead_ns_, ahead_ns) : ahead_ns;
  knows_ahead_ = true;
}

void LaterAnswers::add(const std::string& job, ClosureVerdict verdict, std::vector<Timestamp> known_at) {
  TUTTI_CHECK(known_at.size() == verdict.closures.size() && std::ranges::is_sorted(known_at) && knows_ahead_,
              "{} closures with {} stamps", verdict.closures.size(), known_at.size());
  awaited_[job].push_back({std::move(verdict), std::move(known_at)});
}

std::vector<Verdicts> LaterAnswers::take_due(Timestamp now) {
  std::vector<Verdicts> out;
  for (auto job = awaited_.begin(); job != awaited_.end();) {
    Verdicts answer{.job = job->first, .verdicts = {}, .failed = {}, .why = {}};
    for (Awaited& awaited : job->second) {
      const auto known = static_cast<std::size_t>(
          std::ranges::find_if(awaited.known_at, [&](Timestamp stamp) { return here(stamp) > now; }) -
          awaited.known_at.begin());
      if (known <= awaited.answered) continue;
      awaited.answered = known;
      ClosureVerdict verdict = awaited.verdict;
      verdict.closures.resize(known);
      answer.verdicts.push_back(std::move(verdict));
    }
    std::erase_if(job->second, [](const Awaited& awaited) { return awaited.answered == awaited.known_at.size(); });
    const bool is_last = job->second.empty();
    if (!is_last) answer.job = part_of(job->first);
    if (!answer.verdicts.empty()) out.push_back(std::move(answer));
    job = is_last ? awaited_.erase(job) : std::next(job);
  }
  return out;
}

std::optional<Timestamp> LaterAnswers::next_due() const {
  std::optional<Timestamp> next;
  for (const auto& [job, all] : awaited_)
    for (const Awaited& awaited : all) {
      const Timestamp due = here(awaited.known_at[awaited.answered]);
      next = std::min(next.value_or(due), due);
    }
  return next;
}

std::string LaterAnswers::part_of(const std::string& job) { return fmt::format("{}+{}", job, ++parts_); }

}  // namespace tutti::node
