// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "tutti/bus/internal/nats_connection.hpp"

namespace tutti::bus {

/// Messages of a consumer, asked for by so many. Not libnats's own fetch: that of Debian 12 (3.4.1, nats.c #749) writes
/// past the end of its list when messages of an earlier fetch come late, as over a link that stalls.
class NatsPull {
 public:
  /// `settle_at`: as in reply_of().
  NatsPull(std::shared_ptr<NatsConnection> connection, const std::string& stream, const std::string& consumer,
           natsSubscription* subscription, std::string inbox, std::string settle_at = {});
  /// Gives back the messages that still come, so that another gets them at once.
  ~NatsPull();
  NatsPull(const NatsPull&) = delete;
  NatsPull& operator=(const NatsPull&) = delete;

  enum class State : std::uint8_t { message, nothing, lost };
  struct Next {
    State state = State::nothing;  ///< Lost: the consumer, or the connection: another one is to be made.
    NatsOwned<natsMsg> message;    ///< If that is its state; never null then.
  };
  /// The next message, from those that were asked for; when all have come, or have not come in time, `batch` more are
  /// asked for. Waits for a short while.
  Next next(int batch);
  /// The connection was gone, and with it maybe what was asked for.
  void ask_again() { left_ = 0; }

 private:
  [[nodiscard]] bool ask(int batch);
  /// The meaning of the bus's answer to a request when it is no message.
  [[nodiscard]] State state_of(natsMsg* message);

  std::shared_ptr<NatsConnection> connection_;
  std::string ask_;  ///< Where to.
  natsSubscription* subscription_;
  std::string inbox_;  ///< All requests'; each has a number behind it.
  std::string settle_at_;
  std::uint64_t requests_ = 0;
  int left_ = 0;         ///< The last request's.
  bool partly_ = false;  ///< Some of them came, and since then nothing was missed.
  int unanswered_ = 0;   ///< Requests, the last ones.
  std::chrono::steady_clock::time_point until_;
};

}  // namespace tutti::bus
