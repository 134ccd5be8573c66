// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <unordered_set>
#include <utility>
#include <vector>

#include "tutti/bus/internal/nats_connection.hpp"
#include "tutti/bus/internal/nats_inbox.hpp"
#include "tutti/bus/internal/nats_outbox.hpp"

namespace tutti::bus {

inline constexpr auto kTick = std::chrono::milliseconds(100);
inline constexpr auto kTryAgain = std::chrono::milliseconds(500);

/// Makes the secret that goes with each job: nobody guesses it who has not been given the job, and each start has
/// others.
class JobSecrets {
 public:
  JobSecrets();
  [[nodiscard]] std::string of(const std::string& id) const;

 private:
  std::array<unsigned char, 32> key_{};
};

/// A connection with where the bus confirms what was sent over it.
struct Session {
  std::shared_ptr<NatsConnection> connection;
  natsSubscription* confirmations = nullptr;
};

class JetStreamPort final : public Port {
 public:
  JetStreamPort(Endpoint self, BusOptions options);
  ~JetStreamPort() override;
  JetStreamPort(const JetStreamPort&) = delete;
  JetStreamPort& operator=(const JetStreamPort&) = delete;

  Status send(Envelope envelope) override;
  std::vector<Received> receive() override;
  void acknowledge(std::uint64_t ticket) override;
  void still_busy(std::uint64_t ticket) override;
  [[nodiscard]] LinkState state() const override;

 private:
  // The sender's thread.
  void send_all();
  bool connect();
  bool send_one(const NatsConnection& connection);
  bool acknowledge_one(const NatsConnection& connection);
  void say_farewell();
  /// Only this thread calls it: no acknowledgement is in transit to a stream that is being made anew.
  void make_stream_anew(const NatsConnection& connection);

  // The receivers' threads.
  template <class Make, class Step>
  void keep(Make make, Step step);
  void hear_confirmations();
  void pull(const std::string& stream, const std::string& consumer);
  /// No more is fetched for now.
  [[nodiscard]] bool is_full() const;
  void take_in(natsMsg* message, const NatsConnection& connection);
  void put_returned(natsMsg* message);
  void hear_best_effort(const std::string& subject);
  void hear_retained();
  /// Over the streams, whether they give what they have.
  void watch();
  /// Over the jobs: what this server has not sent goes, before it keeps workers from what it has.
  void keep_jobs_ours();
  /// Passes on what workers say of their jobs, and not what they say of others'.
  void settle_jobs();
  [[nodiscard]] bool is_stranded(const std::string& stream) const {
    const std::scoped_lock guard(mutex_);
    return stranded_ == stream;
  }
  void put_retained(MessageKind kind, std::string bytes);

  [[nodiscard]] std::shared_ptr<Session> session() const {
    const std::scoped_lock guard(mutex_);
    return session_;
  }
  void note(const std::string& error) {
    const std::scoped_lock guard(mutex_);
    last_error_ = error;
  }
  /// False at the end of the port.
  template <class Duration>
  bool pause(Duration duration) {
    std::unique_lock guard(mutex_);
    return !changed_.wait_for(guard, duration, [&] { return stopping_.load(); });
  }

  Endpoint self_;
  BusOptions options_;
  std::string settle_at_;  ///< A worker's, for its jobs.
  JobSecrets secrets_;
  std::string answer_to_;  ///< Confirmation of piece 7 comes to "ANSWER_TO.7".
  std::atomic<bool> stopping_ = false;
  std::atomic<std::uint64_t> cuts_ = 0;     ///< Sessions and reconnections so far.
  std::atomic<std::size_t> listening_ = 0;  ///< Threads with a subscription.
  bool renewed_ = false;                    ///< The server's consumers were.
  std::uint64_t reconnects_ = 0;            ///< Since the present session, as far as the sender knows.
  std::map<std::uint64_t, int> tries_;      ///< To acknowledge, by ticket.

  mutable std::mutex mutex_;  ///< For what follows.
  std::condition_variable changed_;
  std::shared_ptr<Session> session_;
  Outbox outbox_;
  Inbox inbox_;
  std::vector<std::string> busy_;                ///< Where work is reported to go on.
  std::map<MessageKind, std::string> retained_;  ///< The values last given.
  /// The server's values as last sent: a bus that has lost them gets them again.
  std::map<std::pair<Endpoint, MessageKind>, Envelope> retained_sent_;
  std::string stranded_;  ///< The stream to be made anew; "": none.
  std::uint64_t streams_made_anew_ = 0;
  std::uint64_t jobs_removed_ = 0;
  std::unordered_set<std::uint64_t> jobs_sent_;  ///< Hashes of their ids; the server's.
  std::uint64_t strange_jobs_ = 0;
  std::uint64_t strange_settlements_ = 0;
  std::uint32_t strange_settler_ = 0;
  std::uint64_t given_in_vain_ = 0;
  std::optional<std::chrono::steady_clock::time_point> untaken_since_;  ///< Jobs wait, and nobody has one.
  std::uint64_t refused_ = 0;
  std::string last_error_;

  std::vector<std::thread> threads_;
};

}  // namespace tutti::bus
