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
  Status add(Input input) override {
    if (const auto* sample = std::get_if<OdometrySample>(&input)) {
      if (known.newest && sample->stamp <= known.newest->stamp) return fail(ErrorCode::invalid, "stamps must increase");
      known.newest = {sample->stamp, sample->T_odom_body};
    }
    if (const auto* scan = std::get_if<Scan>(&input)) {
      if (!known.newest || scan->stamp != known.newest->stamp)
        return fail(ErrorCode::invalid, "not of the newest sample");
      scans.push_back(scan->stamp);
    }
    if (const auto* images = std::get_if<EncodedImages>(&input)) {
      if (auto ok = check_images(*images, sensors); !ok) return ok;
      seen.push_back(images->stamp);
    }
    if (const auto* imu = std::get_if<ImuSamples>(&input))
      for (const ImuSample& sample : *imu) felt.push_back(sample.stamp);
    if (const auto* fix = std::get_if<PositionFix>(&input)) fixes.push_back(*fix);
    if (const auto* of = std::get_if<Health>(&input)) health = *of;
    if (const auto* start = std::get_if<StartPose>(&input)) starts.push_back(*start);
    return {};
  }
  Status finish() override {
    ++finished;
    known.ended = ends_at_once;
    return {};
  }
  void set_sensors(const Sensors& of) override { sensors = of; }
  [[nodiscard]] FeedState state() const override { return known; }
  std::vector<FeedRefusal> take_refusals() override { return std::exchange(refusals, {}); }

  FeedState known{.chain = {RobotId{4}, 77}, .name = "alpha", .newest = {}};
  std::vector<Timestamp> scans, seen, felt;
  std::vector<PositionFix> fixes;
  std::vector<StartPose> starts;
  Sensors sensors;
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
