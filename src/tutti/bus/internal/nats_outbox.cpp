// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/internal/nats_outbox.hpp"

#include <algorithm>
#include <charconv>
#include <limits>
#include <vector>

#include "tutti/base/content_hash.hpp"
#include "tutti/bus/internal/nats_names.hpp"

namespace tutti::bus {
namespace {

// 512 kB of parts without confirmation: 4 s at 1 Mbit/s.
constexpr std::size_t kUnderWay = 4;
constexpr auto kConfirmation = std::chrono::seconds(20);
constexpr auto kAgain = std::chrono::milliseconds(500);

/// Session and index of a submap, "submap/ROBOT/SESSION/INDEX/..."; the highest of anything else.
std::pair<std::uint64_t, std::uint64_t> age_of(std::string_view id) {
  constexpr std::uint64_t kHighest = std::numeric_limits<std::uint64_t>::max();
  std::pair<std::uint64_t, std::uint64_t> age{kHighest, kHighest};
  const std::size_t robot = id.find('/');
  const std::size_t session = robot == std::string_view::npos ? robot : id.find('/', robot + 1);
  if (session == std::string_view::npos || !id.starts_with("submap/")) return age;
  const char* const end = id.data() + id.size();
  const auto first = std::from_chars(id.data() + session + 1, end, age.first);
  if (first.ec != std::errc() || first.ptr == end || *first.ptr != '/') return {kHighest, kHighest};
  const auto second = std::from_chars(first.ptr + 1, end, age.second);
  if (second.ec != std::errc() || second.ptr == end || *second.ptr != '/') return {kHighest, kHighest};
  return age;
}

}  // namespace

Outbox::Order Outbox::order_of(const Piece& piece) {
  if (piece.delivery == Delivery::best_effort) return {0, 0, 0, piece.number};
  if (piece.delivery == Delivery::retained) return {1, 0, 0, piece.number};
  const auto [session, index] = age_of(piece.id);
  return {2, ~session, ~index, piece.number};
}

Status Outbox::add(const Envelope& envelope) {
  const Delivery delivery = delivery_of(envelope.kind);
  const std::size_t size = envelope.bytes->size();
  const bool cut = delivery == Delivery::durable;
  const std::size_t most = cut ? kPartBytes * kMostParts : kLargestWhole;
  if (size > most)
    return fail(ErrorCode::invalid, "{} {}: {} bytes, at most {} can be sent", word_of(envelope.kind), envelope.id,
                size, most);
  const bool bounded = cut || delivery == Delivery::work_queue;
  const std::uint64_t content = bounded ? content_hash(*envelope.bytes) : 0;
  if (bounded && waits(envelope, content)) return {};
  if (bounded && bytes_ + size > max_waiting_bytes_)
    return fail(ErrorCode::io, "{} {}: {} bytes wait to be sent already, {} may", word_of(envelope.kind), envelope.id,
                bytes_, max_waiting_bytes_);
  Piece piece{.delivery = delivery, .subject = subject_of(mission_, envelope), .whole = envelope.bytes};
  if (!bounded && envelope.kind != MessageKind::submap_copy) drop_waiting(delivery, &piece.subject);
  const auto parts =
      cut ? static_cast<std::uint32_t>(std::max<std::size_t>(1, (size + kPartBytes - 1) / kPartBytes)) : 1;
  for (std::uint32_t i = 0; i < parts; ++i) {
    piece.number = next_number_++;
    piece.begin = i * kPartBytes;
    piece.size = cut ? std::min(kPartBytes, size - piece.begin) : size;
    if (bounded) piece.id = to_string(Part{envelope.kind, envelope.id, i, parts, content});
    bytes_ += piece.size;
    waiting_.emplace(order_of(piece), piece);
  }
  return {};
}

/// Its last part goes last.
bool Outbox::waits(const Envelope& envelope, std::uint64_t content) const {
  std::string id = to_string(Part{envelope.kind, envelope.id, 0, 1, content});
  id.resize(id.rfind('/') + 1);
  const auto is_part = [&](const Piece& piece) { return piece.id.starts_with(id); };
  return std::ranges::any_of(waiting_, [&](const auto& other) { return is_part(other.second); }) ||
         std::ranges::any_of(under_way_, [&](const auto& other) { return is_part(other.second.piece); });
}

bool Outbox::is_under_way(const std::string& subject) const {
  return std::ranges::any_of(under_way_, [&](const auto& sent) { return sent.second.piece.subject == subject; });
}

std::optional<Outbox::Piece> Outbox::next(Time now) {
  for (auto at = waiting_.begin(); at != waiting_.end(); ++at) {
    const Delivery delivery = at->second.delivery;
    if (delivery != Delivery::best_effort && (now < not_before_ || under_way_.size() >= kUnderWay)) return std::nullopt;
    if (delivery == Delivery::retained && is_under_way(at->second.subject)) continue;  // the older could be stored last
    Piece piece = std::move(at->second);
    waiting_.erase(at);
    if (delivery == Delivery::best_effort)
      bytes_ -= piece.size;
    else
      under_way_.insert_or_assign(piece.number, UnderWay{piece, now + kConfirmation});
    if (delivery != Delivery::best_effort && !unconfirmed_since_) unconfirmed_since_ = now;
    return piece;
  }
  return std::nullopt;
}

void Outbox::confirm(std::uint64_t number) {
  unconfirmed_since_.reset();
  const auto found = under_way_.find(number);
  if (found == under_way_.end()) return;
  bytes_ -= found->second.piece.size;
  under_way_.erase(found);
}

/// Not a retained value that a newer one waits to replace.
void Outbox::put_back(Piece piece) {
  const auto newer = [&](const auto& other) { return other.second.subject == piece.subject; };
  if (piece.delivery == Delivery::retained && std::ranges::any_of(waiting_, newer))
    bytes_ -= piece.size;
  else
    waiting_.emplace(order_of(piece), std::move(piece));
}

void Outbox::refuse(std::uint64_t number, Time now) {
  not_before_ = now + kAgain;
  const auto found = under_way_.find(number);
  if (found == under_way_.end()) return;
  Piece piece = std::move(found->second.piece);
  under_way_.erase(found);
  put_back(std::move(piece));
}

void Outbox::refuse_all(Time now) {
  not_before_ = now + kAgain;
  resend_all();
}

void Outbox::expire(Time now) {
  std::vector<Piece> late;
  for (const auto& [number, sent] : under_way_)
    if (sent.until <= now) late.push_back(sent.piece);
  for (Piece& piece : late) {
    under_way_.erase(piece.number);
    put_back(std::move(piece));
  }
}

void Outbox::resend_all() { expire(Time::max()); }

void Outbox::forget_best_effort() { drop_waiting(Delivery::best_effort, nullptr); }

/// Those of a subject, if one is named.
void Outbox::drop_waiting(Delivery delivery, const std::string* subject) {
  std::erase_if(waiting_, [&](const auto& other) {
    const Piece& piece = other.second;
    const bool drop = piece.delivery == delivery && (subject == nullptr || piece.subject == *subject);
    if (drop) bytes_ -= piece.size;
    return drop;
  });
}

}  // namespace tutti::bus
