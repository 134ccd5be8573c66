// SPDX-License-Identifier: BSD-3-Clause
// The threads of a JetStreamPort that receive.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "tutti/base/content_hash.hpp"
#include "tutti/bus/delivery.hpp"
#include "tutti/bus/internal/jetstream_port.hpp"
#include "tutti/bus/internal/nats_names.hpp"
#include "tutti/bus/internal/nats_pull.hpp"

namespace tutti::bus {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::int64_t kListen_ms = 200;
constexpr int kBatch = 32;
constexpr auto kCheckForStrange = std::chrono::milliseconds(500);

void drop_all(natsSubscription* subscription) {
  natsMsg* heard = nullptr;
  while (natsSubscription_NextMsg(&heard, subscription, 1) == NATS_OK) natsMsg_Destroy(heard);
}

}  // namespace

/// To the end of the port: `make` something of the present connection, and `step` with it until that returns false, or
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
         if (status == NATS_NO_RESPONDERS) {  // of libnats, which does not report to what
           const std::scoped_lock guard(mutex_);
           outbox_.refuse_all(Clock::now());
           last_error_ = "the bus has no stream for this mission: has its server been there?";
         }
         if (status != NATS_OK) return status == NATS_TIMEOUT || status == NATS_NO_RESPONDERS;
         const std::string_view subject = natsMsg_GetSubject(heard);
         const auto number = std::strtoull(subject.substr(subject.rfind('.') + 1).data(), nullptr, 10);
         const std::string_view answer = bytes_of(heard);
         const bool stored = answer.find("\"error\":{") == std::string_view::npos;
         const std::scoped_lock guard(mutex_);
         if (stored) outbox_.confirm(number);
         if (!stored) outbox_.refuse(number, Clock::now());
         if (!stored) last_error_ = std::string(answer);
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
  std::uint64_t asked = 0;  // after so many cuts
  keep(
      [&](Session& present) -> Result<std::unique_ptr<NatsPull>> {
        if (is_stranded(stream)) return fail(ErrorCode::io, "{}: being made anew", stream);
        const bool makes = self_.role == Endpoint::Role::server;  // those that workers share, too: prepare()
        if (Status made = makes ? present.connection->add_consumer(stream, consumer) : Status(); !made)
          return tl::unexpected(made.error());
        const std::string inbox = present.connection->make_inbox();
        const auto subscription = present.connection->subscribe(inbox + ".*");
        if (!subscription) return tl::unexpected(subscription.error());
        return std::make_unique<NatsPull>(present.connection, stream, consumer, *subscription, inbox, settle_at_);
      },
      [&](const std::unique_ptr<NatsPull>& from, Session& present) {
        if (is_stranded(stream)) return false;
        if (!present.connection->connected() || is_full()) return pause(kTick / 10);  // no requests pile up in a cut
        if (const std::uint64_t cuts = cuts_; std::exchange(asked, cuts) != cuts) from->ask_again();
        const NatsPull::Next next = from->next(self_.role == Endpoint::Role::worker ? 1 : kBatch);
        if (next.message) take_in(next.message.get(), *present.connection);
        return next.state != NatsPull::State::lost;
      });
}

/// A bus may have lost its streams, with its disk. And nats-server 2.9 takes a damaged end of a stream for none, and
/// may go on with sequences that its consumer has behind it: what is stored then is neither pending nor given. The
/// stream of jobs keeps those that were given for the last time.
void JetStreamPort::watch() {
  struct Watched {
    std::optional<Clock::time_point> since;  // they have been in this state
    std::uint64_t deliveries = 0;
    bool removed = false;
    std::uint64_t gone = 0, deliveries_then = 0;  // when a message was last acknowledged, or removed
  };
  const std::string jobs = job_stream(options_.mission);
  std::map<std::string, Watched> all;
  const auto strand = [&](const std::string& stream) {
    const std::scoped_lock guard(mutex_);
    if (stranded_.empty()) stranded_ = stream;
    changed_.notify_all();
  };
  const auto note_given = [&](std::uint64_t given, std::uint64_t deliveries) {
    const std::scoped_lock guard(mutex_);
    given_in_vain_ = given > 0 && deliveries >= LinkState::kGivenInVain * given ? deliveries : 0;
  };
  const auto note_untaken = [&](bool is_untaken) {
    const std::scoped_lock guard(mutex_);
    if (!is_untaken) untaken_since_.reset();
    if (is_untaken && !untaken_since_) untaken_since_ = Clock::now();
  };
  const auto is_there = [&](const std::string& stream, const NatsConnection& connection) {
    const auto there = connection.has_stream(stream);
    if (!there) note(there.error().message);
    if (there && !*there) strand(stream);
    return there && *there;
  };
  const auto check_stream = [&](const std::string& stream, const std::string& consumer,
                                const NatsConnection& connection) {
    if (!is_there(stream, connection)) return;
    const auto state = connection.read_state(stream, consumer);
    if (!state) return note(state.error().message);
    Watched& watched = all[stream];
    if (!*state && stream == jobs) static_cast<void>(connection.add_consumer(stream, consumer));  // it may be gone
    if (!*state) return;
    const bool is_left = (*state)->messages > (*state)->pending + (*state)->given;
    const bool is_held_back = (*state)->pending > 0 && (*state)->asked && (*state)->deliveries == watched.deliveries &&
                              (*state)->given < kMostUnacknowledged && !(stream != jobs && is_full());
    if (stream == jobs)
      note_untaken((*state)->pending > 0 && (*state)->given == 0 && (*state)->deliveries == watched.deliveries);
    watched.deliveries = (*state)->deliveries;
    if ((*state)->gone != watched.gone || (*state)->given == 0 || watched.deliveries < watched.deliveries_then) {
      watched.gone = (*state)->gone;
      watched.deliveries_then = watched.deliveries - std::min(watched.deliveries, (*state)->given);
    }
    if (stream == jobs) note_given((*state)->given, watched.deliveries - watched.deliveries_then);
    if (!is_left && !is_held_back) {
      watched.since.reset();
      watched.removed = false;
      return;
    }
    if (!watched.since) watched.since = Clock::now();
    if (Clock::now() - *watched.since < std::chrono::duration<double>(options_.stranded_s)) return;
    if (stream == jobs && is_left && !watched.removed) {
      std::uint64_t removed = 0;
      const Status done = connection.remove_done(stream, **state, [&](natsMsg* message) {
        ++removed;
        put_returned(message);
      });
      if (!done) return note(done.error().message);
      watched.removed = removed > 0 || (*state)->given == 0;  // or a job before these is being worked on
      if (watched.removed) watched.since = Clock::now();
      return;
    }
    watched.since.reset();
    watched.removed = false;
    strand(stream);
  };
  keep([](Session& /*present*/) { return Result<bool>(true); },
       [&](bool /*made*/, Session& present) {
         if (present.connection->connected()) {
           check_stream(submap_stream(options_.mission), "server", *present.connection);
           check_stream(verdict_stream(options_.mission), "server", *present.connection);
           check_stream(jobs, "workers", *present.connection);
           for (const auto& values : {retained_stream(options_.mission), map_stream(options_.mission)})
             is_there(values, *present.connection);
         }
         return pause(std::chrono::duration<double>(options_.stranded_s / 4));
       });
}

/// Jobs that are there when a server starts are of an earlier start, whose answers nobody waits for.
void JetStreamPort::keep_jobs_ours() {
  const std::string jobs = job_stream(options_.mission);
  std::uint64_t looked = 0;
  const auto ours = [&](std::string_view id) {
    const std::scoped_lock guard(mutex_);
    return jobs_sent_.contains(content_hash(id));
  };
  keep([](Session& /*present*/) { return Result<bool>(true); },
       [&](bool /*made*/, Session& present) {
         if (!present.connection->connected() || is_stranded(jobs)) return pause(kCheckForStrange);
         std::uint64_t removed = 0;
         const auto end = present.connection->remove_strange(jobs, looked, ours, removed);
         const bool is_more = end && removed > 0;
         if (end) looked = *end;
         if (!end) note(end.error().message);
         {
           const std::scoped_lock guard(mutex_);
           strange_jobs_ += removed;
         }
         return is_more ? !stopping_ : pause(kCheckForStrange);
       });
}

/// The bus would let any worker say so of any job, given or not. A job's secret is in the job: whoever knows it has
/// been given it. A message about a job that is gone does nothing.
void JetStreamPort::settle_jobs() {
  const std::string jobs = job_stream(options_.mission);
  const auto passes = [&](natsMsg* heard, const NatsConnection& connection) {
    const auto said = settlement_of(bytes_of(heard), jobs);
    if (!said) return false;
    const auto secret = connection.secret_of(jobs, said->sequence);
    if (!secret) note(secret.error().message);  // the worker says it again
    if (!secret) return true;
    const bool is_gone = !*secret;
    if (!is_gone && **secret != said->secret) return false;
    const Status done = is_gone                ? Status()
                        : said->verb == "+ACK" ? connection.acknowledge(said->reply)
                                               : connection.settle(said->reply, said->verb);
    if (!done) note(done.error().message);
    const char* const answer_to = natsMsg_GetReply(heard);
    if (done && answer_to != nullptr) static_cast<void>(connection.publish(answer_to, "", "", "+OK"));
    return true;
  };
  keep([&](Session& present) { return present.connection->subscribe(settle_subject(options_.mission, "*")); },
       [&](natsSubscription* subscription, Session& present) {
         natsMsg* heard = nullptr;
         const natsStatus status = natsSubscription_NextMsg(&heard, subscription, kListen_ms);
         const NatsOwned<natsMsg> message(heard);
         if (status != NATS_OK) return status == NATS_TIMEOUT;
         if (passes(heard, *present.connection)) return true;
         const std::scoped_lock guard(mutex_);
         ++strange_settlements_;
         strange_settler_ = settler_of(natsMsg_GetSubject(heard));
         return true;
       });
}

void JetStreamPort::put_returned(natsMsg* message) {
  const char* id = nullptr;
  natsMsgHeader_Get(message, "Nats-Msg-Id", &id);
  const auto part = part_of(id == nullptr ? "" : id);
  const std::scoped_lock guard(mutex_);
  ++jobs_removed_;
  if (part) inbox_.put_returned(part->kind, part->id, std::string(bytes_of(message)));
}

void JetStreamPort::take_in(natsMsg* message, const NatsConnection& connection) {
  const char* id = nullptr;
  natsMsgHeader_Get(message, "Nats-Msg-Id", &id);
  const auto part = part_of(id == nullptr ? "" : id);
  const auto address = address_of(natsMsg_GetSubject(message));
  const bool job = self_.role == Endpoint::Role::worker;
  const std::string reply = reply_of(message, settle_at_);
  bool ours = part && (job ? delivery_of(part->kind) == Delivery::work_queue : address && address->kind == part->kind);
  std::unique_lock guard(mutex_);
  if (ours)
    ours = inbox_.add_part(job ? Endpoint::server() : address->end, *part, bytes_of(message), reply, Clock::now(),
                           job ? "" : address->user);
  if (ours) return;
  ++refused_;
  last_error_ = fmt::format("{}: id '{}' is none of ours", natsMsg_GetSubject(message), id == nullptr ? "" : id);
  guard.unlock();
  static_cast<void>(connection.settle(reply, "+TERM"));  // or it would come for ever
}

void JetStreamPort::hear_best_effort(const std::string& subject) {
  keep([&](Session& present) { return present.connection->subscribe(subject); },
       [&](natsSubscription* subscription, Session& /*present*/) {
         natsMsg* heard = nullptr;
         const natsStatus status = natsSubscription_NextMsg(&heard, subscription, kListen_ms);
         const NatsOwned<natsMsg> message(heard);
         if (status != NATS_OK) return status == NATS_TIMEOUT;
         const auto address = address_of(natsMsg_GetSubject(heard));
         const std::scoped_lock guard(mutex_);
         const Endpoint from = self_.role == Endpoint::Role::server && address ? address->end : Endpoint::server();
         if (address) inbox_.put_best_effort(from, address->kind, std::string(bytes_of(heard)));
         return true;
       });
}

/// Values come as they are sent; what was sent when nobody listened is asked for after each connection.
void JetStreamPort::hear_retained() {
  const std::string stream = retained_stream(options_.mission);
  std::vector<MessageKind> kinds{MessageKind::proxy_graph, MessageKind::proxy_graph_delta, MessageKind::receipt};
  if (self_.role == Endpoint::Role::viewer) kinds = {MessageKind::mission_status};
  const auto subject = [&](MessageKind kind) {
    return subject_of(options_.mission, {.from = Endpoint::server(), .to = self_, .kind = kind});
  };
  std::string all = subject(kinds.front());
  all.replace(all.rfind('.'), std::string::npos, ".*");
  std::uint64_t asked = 0;  // after so many cuts
  keep([&](Session& present) { return present.connection->subscribe(all); },
       [&](natsSubscription* subscription, Session& present) {
         const std::uint64_t cuts = cuts_;
         if (cuts != asked && present.connection->connected()) {
           drop_all(subscription);  // from before the cut, and older than what is asked for
           for (const MessageKind kind : kinds) {
             auto value = present.connection->retained(stream, subject(kind));
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
         const std::string at = natsMsg_GetSubject(heard);
         if (is_of_another_subject(heard, at)) {
           const std::scoped_lock guard(mutex_);
           ++refused_;
           last_error_ =
               fmt::format("{}: not the server's, but the bus's answer to somebody about another subject", at);
         } else if (const auto address = address_of(at)) {
           put_retained(address->kind, std::string(bytes_of(heard)));
         }
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
