// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "support/program/feed/client.hpp"
#include "tutti/program/feed/feed_session.hpp"

namespace tutti::program::test {

/// Takes samples of increasing stamps; what else it knows is set by hand.
class ScriptedTarget final : public FeedTarget {
 public:
  Status add_odometry(const node::OdometrySample& sample) override {
    if (known.newest && sample.stamp <= known.newest->stamp) return fail(ErrorCode::invalid, "stamps must increase");
    known.newest = {sample.stamp, sample.T_odom_body};
    return {};
  }
  Status add_scan(const Scan& scan) override {
    if (!known.newest || scan.stamp != known.newest->stamp) return fail(ErrorCode::invalid, "not of the newest sample");
    scans.push_back(scan.stamp);
    return {};
  }
  Status finish() override {
    ++finished;
    known.ended = ends_at_once;
    return {};
  }
  void set_sensors(const intake::FeedSensors& of) override { sensors = of; }
  Status add_images(intake::FedImages images) override {
    if (auto ok = intake::check_images(images, sensors); !ok) return ok;
    seen.push_back(images.stamp);
    return {};
  }
  Status add_imu(const std::vector<ImuSample>& samples) override {
    for (const ImuSample& sample : samples) felt.push_back(sample.stamp);
    return {};
  }
  Status add_fix(const PositionFix& fix) override {
    fixes.push_back(fix);
    return {};
  }
  void set_health(const Health& of) override { health = of; }
  [[nodiscard]] FeedState state() const override { return known; }
  std::vector<FeedRefusal> take_refusals() override { return std::exchange(refusals, {}); }

  FeedState known{.chain = {RobotId{4}, 77}, .name = "alpha", .newest = {}};
  std::vector<Timestamp> scans, seen, felt;
  std::vector<PositionFix> fixes;
  intake::FeedSensors sensors;
  Health health;
  int finished = 0;
  bool ends_at_once = true;
  std::vector<FeedRefusal> refusals;
};

class SessionFixture : public testing::Test {
 protected:
  static std::string sample(std::int64_t ns) { return odometry({{ns}, {}}, Matrix6d::Identity()); }
  /// All that waits for the client, read by it.
  std::vector<v1::Feed> read(FeedSession::Client client) {
    std::string bytes;
    while (!session_.output(client).empty()) {
      const std::string_view part = session_.output(client).substr(0, 100);
      bytes += part;
      session_.sent(client, part.size());
    }
    return messages(bytes);
  }
  std::vector<v1::Feed> say(FeedSession::Client client, const std::string& bytes) {
    session_.receive(client, bytes);
    return read(client);
  }
  /// A client that was greeted, as number `client`.
  void join(FeedSession::Client client, bool listens_only = false) {
    session_.connect(client);
    ASSERT_EQ(say(client, hello(listens_only)).size(), 2U);
  }

  ScriptedTarget target_;
  FeedSettings settings_{.max_queue_kb = 8};
  Timestamp now_{1'700'000'000'000'000'000};
  FeedSession session_{target_, settings_, [this] { return now_; }};
};

}  // namespace tutti::program::test
