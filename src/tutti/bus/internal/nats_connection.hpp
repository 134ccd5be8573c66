// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nats/nats.h>

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/bus/transport.hpp"

/// The one place with libnats's options, and its objects with owners. No callbacks of libnats's threads: whoever waits
/// for a message asks for it, so that nothing is called when its owner is gone.
namespace tutti::bus {

struct NatsFree {
  void operator()(natsMsg* message) const { natsMsg_Destroy(message); }
  void operator()(natsOptions* options) const { natsOptions_Destroy(options); }
  void operator()(natsSubscription* subscription) const { natsSubscription_Destroy(subscription); }
  void operator()(natsStatistics* statistics) const { natsStatistics_Destroy(statistics); }
  void operator()(jsStreamInfo* info) const { jsStreamInfo_Destroy(info); }
  void operator()(jsConsumerInfo* info) const { jsConsumerInfo_Destroy(info); }
  void operator()(kvStore* store) const { kvStore_Destroy(store); }
};
template <class T>
using NatsOwned = std::unique_ptr<T, NatsFree>;

/// How long the bus is waited for when it is asked something.
inline constexpr std::chrono::milliseconds kNatsAnswer{5000};

/// Parts that a consumer has been given and has not acknowledged; then the bus waits. More than an inbox can hold.
inline constexpr std::uint64_t kMostUnacknowledged = 65'536;

/// The header of a message that has a secret.
inline constexpr const char* kSecret = "Tutti-Secret";

/// TLS with a bus whose certificate this authority (PEM) has signed, and no other, whatever the system trusts.
bool secure_by_authority(natsOptions* options, const std::string& authority);

/// Null: libnats does not take them. `credentials` must outlive the connection.
NatsOwned<natsOptions> make_options(const BusUrl& url, const BusCredentials& credentials, const std::string& name);

/// " (what to change)" of one whom natsConnection_Connect() has just refused, on this thread;
/// empty: the status is all that is known.
std::string why_not_let_in(natsStatus status, const BusUrl& url, const BusCredentials& credentials);

class NatsConnection {
 public:
  /// Once it is there it comes back by itself, however long it was gone. `name` in the bus's logs and of its inboxes.
  static Result<std::shared_ptr<NatsConnection>> open(const BusOptions& options, const std::string& name);
  ~NatsConnection();
  NatsConnection(const NatsConnection&) = delete;
  NatsConnection& operator=(const NatsConnection&) = delete;

  [[nodiscard]] natsConnection* get() const { return connection_; }
  [[nodiscard]] bool connected() const { return natsConnection_Status(connection_) == NATS_CONN_STATUS_CONNECTED; }
  [[nodiscard]] bool closed() const { return natsConnection_IsClosed(connection_); }
  [[nodiscard]] std::uint64_t reconnects() const;
  /// The credentials' file has others than this connection, which it will never use.
  [[nodiscard]] bool is_outdated() const { return read_again(credentials_) != credentials_; }
  void close() const { natsConnection_Close(connection_); }
  /// Why the bus hangs up on this connection, which tries to come back; empty: it is there, or the bus is not.
  [[nodiscard]] std::string not_let_in() const;
  /// The bus's refusal of something that this connection did, in its words; empty: it has refused nothing.
  [[nodiscard]] std::string denied() const;
  /// An error of libnats as one of ours: where, while doing what, why.
  [[nodiscard]] tl::unexpected<Error> failure(natsStatus status, std::string_view doing, int code = 0) const;

  /// Streams and the bucket of retained values.
  [[nodiscard]] Status prepare(const BusOptions& options) const;
  /// The server's consumer of a stream, anew: whatever is not acknowledged comes at once.
  [[nodiscard]] Status renew_consumer(const std::string& stream, const std::string& consumer) const;
  /// The contents of a stream, and the part that its consumer is to get.
  struct StreamState {
    std::uint64_t first = 0;       ///< Sequence in the stream.
    std::uint64_t messages = 0;    ///< In the stream.
    std::uint64_t pending = 0;     ///< Those to be given for the first time;
    std::uint64_t given = 0;       ///< given and not acknowledged.
    std::uint64_t deliveries = 0;  ///< So far.
    std::uint64_t gone = 0;        ///< Messages that were once in the stream, and are not any more.
    std::uint64_t done_up_to = 0;  ///< Messages up to this sequence are given to nobody any more.
    bool asked = false;            ///< Somebody waits for messages.
  };
  [[nodiscard]] bool has_jetstream() const;
  /// False: a bus that has lost its store. An error: it does not answer.
  [[nodiscard]] Result<bool> has_stream(const std::string& stream) const;
  /// Nothing: there is no consumer, or the stream does not stay unchanged for long enough.
  [[nodiscard]] Result<std::optional<StreamState>> read_state(const std::string& stream,
                                                              const std::string& consumer) const;
  /// Removes messages that are given to nobody any more, each after `take` has had it.
  [[nodiscard]] Status remove_done(const std::string& stream, const StreamState& state,
                                   const std::function<void(natsMsg*)>& take) const;
  [[nodiscard]] Status remove_stream(const std::string& stream) const;
  /// Reads what is in a stream behind sequence `after`, so many messages at a time, and removes those whose id
  /// (Nats-Msg-Id) is not `ours`. Returns up to which sequence it has read; `removed` grows.
  [[nodiscard]] Result<std::uint64_t> remove_strange(const std::string& stream, std::uint64_t after,
                                                     const std::function<bool(std::string_view)>& ours,
                                                     std::uint64_t& removed) const;
  // The connection owns what these return, and frees it when it is closed: libnats (issue 637) may be at a message
  // for a subscription that is being destroyed.
  /// The consumer of a stream, if it is missing.
  [[nodiscard]] Status add_consumer(const std::string& stream, const std::string& consumer) const;
  /// A subject to be answered at, of nobody else.
  [[nodiscard]] std::string make_inbox() const;
  [[nodiscard]] Result<natsSubscription*> subscribe(const std::string& subject);

  /// A bucket of values that are gone so many seconds after they were put, made if it is missing; without a number:
  /// null then.
  [[nodiscard]] Result<NatsOwned<kvStore>> bucket(const std::string& name, std::optional<double> lasts_s) const;
  /// The last value of a stream at this subject; nothing if there is none, or one that is_of_another_subject().
  [[nodiscard]] Result<std::optional<std::string>> retained(const std::string& stream,
                                                            const std::string& subject) const;
  /// Waits until a stream has stored it.
  [[nodiscard]] Status store(const std::string& subject, std::string_view bytes) const;
  /// The message is acknowledged, and the bus has confirmed it. `reply`: reply_of() it.
  [[nodiscard]] Status acknowledge(const std::string& reply) const;
  /// Says of a message: "+WPI", work on it goes on; "+ACK", "-NAK", "+TERM". Waits for nothing.
  [[nodiscard]] Status settle(const std::string& reply, const std::string& verb) const;
  /// The secret of a message of a stream, "" if it has none; nothing: the message is gone.
  [[nodiscard]] Result<std::optional<std::string>> secret_of(const std::string& stream, std::uint64_t sequence) const;
  /// Not waiting for an answer; `id`, `answer_to` and `secret` may be empty.
  [[nodiscard]] Status publish(const std::string& subject, const std::string& answer_to, const std::string& id,
                               std::string_view bytes, const std::string& secret = {}) const;
  void flush() const { natsConnection_FlushTimeout(connection_, kNatsAnswer.count()); }

 private:
  NatsConnection(std::string url, std::string name, BusCredentials credentials)
      : url_(std::move(url)), name_(std::move(name)), credentials_(std::move(credentials)) {}
  [[nodiscard]] Status add_stream(jsStreamConfig& stream) const;

  std::string url_;
  std::string name_;
  const BusCredentials credentials_;  ///< Libnats signs with them at every reconnection.
  natsConnection* connection_ = nullptr;
  jsCtx* streams_ = nullptr;
  std::mutex mutex_;  ///< For what follows.
  std::vector<NatsOwned<natsSubscription>> subscriptions_;
};

/// A connection that is made when it is first asked for, and again when it is gone, with what the credentials' file has
/// by then.
class NatsLink {
 public:
  NatsLink(BusOptions where, std::string name) : where_(std::move(where)), name_(std::move(name)) {}
  [[nodiscard]] Status connect();
  [[nodiscard]] const BusOptions& where() const { return where_; }
  /// After connect().
  [[nodiscard]] const NatsConnection& connection() const { return *connection_; }
  [[nodiscard]] bool connected() const { return connection_ && connection_->connected(); }

 private:
  const BusOptions where_;
  const std::string name_;
  std::shared_ptr<NatsConnection> connection_;
};

std::string_view bytes_of(const natsMsg* message);
/// Where a message is settled: its reply, or for one with a secret "SETTLE_AT SECRET REPLY".
std::string reply_of(natsMsg* message, const std::string& settle_at);
/// The bus has answered a question about a value of another subject, and whoever asked had it answer at this one: the
/// bus checks where members publish, but not where they are answered.
bool is_of_another_subject(natsMsg* message, const std::string& subject);

std::string submap_stream(const std::string& mission);
std::string verdict_stream(const std::string& mission);
std::string job_stream(const std::string& mission);
std::string map_stream(const std::string& mission);
std::string retained_bucket(const std::string& mission);
std::string retained_stream(const std::string& mission);  ///< In which the bucket is kept.

}  // namespace tutti::bus
