// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/internal/nats_pull.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "support/bus/nats_network.hpp"

namespace tutti::bus {
namespace nats_pull_test {

using State = NatsPull::State;

/// Requests that the test answers.
class NatsPullFrom : public ::testing::Test {
 protected:
  void SetUp() override {
    TUTTI_SKIP_WITHOUT_NATS_SERVER();
    network = std::make_unique<test::NatsNetwork>();
    const auto connect = [&](const char* name) {
      return NatsConnection::open(network->options(Endpoint::server()), name).value();
    };
    asking = connect("asking");
    answering = connect("answering");
    requests = answering->subscribe("$JS.API.CONSUMER.MSG.NEXT.NONE.server").value();
    answering->flush();
    pull = std::make_unique<NatsPull>(asking, "NONE", "server", asking->subscribe("heard.>").value(), "heard.inbox");
    asking->flush();
  }
  /// There is another request within this time.
  [[nodiscard]] bool is_asked(std::int64_t wait_ms) const {
    natsMsg* heard = nullptr;
    const bool asked = natsSubscription_NextMsg(&heard, requests, wait_ms) == NATS_OK;
    natsMsg_Destroy(heard);
    return asked;
  }
  void answer(const std::string& bytes) const {
    ASSERT_TRUE(answering->publish("heard.message", "", "", bytes));
    answering->flush();
  }

  std::unique_ptr<test::NatsNetwork> network;
  std::shared_ptr<NatsConnection> asking, answering;
  natsSubscription* requests = nullptr;
  std::unique_ptr<NatsPull> pull;
};

// Later messages must not wait until a request that was answered in part counts as lost.
TEST_F(NatsPullFrom, ARequestAnsweredInPartAndNotEndedIsFollowedByAnotherAtOnce) {
  EXPECT_EQ(pull->next(32).state, State::nothing);
  ASSERT_TRUE(is_asked(5000));
  answer("one");
  NatsPull::Next heard = pull->next(32);
  ASSERT_EQ(heard.state, State::message);
  EXPECT_EQ(bytes_of(heard.message.get()), "one");
  EXPECT_EQ(pull->next(32).state, State::nothing);
  EXPECT_FALSE(is_asked(50));  // more may come of what was asked for
  EXPECT_EQ(pull->next(32).state, State::nothing);
  EXPECT_TRUE(is_asked(5000));
  EXPECT_EQ(pull->next(32).state, State::nothing);
  EXPECT_FALSE(is_asked(50));  // nothing has come of this one: a slow bus is not asked again and again
}

}  // namespace nats_pull_test
}  // namespace tutti::bus
