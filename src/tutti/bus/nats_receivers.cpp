// SPDX-License-Identifier: BSD-3-Clause
// The threads of a JetStreamPort that receive.
#include <fmt/format.h>

#include <cstdlib>
#include <utility>

#include "tutti/bus/internal/jetstream_port.hpp"

namespace tutti::bus {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::int64_t kListen_ms = 200;
constexpr int kBatch = 16;

}  // namespace

/// To the end of the port: `make` something of the present connection, and `step` with it until that says false, or
/// the connection is another one.
template <class Make, class Step>
void JetStreamPort::keep(Make make, Step step) {
  while (!stopping_) {
    const auto present = session();
    if (!present || !present->connection->connected()) {
      std::unique_lock guard(mutex_);
      changed_.wait_for(guard, kTick, [&] { return stopping_ || session_ != present; });
      continue;
    }
    auto made = make(*present);
    if (!made) {
      note(made.error().message);
      pause(kTryAgain);
      continue;
    }
    ++listening_;
    while (!stopping_ && session() == present && step(*made, *present)) continue;
    --listening_;
  }
}

void JetStreamPort::hear_confirmations() {
  keep([](Session& present) { return Result<natsSubscription*>(present.confirmations); },
       [&](natsSubscription* confirmations, Session& /*present*/) {
         natsMsg* heard = nullptr;
         const natsStatus status = natsSubscription_NextMsg(&heard, confirmations, kListen_ms);
         const NatsOwned<natsMsg> message(heard);
         if (status != NATS_OK) return status == NATS_TIMEOUT;
         const std::string_view subject = natsMsg_GetSubject(heard);
         const auto number = std::strtoull(subject.substr(subject.rfind('.') + 1).data(), nullptr, 10);
         const std::string_view answer = bytes_of(heard);
         const bool stored = !natsMsg_IsNoResponders(heard) && answer.find("\"error\":{") == std::string_view::npos;
         const std::scoped_lock guard(mutex_);
         if (stored) outbox_.confirm(number);
         if (!stored) outbox_.refuse(number, Clock::now());
         if (!stored) last_error_ = answer.empty() ? "the bus has no stream for this mission" : std::string(answer);
         changed_.notify_all();
         return true;
       });
}

bool JetStreamPort::is_full() const {
  const std::scoped_lock guard(mutex_);
  if (self_.role == Endpoint::Role::worker) return inbox_.held_messages() > 0;
  return inbox_.held_bytes() >= options_.max_held_bytes;
}

void JetStreamPort::pull(const std::string& stream, const std::string& consumer) {
  keep([&](Session& present) { return present.connection->pull(stream, consumer); },
       [&](natsSubscription* subscription, Session& present) {
         if (!present.connection->connected() || is_full()) return pause(kTick / 10);  // no requests pile up in a cut
         natsMsgList list{};
         const int batch = self_.role == Endpoint::Role::worker ? 1 : kBatch;
         const natsStatus status = natsSubscription_Fetch(&list, subscription, batch, kListen_ms, nullptr);
         for (int i = 0; i < list.Count; ++i) take_in(list.Msgs[i], *present.connection);
         natsMsgList_Destroy(&list);
         return status == NATS_OK || status == NATS_TIMEOUT;
       });
}

void JetStreamPort::take_in(natsMsg* message, const NatsConnection& connection) {
  const char* id = nullptr;
  natsMsgHeader_Get(message, "Nats-Msg-Id", &id);
  const auto part = part_of(id == nullptr ? "" : id);
  const auto address = address_of(natsMsg_GetSubject(message));
  const bool job = self_.role == Endpoint::Role::worker;
  const std::string reply = natsMsg_GetReply(message);
  bool ours = part && (job ? part->kind == MessageKind::job : address && address->kind == part->kind);
  std::unique_lock guard(mutex_);
  if (ours) ours = inbox_.add_part(job ? Endpoint::server() : address->end, *part, bytes_of(message), reply);
  if (ours) return;
  ++refused_;
  last_error_ = fmt::format("{}: id '{}' is none of ours", natsMsg_GetSubject(message), id == nullptr ? "" : id);
  guard.unlock();
  static_cast<void>(connection.publish(reply, "", "", "+TERM"));  // or it would come for ever
}

void JetStreamPort::hear_status() {
  keep([&](Session& present) { return present.connection->subscribe("mission." + options_.mission + ".*.*.status"); },
       [&](natsSubscription* subscription, Session& /*present*/) {
         natsMsg* heard = nullptr;
         const natsStatus status = natsSubscription_NextMsg(&heard, subscription, kListen_ms);
         const NatsOwned<natsMsg> message(heard);
         if (status != NATS_OK) return status == NATS_TIMEOUT;
         const auto address = address_of(natsMsg_GetSubject(heard));
         const std::scoped_lock guard(mutex_);
         if (address) inbox_.put_best_effort(address->end, address->kind, std::string(bytes_of(heard)));
         return true;
       });
}

/// Values come as they are sent; what was sent when nobody listened is asked for after each connection.
void JetStreamPort::hear_retained() {
  const std::string bucket = retained_bucket(options_.mission);
  const std::string subject = fmt::format("$KV.{}.robot.{}.", bucket, self_.number);
  std::uint64_t asked = 0;  // after so many cuts
  keep([&](Session& present) { return present.connection->subscribe(subject + "*"); },
       [&](natsSubscription* subscription, Session& present) {
         const std::uint64_t cuts = cuts_;
         if (cuts != asked && present.connection->connected()) {
           for (const MessageKind kind : {MessageKind::proxy_graph, MessageKind::receipt}) {
             auto value = present.connection->retained(bucket, subject + word_of(kind));
             if (!value) {
               note(value.error().message);
               return pause(kTryAgain);
             }
             if (*value) put_retained(kind, std::move(**value));
           }
           asked = cuts;
         }
         natsMsg* heard = nullptr;
         const natsStatus status = natsSubscription_NextMsg(&heard, subscription, kListen_ms);
         const NatsOwned<natsMsg> message(heard);
         if (status != NATS_OK) return status == NATS_TIMEOUT;
         if (const auto address = address_of(natsMsg_GetSubject(heard)))
           put_retained(address->kind, std::string(bytes_of(heard)));
         return true;
       });
}

/// The same again is no news.
void JetStreamPort::put_retained(MessageKind kind, std::string bytes) {
  const std::scoped_lock guard(mutex_);
  const auto [last, first] = retained_.try_emplace(kind, bytes);
  if (!first && last->second == bytes) return;
  last->second = bytes;
  inbox_.put_retained(Endpoint::server(), kind, std::move(bytes));
}

}  // namespace tutti::bus
