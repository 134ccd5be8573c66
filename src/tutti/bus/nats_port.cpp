// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/base/content_hash.hpp"
#include "tutti/bus/delivery.hpp"
#include "tutti/bus/internal/jetstream_port.hpp"
#include "tutti/bus/internal/transports.hpp"

namespace tutti::bus {
namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kFarewell = std::chrono::seconds(3);
constexpr int kAcknowledgeTries = 5;

std::string name_of(Endpoint end) { return fmt::format("{}_{}", name(end.role), end.number); }

}  // namespace

JetStreamPort::JetStreamPort(Endpoint self, BusOptions options)
    : self_(self),
      options_(std::move(options)),
      settle_at_(self.role == Endpoint::Role::worker ? settle_subject(options_.mission, std::to_string(self.number))
                                                     : ""),
      answer_to_(fmt::format("{}.sent_{}_{}", inbox_of(options_.credentials, name_of(self)), getpid(),
                             Clock::now().time_since_epoch().count())),
      outbox_(options_.mission, options_.max_waiting_bytes),
      inbox_(self) {
  threads_.emplace_back([this] { send_all(); });
  threads_.emplace_back([this] { hear_confirmations(); });
  const std::string& mission = options_.mission;
  switch (self_.role) {
    case Endpoint::Role::server:
      threads_.emplace_back([this, stream = submap_stream(mission)] { pull(stream, "server"); });
      threads_.emplace_back([this, stream = verdict_stream(mission)] { pull(stream, "server"); });
      threads_.emplace_back([this, all = "mission." + mission + ".*.*.status"] { hear_best_effort(all); });
      threads_.emplace_back([this, all = "mission." + mission + ".worker.*.submap_request"] { hear_best_effort(all); });
      threads_.emplace_back([this] { watch(); });
      threads_.emplace_back([this] { keep_jobs_ours(); });
      threads_.emplace_back([this] { settle_jobs(); });
      break;
    case Endpoint::Role::robot:
    case Endpoint::Role::viewer:
      threads_.emplace_back([this] { hear_retained(); });
      break;
    case Endpoint::Role::worker:
      threads_.emplace_back([this, stream = job_stream(mission)] { pull(stream, "workers"); });
      threads_.emplace_back([this, own = fmt::format("mission.{}.worker.{}.submap_copy", mission, self_.number)] {
        hear_best_effort(own);
      });
      break;
  }
}

JetStreamPort::~JetStreamPort() {
  {
    const std::scoped_lock guard(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  for (std::thread& thread : threads_) thread.join();
  say_farewell();
}

Status JetStreamPort::send(Envelope envelope) {
  TUTTI_CHECK(envelope.from == self_ && envelope.bytes != nullptr, "not from {}", name_of(self_));
  const std::scoped_lock guard(mutex_);
  const Delivery delivery = delivery_of(envelope.kind);
  if (delivery == Delivery::work_queue)  // before it can be in the stream
    jobs_sent_.insert(content_hash(to_string(whole_part(envelope))));
  if (const auto& known = options_.credentials.known; known && known->role == BusRole::operates)
    envelope.user = known->name;
  Status added = outbox_.add(envelope);
  if (added && delivery == Delivery::retained) retained_sent_.insert_or_assign({envelope.to, envelope.kind}, envelope);
  changed_.notify_all();
  return added;
}

std::vector<Received> JetStreamPort::receive() {
  const std::scoped_lock guard(mutex_);
  return inbox_.take();
}

void JetStreamPort::acknowledge(std::uint64_t ticket) {
  const std::scoped_lock guard(mutex_);
  inbox_.acknowledge(ticket);
  changed_.notify_all();
}

void JetStreamPort::still_busy(std::uint64_t ticket) {
  const std::scoped_lock guard(mutex_);
  for (std::string& reply : inbox_.replies_of(ticket)) busy_.push_back(std::move(reply));
  changed_.notify_all();
}

LinkState JetStreamPort::state() const {
  const std::scoped_lock guard(mutex_);
  const bool listening = listening_ + 1 == threads_.size();  // all but the sender's thread
  LinkState state{.url = without_credentials(options_.url),
                  .connected = listening && session_ && session_->connection->connected(),
                  .reconnects = cuts_ == 0 ? 0 : cuts_ - 1,
                  .waiting_messages = outbox_.messages(),
                  .waiting_bytes = outbox_.bytes(),
                  .waiting_acknowledgements = inbox_.acknowledgements(),
                  .refused = refused_ + inbox_.given_up(),
                  .streams_made_anew = streams_made_anew_,
                  .jobs_removed = jobs_removed_,
                  .strange_jobs = strange_jobs_,
                  .strange_settlements = strange_settlements_,
                  .strange_settler = strange_settler_,
                  .unconfirmed_s = 0.0,
                  .denied = session_ ? session_->connection->denied() : "",
                  .given_in_vain = given_in_vain_,
                  .last_error = last_error_};
  if (const auto since = outbox_.unconfirmed_since(); since && state.connected)
    state.unconfirmed_s = std::chrono::duration<double>(Clock::now() - *since).count();
  if (untaken_since_ && state.connected)
    state.jobs_untaken_s = std::chrono::duration<double>(Clock::now() - *untaken_since_).count();
  return state;
}

/// True: there is a new session.
bool JetStreamPort::connect() {
  if (const Status may = options_.may_connect ? options_.may_connect() : Status(); !may) {
    note(may.error().message);
    return false;
  }
  auto connection = NatsConnection::open(options_, name_of(self_));
  Status done = connection ? Status() : Status(tl::unexpected(connection.error()));
  if (done && self_.role == Endpoint::Role::server) {
    done = (*connection)->prepare(options_);
    for (const auto& stream : {submap_stream(options_.mission), verdict_stream(options_.mission)})
      if (done && !renewed_) done = (*connection)->renew_consumer(stream, "server");
    if (done) renewed_ = true;
  }
  auto made = std::make_shared<Session>();
  if (done) {
    auto confirmations = (*connection)->subscribe(answer_to_ + ".*");
    if (confirmations) made->confirmations = *confirmations;
    if (!confirmations) done = tl::unexpected(confirmations.error());
  }
  if (!done) {
    note(done.error().message);
    return false;
  }
  made->connection = *connection;
  reconnects_ = 0;
  const std::scoped_lock guard(mutex_);
  outbox_.resend_all();
  session_ = std::move(made);
  ++cuts_;
  changed_.notify_all();
  return true;
}

/// True: there may be more to do at once.
bool JetStreamPort::send_one(const NatsConnection& connection) {
  std::optional<Outbox::Piece> piece;
  std::vector<std::string> busy;
  std::vector<std::string> strays;
  {
    const std::scoped_lock guard(mutex_);
    outbox_.expire(Clock::now());
    piece = outbox_.next(Clock::now());
    std::swap(busy, busy_);
    strays = inbox_.take_strays();
  }
  for (const std::string& reply : busy) static_cast<void>(connection.settle(reply, "+WPI"));
  for (const std::string& reply : strays) static_cast<void>(connection.settle(reply, "+ACK"));
  if (!piece) return false;
  const bool confirmed = piece->delivery != Delivery::best_effort;
  const std::string answer = confirmed ? fmt::format("{}.{}", answer_to_, piece->number) : "";
  const std::string secret = piece->delivery == Delivery::work_queue ? secrets_.of(piece->id) : "";
  const Status sent = connection.publish(piece->subject, answer, piece->id, piece->bytes(), secret);
  if (sent) return true;
  note(sent.error().message);
  const std::scoped_lock guard(mutex_);
  outbox_.refuse(piece->number, Clock::now());
  return false;
}

bool JetStreamPort::acknowledge_one(const NatsConnection& connection) {
  std::optional<Inbox::Acknowledgement> next;
  {
    const std::scoped_lock guard(mutex_);
    // A worker remembers nothing: its job is done when the bus has its answer.
    if (self_.role == Endpoint::Role::worker && outbox_.messages() > 0) return false;
    next = inbox_.next_acknowledgement();
  }
  if (!next) return false;
  Status done;
  for (const std::string& reply : next->replies)
    if (done) done = connection.acknowledge(reply);
  if (!done) note(done.error().message);
  if (!done && ++tries_[next->ticket] < kAcknowledgeTries) return false;  // what is not acknowledged at all comes again
  tries_.erase(next->ticket);
  const std::scoped_lock guard(mutex_);
  inbox_.forget(next->ticket);
  return true;
}

void JetStreamPort::send_all() {
  while (!stopping_) {
    const auto present = session();
    if (!present || present->connection->closed()) {
      if (!connect()) pause(kTryAgain);
      continue;
    }
    const NatsConnection& connection = *present->connection;
    const bool connected = connection.connected();
    if (!connected && connection.is_outdated()) connection.close();
    if (const std::string why = connection.not_let_in(); !why.empty()) note(why);
    const std::uint64_t reconnects = connection.reconnects();
    if (reconnects != reconnects_ || !connected) {
      const std::scoped_lock guard(mutex_);
      outbox_.note_cut();
      if (reconnects != reconnects_) outbox_.resend_all();
      cuts_ += reconnects - reconnects_;
      if (!connected) outbox_.forget_best_effort();
      reconnects_ = reconnects;
    }
    if (connected) make_stream_anew(connection);
    const bool acknowledged = connected && acknowledge_one(connection);
    const bool sent = connected && send_one(connection);
    if (acknowledged || sent) continue;
    std::unique_lock guard(mutex_);
    if (!stopping_) changed_.wait_for(guard, kTick);
  }
}

/// Its sequence begins again: what was to be acknowledged in the old one must not be in the new one. With it goes the
/// memory of its ids, so that what is sent again is taken. A bus that has lost one may have lost all.
void JetStreamPort::make_stream_anew(const NatsConnection& connection) {
  std::string stranded;
  {
    const std::scoped_lock guard(mutex_);
    stranded = stranded_;
  }
  if (stranded.empty()) return;
  const std::string& mission = options_.mission;
  Status done;
  std::vector<std::string> lost;
  for (const std::string& stream : {submap_stream(mission), verdict_stream(mission), job_stream(mission),
                                    map_stream(mission), retained_stream(mission)}) {
    const auto there = stream == stranded ? Result<bool>(false) : connection.has_stream(stream);
    if (!there) done = tl::unexpected(there.error());
    if (there && !*there) lost.push_back(stream);
  }
  if (done) done = connection.remove_stream(stranded);
  if (done) {
    const std::scoped_lock guard(mutex_);
    for (const std::string& stream : lost) {
      if (stream == submap_stream(mission)) inbox_.forget_stream(MessageKind::submap);
      if (stream == verdict_stream(mission))
        for (const MessageKind kind : {MessageKind::verdicts, MessageKind::refinement, MessageKind::decision})
          inbox_.forget_stream(kind);
    }
  }
  if (done) done = connection.prepare(options_);
  if (!done) return note(done.error().message);  // and again
  const std::scoped_lock guard(mutex_);
  streams_made_anew_ += lost.size();
  last_error_ = fmt::format(
      "the bus had lost {}, or did not give what was in it, as after a power failure: made anew, and what was in it is "
      "to be sent again",
      fmt::join(lost, ", "));
  if (std::ranges::find(lost, retained_stream(mission)) != lost.end())
    for (const auto& [to, envelope] : retained_sent_) static_cast<void>(outbox_.add(envelope));
  stranded_.clear();
  changed_.notify_all();
}

/// Afterwards the messages sent last are in transit, how a robot has ended above all; those acknowledged are so on the
/// bus, and the others come to the next one at once, not after a time-out.
void JetStreamPort::say_farewell() {
  const auto present = session();
  if (!present || !present->connection->connected()) return;
  const NatsConnection& connection = *present->connection;
  const auto end = Clock::now() + kFarewell;
  while (Clock::now() < end && send_one(connection)) continue;
  while (Clock::now() < end && acknowledge_one(connection)) continue;
  const std::scoped_lock guard(mutex_);
  for (const std::string& reply : inbox_.unacknowledged()) static_cast<void>(connection.settle(reply, "-NAK"));
  connection.flush();
}

std::unique_ptr<Port> open_nats_port(Endpoint endpoint, const BusOptions& options) {
  return std::make_unique<JetStreamPort>(endpoint, options);
}

}  // namespace tutti::bus
