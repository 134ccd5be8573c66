// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/receipts.hpp"

#include <fmt/format.h>

#include <utility>

#include "tutti/base/content_hash.hpp"
#include "tutti/base/plain_text.hpp"
#include "tutti/node/map_meta.hpp"
#include "tutti/node/meta_keys.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::node {
namespace {

constexpr double kReceiptAgain_s = 60.0;
constexpr std::size_t kMostUnreadSessions = 100;
constexpr std::size_t kMostUnreadIntervals = 500;  // in each of these
constexpr std::size_t kMostRefused = 256;          // of a robot; the last ones
constexpr std::size_t kMostStrangers = 1000;       // who are sent something

}  // namespace

Receipt& Receipts::of_member(RobotId robot) {
  Receipt& receipt = members_[robot];
  receipt.robot = robot;
  return receipt;
}

Receipt* Receipts::of_anybody(RobotId robot, bool is_member, Timestamp now) {
  if (is_member || members_.contains(robot)) return &of_member(robot);
  if (strangers_.size() >= kMostStrangers && !strangers_.contains(robot))
    std::erase_if(strangers_, [&](const auto& entry) { return now - entry.second.heard >= kStrangerIsGone_s; });
  if (strangers_.size() >= kMostStrangers && !strangers_.contains(robot)) return nullptr;
  Stranger& stranger = strangers_[robot];
  stranger.heard = now;
  stranger.receipt.robot = robot;
  return &stranger.receipt;
}

const Receipt* Receipts::find(RobotId robot) const {
  if (const auto found = members_.find(robot); found != members_.end()) return &found->second;
  const auto found = strangers_.find(robot);
  return found == strangers_.end() ? nullptr : &found->second.receipt;
}

void Receipts::admit(RobotId robot) {
  if (auto known = strangers_.extract(robot)) members_.try_emplace(robot, std::move(known.mapped().receipt));
}

void Receipts::dismiss(RobotId robot, Timestamp now) {
  if (auto member = members_.extract(robot)) strangers_.insert({robot, {std::move(member.mapped()), now}});
}

bool Receipts::waits_too_long(RobotId robot, const NodeStatus& status, Timestamp now) {
  if (status.backlog_submaps == 0) {
    waits_since_.erase(robot);
    return false;
  }
  const auto since = waits_since_.try_emplace(robot, now).first;
  if (now - since->second < kReceiptAgain_s) return false;
  since->second = now;
  return true;
}

void note_unread(SubmapId id, Receipt& receipt) {
  const bool is_bounded = receipt.unread.size() < kMostUnreadSessions || receipt.unread.contains(id.chain.session);
  if (!receipt.contains(id) && is_bounded && receipt.unread[id.chain.session].intervals().size() < kMostUnreadIntervals)
    receipt.unread[id.chain.session].insert(id.index);
}

void forget_unread(SubmapId id, Receipt& receipt) {
  if (!receipt.leaves_unread(id)) return;
  NumberSet& numbers = receipt.unread.at(id.chain.session);
  numbers.erase(id.index);
  if (numbers.intervals().empty()) receipt.unread.erase(id.chain.session);
}

bool note_refused(SubmapId id, const std::string& bytes, const std::string& why, Receipt& receipt) {
  if (!receipt.refuse(id, content_hash(bytes), kMostRefused)) return false;
  receipt.why_refused = plain_text(why);
  return true;
}

storage::Write refusals_row(const Receipt& receipt) {
  const Receipt kept{.robot = receipt.robot,
                     .refused = receipt.refused,
                     .why_refused = receipt.why_refused,
                     .refusals = receipt.refusals};
  return {map_tables::kMeta, fmt::format("{}{}", kRefusedPrefix, receipt.robot.value), wire::encode(kept)};
}

}  // namespace tutti::node
