// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/internal/nats_pull.hpp"

#include <fmt/format.h>

#include <string_view>
#include <utility>

namespace tutti::bus {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kListen(200);   // then the bus gives nothing for a request any more
constexpr int kMostUnanswered = 3;                  // a bus that does not know the consumer answers nothing
constexpr std::chrono::milliseconds kIsLost(1000);  // and so much later it will not report that any more, either

}  // namespace

NatsPull::NatsPull(std::shared_ptr<NatsConnection> connection, const std::string& stream, const std::string& consumer,
                   natsSubscription* subscription, std::string inbox, std::string settle_at)
    : connection_(std::move(connection)),
      ask_(fmt::format("$JS.API.CONSUMER.MSG.NEXT.{}.{}", stream, consumer)),
      subscription_(subscription),
      inbox_(std::move(inbox)),
      settle_at_(std::move(settle_at)) {}

NatsPull::~NatsPull() {
  while (left_ > 0 && Clock::now() < until_) {
    const Next late = next(0);
    if (late.state == State::lost) break;
    if (late.state == State::message)
      static_cast<void>(connection_->settle(reply_of(late.message.get(), settle_at_), "-NAK"));
  }
  natsSubscription_Unsubscribe(subscription_);
}

bool NatsPull::ask(int batch) {
  const auto wait = std::chrono::duration_cast<std::chrono::nanoseconds>(kListen).count();
  const std::string answer_to = fmt::format("{}.{}", inbox_, ++requests_);
  left_ = batch;
  partly_ = false;
  until_ = Clock::now() + kListen + kIsLost;
  return connection_->publish(ask_, answer_to, "", fmt::format(R"({{"batch":{},"expires":{}}})", batch, wait))
      .has_value();
}

NatsPull::Next NatsPull::next(int batch) {
  if (left_ > 0 && Clock::now() > until_) {
    left_ = 0;
    if (++unanswered_ >= kMostUnanswered) return {State::lost, {}};
  }
  if (left_ == 0 && batch > 0 && !ask(batch)) return {State::lost, {}};
  natsMsg* heard = nullptr;
  const natsStatus status = natsSubscription_NextMsg(&heard, subscription_, kListen.count());
  NatsOwned<natsMsg> message(heard);
  if (status == NATS_TIMEOUT) {
    // Nats-server 2.9 does not always report that a request has run out when it has given some of what was asked for.
    if (std::exchange(partly_, false)) left_ = 0;
    return {};
  }
  if (status != NATS_OK) return {State::lost, {}};
  unanswered_ = 0;
  if (std::string_view(natsMsg_GetSubject(heard)).starts_with(inbox_)) return {state_of(heard), {}};
  if (left_ > 0) --left_;
  partly_ = true;
  return {State::message, std::move(message)};
}

/// 404 and 408: there is no more; other numbers: the consumer is gone, or the bus is going.
NatsPull::State NatsPull::state_of(natsMsg* message) {
  const bool is_of_last =
      std::string_view(natsMsg_GetSubject(message)).substr(inbox_.size() + 1) == std::to_string(requests_);
  if (is_of_last) left_ = 0;
  const char* number = nullptr;
  natsMsgHeader_Get(message, "Status", &number);
  const std::string_view code = number == nullptr ? "" : number;
  return code == "404" || code == "408" || !is_of_last ? State::nothing : State::lost;
}

}  // namespace tutti::bus
