// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/internal/nats_inbox.hpp"

#include <algorithm>
#include <memory>
#include <utility>

#include "tutti/base/content_hash.hpp"
#include "tutti/bus/delivery.hpp"

namespace tutti::bus {
namespace {

constexpr std::ptrdiff_t kMostBestEffort = 4096;  // of a kind
constexpr std::ptrdiff_t kMostRequestsOfOne = 64;
constexpr std::size_t kMostDone = 10'000;

}  // namespace

bool Inbox::add_part(Endpoint from, const Part& part, std::string_view bytes, std::string reply, Time now,
                     const std::string& user) {
  const Name name{from, part.kind, part.id, part.content, user};
  if (part.count > 1 && bytes.size() > kPartBytes) return false;
  if (done_.contains(name)) {
    strays_.push_back(std::move(reply));
    return true;
  }
  const auto found = messages_.try_emplace(name).first;
  Message& message = found->second;
  const std::size_t before = message.assembly.size();
  if (!message.assembly.add(part, bytes, std::move(reply))) return false;
  if (message.ticket != 0) return true;
  if (!message.assembly.complete()) {
    if (message.grown == 0 || message.assembly.size() > before)
      note_growth(found, message.assembly.size() - before, now);
    keep_bounds(from, now);
    return true;
  }
  forget_half(found);
  auto whole = std::make_shared<const std::string>(message.assembly.take_bytes());
  if (content_hash(*whole) != part.content) {
    for (const auto& [index, other] : message.assembly.replies())
      if (index != part.index) strays_.push_back(other);
    messages_.erase(found);
    return false;
  }
  message.ticket = ++last_ticket_;
  message.size = whole->size();
  held_bytes_ += message.size;
  held_.emplace(message.ticket, name);
  untaken_.push_back({{from, self_, part.kind, part.id, std::move(whole), user}, message.ticket});
  return true;
}

void Inbox::note_growth(Messages::iterator half, std::size_t bytes, Time now) {
  const auto& [name, message] = *half;
  Halves& of_sender = halves_of_[std::get<Endpoint>(name)];
  for (Halves* halves : {&of_sender, &all_halves_}) {
    if (message.grown == 0) ++halves->messages;
    halves->bytes += bytes;
  }
  halves_.erase(message.grown);
  half->second.grown = ++growths_;
  half->second.half_bytes += bytes;
  half->second.since = now;
  halves_.emplace(growths_, name);
}

void Inbox::forget_half(Messages::iterator half) {
  auto& [name, message] = *half;
  if (message.grown == 0) return;  // whole with its first part
  const std::size_t bytes = message.half_bytes;
  const auto of_sender = halves_of_.find(std::get<Endpoint>(name));
  for (Halves* halves : {&of_sender->second, &all_halves_}) {
    --halves->messages;
    halves->bytes -= bytes;
  }
  if (of_sender->second.messages == 0) halves_of_.erase(of_sender);
  halves_.erase(std::exchange(message.grown, 0));
}

void Inbox::give_up(Messages::iterator half) {
  for (const auto& [index, reply] : half->second.assembly.replies()) strays_.push_back(reply);
  forget_half(half);
  messages_.erase(half);
  ++given_up_;
}

Inbox::Messages::iterator Inbox::oldest_half_of(Endpoint from) {
  const auto found =
      std::ranges::find_if(halves_, [&](const auto& half) { return std::get<Endpoint>(half.second) == from; });
  return messages_.find(found->second);
}

/// The message that has just grown is the newest, and alone it is below every bound.
void Inbox::keep_bounds(Endpoint from, Time now) {
  const auto exceeds = [](const Halves& halves, std::size_t messages, std::size_t bytes) {
    return halves.messages > messages || halves.bytes > bytes;
  };
  while (exceeds(halves_of_.at(from), kMostHalves, kMostHalfBytes)) give_up(oldest_half_of(from));
  const auto oldest = [&] { return messages_.find(halves_.begin()->second); };
  while (exceeds(all_halves_, kMostHalvesInAll, kMostHalfBytesInAll) || oldest()->second.since + kLongestHalf < now)
    give_up(oldest());
}

void Inbox::put_retained(Endpoint from, MessageKind kind, std::string bytes) {
  std::erase_if(untaken_, [&](const Received& other) { return other.envelope.kind == kind; });
  untaken_.push_back({{from, self_, kind, "", std::make_shared<const std::string>(std::move(bytes))}, ++last_ticket_});
}

void Inbox::put_returned(MessageKind kind, std::string id, std::string bytes) {
  untaken_.push_back(
      {{Endpoint::any_worker(), self_, kind, std::move(id), std::make_shared<const std::string>(std::move(bytes))},
       ++last_ticket_});
}

void Inbox::put_best_effort(Endpoint from, MessageKind kind, std::string bytes) {
  const auto is_alike = [&](const Received& other) { return other.envelope.kind == kind; };
  const auto is_of_one = [&](const Received& other) { return is_alike(other) && other.envelope.from == from; };
  const auto keep = [&](std::ptrdiff_t most, const auto& condition) {
    if (std::ranges::count_if(untaken_, condition) >= most) untaken_.erase(std::ranges::find_if(untaken_, condition));
  };
  if (kind == MessageKind::status) keep(1, is_of_one);
  if (kind == MessageKind::submap_request) keep(kMostRequestsOfOne, is_of_one);
  keep(kMostBestEffort, is_alike);
  untaken_.push_back({{from, self_, kind, "", std::make_shared<const std::string>(std::move(bytes))}, ++last_ticket_});
}

std::vector<Received> Inbox::take() {
  std::vector<Received> taken(std::make_move_iterator(untaken_.begin()), std::make_move_iterator(untaken_.end()));
  untaken_.clear();
  return taken;
}

void Inbox::acknowledge(std::uint64_t ticket) {
  const auto found = held_.find(ticket);
  if (found == held_.end()) return;  // needs none
  Message& message = messages_.at(found->second);
  if (message.acknowledged) return;
  message.acknowledged = true;
  acknowledged_.push_back(ticket);
}

std::vector<std::string> Inbox::replies_of(std::uint64_t ticket) const {
  std::vector<std::string> replies;
  if (const auto found = held_.find(ticket); found != held_.end())
    for (const auto& [index, reply] : messages_.at(found->second).assembly.replies()) replies.push_back(reply);
  return replies;
}

std::optional<Inbox::Acknowledgement> Inbox::next_acknowledgement() const {
  if (acknowledged_.empty()) return std::nullopt;
  return Acknowledgement{acknowledged_.front(), replies_of(acknowledged_.front())};
}

void Inbox::forget_stream(MessageKind kind) {
  for (auto at = messages_.begin(); at != messages_.end();) {
    const auto here = at++;
    if (std::get<MessageKind>(here->first) != kind) continue;
    if (here->second.ticket == 0) {
      forget_half(here);
      messages_.erase(here);
    } else {
      here->second.assembly.forget_replies();
    }
  }
  strays_.clear();  // of other kinds too: these come again
}

void Inbox::forget(std::uint64_t ticket) {
  const auto found = held_.find(ticket);
  if (found == held_.end()) return;
  done_.insert(found->second);
  done_in_order_.push_back(found->second);
  if (done_in_order_.size() > kMostDone) {
    done_.erase(done_in_order_.front());
    done_in_order_.pop_front();
  }
  held_bytes_ -= messages_.at(found->second).size;
  messages_.erase(found->second);
  held_.erase(found);
  std::erase(acknowledged_, ticket);
}

std::vector<std::string> Inbox::unacknowledged() const {
  std::vector<std::string> all;
  for (const auto& [name, message] : messages_)
    if (!message.acknowledged)
      for (const auto& [index, reply] : message.assembly.replies()) all.push_back(reply);
  return all;
}

}  // namespace tutti::bus
