// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/internal/nats_inbox.hpp"

#include <algorithm>
#include <memory>

#include "tutti/bus/delivery.hpp"

namespace tutti::bus {
namespace {

constexpr std::ptrdiff_t kMostBestEffort = 1000;
constexpr std::size_t kMostDone = 10'000;

}  // namespace

bool Inbox::add_part(Endpoint from, const Part& part, std::string_view bytes, std::string reply) {
  const Name name{from, part.kind, part.id};
  if (done_.contains(name)) {
    strays_.push_back(std::move(reply));
    return true;
  }
  Message& message = messages_[name];
  if (!message.assembly.add(part, bytes, std::move(reply))) return false;
  if (!message.assembly.complete() || message.ticket != 0) return true;
  auto whole = std::make_shared<const std::string>(message.assembly.take_bytes());
  message.ticket = ++last_ticket_;
  message.size = whole->size();
  held_bytes_ += message.size;
  held_.emplace(message.ticket, name);
  untaken_.push_back({{from, self_, part.kind, part.id, std::move(whole)}, message.ticket});
  return true;
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
  const auto alike = [&](const Received& other) { return other.envelope.kind == kind; };
  if (std::ranges::count_if(untaken_, alike) >= kMostBestEffort) untaken_.erase(std::ranges::find_if(untaken_, alike));
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
  std::erase_if(messages_,
                [&](const auto& entry) { return std::get<1>(entry.first) == kind && entry.second.ticket == 0; });
  for (auto& [name, message] : messages_)
    if (std::get<1>(name) == kind) message.assembly.forget_replies();
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
