// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/uplink.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tutti/base/number_set.hpp"
#include "tutti/bus/simulated_network.hpp"
#include "tutti/model/messages.hpp"
#include "tutti/node/submap_frames.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::node {
namespace uplink_test {

using bus::Endpoint, bus::MessageKind;
const ChainId kChain{RobotId{1}, 7};
Timestamp at(double s) { return Timestamp{} + s; }

/// A robot that ends a submap every ten seconds, and a server that confirms what comes.
class Mission {
 public:
  struct Sent {
    double time_s = 0.0;
    SubmapId submap;
    std::size_t bytes = 0;
  };

  Mission(const UplinkConfig& config, const bus::LinkConfig& link)
      : uplink_(config), network_(bus::SimulatedRadio(Timestamp{}, link, 1), Timestamp{}) {}

  /// To the end: submaps of these sizes, then until all are confirmed.
  void run(const std::vector<std::size_t>& sizes) {
    for (double now_s = 0.0; made_ < sizes.size() || !uplink_.submaps().empty(); now_s += 0.25) {
      RC_ASSERT(now_s < 20'000.0);
      network_.advance(at(now_s));
      confirm(now_s);
      for (const bus::Received& received : robot_->receive()) {
        const Receipt receipt = wire::decode_receipt(*received.envelope.bytes).value();
        for (std::uint32_t i = 0; i < made_; ++i)
          if (receipt.contains({kChain, i})) uplink_.remove({kChain, i});
      }
      if (made_ < sizes.size() && now_s >= 10.0 * static_cast<double>(made_)) {
        uplink_.add({kChain, static_cast<std::uint32_t>(made_)}, sizes[made_]);
        ++made_;
      }
      const bool is_due = uplink_.next() && *uplink_.next() <= at(now_s);
      const auto taken = uplink_.take(at(now_s));
      RC_ASSERT(is_due == !taken.empty());
      for (const SubmapId id : taken) send(id, now_s);
    }
  }

  std::vector<Sent> sent;
  std::map<SubmapId, std::vector<double>> arrived_s;

 private:
  void send(SubmapId id, double now_s) {
    const std::size_t size = uplink_.submaps().at(id);
    if (first_.insert(id).second)  // of those that had never left it is the newest
      for (const auto& [other, bytes] : uplink_.submaps()) RC_ASSERT(other <= id || first_.contains(other));
    sent.push_back({now_s, id, size});
    RC_ASSERT(robot_
                  ->send({Endpoint::of(kChain.robot), Endpoint::server(), MessageKind::submap, message_id(id),
                          std::make_shared<const std::string>(size, 'x')})
                  .has_value());
  }
  void confirm(double now_s) {
    for (const bus::Received& received : server_->receive()) {
      const SubmapId id = submap_of(received.envelope.id).value();
      arrived_s[id].push_back(now_s);
      receipt_.stored[kChain.session].insert(id.index);
      server_->acknowledge(received.ticket);
      RC_ASSERT(server_
                    ->send({Endpoint::server(), Endpoint::of(kChain.robot), MessageKind::receipt, "",
                            std::make_shared<const std::string>(wire::encode(receipt_))})
                    .has_value());
    }
  }

  Uplink uplink_;
  bus::SimulatedNetwork network_;
  std::unique_ptr<bus::Port> robot_ = network_.connect(Endpoint::of(kChain.robot));
  std::unique_ptr<bus::Port> server_ = network_.connect(Endpoint::server());
  Receipt receipt_{.robot = kChain.robot};
  std::set<SubmapId> first_;  // have left once
  std::size_t made_ = 0;
};

RC_GTEST_PROP(Uplink, AfterAnyOutageAllArriveTheNewestFirstWithinTheBudget, ()) {
  const double outage_s = *rc::gen::element(0.0, 5.0, 59.0, 61.0, 300.0, 2000.0);
  const UplinkConfig config{.bytes_per_s = *rc::gen::element(0.0, 300.0, 1000.0, 10'000.0),
                            .max_under_way_bytes = *rc::gen::element<std::uint64_t>(0, 1, 5000, 100'000)};
  const double from_s = *rc::gen::inRange(0, 60), until_s = from_s + outage_s;
  std::vector<std::size_t> sizes;
  for (double s = 0.0; s < until_s + 100.0; s += 10.0) sizes.push_back(*rc::gen::inRange<std::size_t>(200, 3000));
  Mission mission(config, {.latency_s = 0.5, .outages = {{from_s, until_s}}});
  mission.run(sizes);

  RC_ASSERT(mission.arrived_s.size() == sizes.size());
  for (const auto& [id, times] : mission.arrived_s) {
    std::vector<double> sent_s;
    for (const Mission::Sent& sent : mission.sent)
      if (sent.submap == id) sent_s.push_back(sent.time_s);
    RC_ASSERT(std::ranges::adjacent_find(sent_s, [](double a, double b) { return b < a + Uplink::kAgain_s; }) ==
              sent_s.end());
    // It comes again only when it was sent again after it had left, as when an outage delays its receipt.
    const double left_s = times.front() - 0.75;  // latency and a step
    RC_ASSERT(times.size() <=
              1 + static_cast<std::size_t>(std::ranges::count_if(sent_s, [&](double s) { return s > left_s; })) -
                  (sent_s.front() > left_s ? 1 : 0));
  }
  if (config.bytes_per_s > 0.0)  // in every window
    for (std::size_t first = 0; first < mission.sent.size(); ++first) {
      double bytes = 0.0;
      for (std::size_t last = first; last < mission.sent.size(); ++last) {
        RC_ASSERT(bytes <= config.bytes_per_s * (mission.sent[last].time_s - mission.sent[first].time_s) + 1e-3);
        bytes += static_cast<double>(mission.sent[last].bytes);
      }
    }
}

TEST(UplinkRules, WhatIsNotConfirmedGoesAgainInItsPlace) {
  Uplink uplink({.bytes_per_s = 0.0, .max_under_way_bytes = 100});
  const auto submap = [](std::uint32_t index) { return SubmapId{kChain, index}; };
  EXPECT_EQ(uplink.next(), std::nullopt);
  uplink.add(submap(0), 500);
  EXPECT_EQ(uplink.take(at(0)), std::vector{submap(0)});  // one, however large
  uplink.add(submap(1), 60);
  uplink.add(submap(2), 60);
  EXPECT_TRUE(uplink.take(at(59)).empty());
  EXPECT_EQ(uplink.next(), at(60));
  EXPECT_EQ(uplink.take(at(60)), std::vector{submap(0)});
  EXPECT_TRUE(uplink.remove(submap(0)));
  EXPECT_FALSE(uplink.remove(submap(0)));
  EXPECT_EQ(uplink.take(at(61)), std::vector{submap(2)});
  uplink.add(submap(3), 50);
  EXPECT_TRUE(uplink.take(at(62)).empty());
  uplink.add(submap(4), 40);
  EXPECT_EQ(uplink.take(at(63)), std::vector{submap(4)});
  EXPECT_TRUE(uplink.take(at(64)).empty());
  EXPECT_EQ(uplink.bytes(), 210U);
}

}  // namespace uplink_test
}  // namespace tutti::node
