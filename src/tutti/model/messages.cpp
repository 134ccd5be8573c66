// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/model/messages.hpp"

#include <algorithm>

#include "tutti/model/status.hpp"

namespace tutti {

bool Receipt::has_refusal_of(std::uint64_t session, std::uint32_t index) const {
  return std::ranges::any_of(refusals,
                             [&](const Refusal& kept) { return kept.session == session && kept.index == index; });
}

bool Receipt::refuses(SubmapId id, std::uint64_t content) const {
  const Refusal refusal{id.chain.session, id.index, content};
  return std::ranges::find(refusals, refusal) != refusals.end();
}

bool Receipt::refuse(SubmapId id, std::uint64_t content, std::size_t most) {
  const Refusal refusal{id.chain.session, id.index, content};
  if (std::ranges::find(refusals, refusal) != refusals.end()) return false;
  refusals.push_back(refusal);
  if (!contains(id)) refused[id.chain.session].insert(id.index);
  while (refusals.size() > most) {
    const Refusal oldest = refusals.front();
    refusals.erase(refusals.begin());
    if (!has_refusal_of(oldest.session, oldest.index)) remove_refused(oldest.session, oldest.index);
  }
  return true;
}

void Receipt::forget_refusals(SubmapId id) {
  std::erase_if(refusals,
                [&](const Refusal& kept) { return kept.session == id.chain.session && kept.index == id.index; });
  remove_refused(id.chain.session, id.index);
}

void Receipt::remove_refused(std::uint64_t session, std::uint32_t index) {
  const auto numbers = refused.find(session);
  if (numbers == refused.end()) return;
  numbers->second.erase(index);
  if (numbers->second.intervals().empty()) refused.erase(numbers);
}

Status MissionStatus::check() const {
  const auto not_after = [](const auto& a, const auto& b) { return a >= b; };
  if (std::ranges::adjacent_find(robots, not_after, &Robot::robot) == robots.end() &&
      std::ranges::adjacent_find(workers, not_after, &Worker::number) == workers.end())
    return {};
  return fail(ErrorCode::invalid, "robots or workers are not in the order of their numbers");
}

}  // namespace tutti
