// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/feed/live_feed.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <latch>
#include <memory>
#include <string>
#include <thread>

#include "support/intake/messages.hpp"
#include "support/program/feed/client.hpp"
#include "support/program/feed/node_target.hpp"
#include "support/robot/drifting_robot.hpp"
#include "tutti/program/feed/local_client.hpp"

namespace tutti::program {
namespace live_feed_test {

constexpr int kSamples = 300;

/// Sends bytes to the feed, and waits for the answers.
class Client {
 public:
  explicit Client(const std::string& path) : file_(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
    EXPECT_EQ(connect(file_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0) << std::strerror(errno);
  }
  ~Client() { close(file_); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  void say(const std::string& bytes) const {
    ASSERT_EQ(send(file_, bytes.data(), bytes.size(), MSG_NOSIGNAL), static_cast<ssize_t>(bytes.size()));
  }
  /// The next message; empty when the connection has ended.
  v1::Feed hear() {
    while (true) {
      std::string_view rest = bytes_;
      FrameReader reader;
      if (const auto payload = reader.take(rest); payload && *payload) {
        v1::Feed message;
        message.ParseFromString(**payload);
        bytes_.erase(0, bytes_.size() - rest.size());
        return message;
      }
      std::string more(4096, '\0');
      const ssize_t count = recv(file_, more.data(), more.size(), 0);
      if (count <= 0) return {};
      bytes_ += more.substr(0, static_cast<std::size_t>(count));
    }
  }

 private:
  int file_;
  std::string bytes_;
};

std::string path_of(const std::string& name) { return testing::TempDir() + name + std::to_string(getpid()); }
std::unique_ptr<LiveFeed> opened(const std::string& path, const test::NodeTarget& robot) {
  auto feed = LiveFeed::open(path, {}, robot.state());
  EXPECT_TRUE(feed.has_value()) << feed.error().message;
  return std::move(feed).value();
}

Status give(test::NodeTarget& robot, const FeedInput& input) {
  if (const auto* anew = std::get_if<FeedAnew>(&input)) return robot.begin_session(anew->why);
  if (const auto* of_robot = std::get_if<Input>(&input)) return robot.add(*of_robot);
  return robot.finish();
}

/// The robot is stuck in its first sample until all others are answered.
TEST(LiveFeed, AnswersWhileTheRobotIsStuck) {
  const Trajectory odometry = robot::test::drifting_odometry(kSamples);
  const std::string path = path_of("live_feed_");
  test::NodeTarget robot;
  std::unique_ptr<LiveFeed> feed = opened(path, robot);
  FeedFront& front = feed->front();
  std::latch answered(1);
  std::jthread behind([&] {
    while (!front.has_ended()) {
      const auto input = front.take(0.01);
      if (!input) continue;
      answered.wait();
      EXPECT_TRUE(give(robot, *input));
      front.note_heard();
      front.note_stored();
      front.publish(robot.state());
    }
  });
  Client client(path);
  client.say(test::hello());
  EXPECT_TRUE(client.hear().has_welcome());
  EXPECT_TRUE(client.hear().has_situation());
  for (int i = 0; i < kSamples; ++i) {
    client.say(test::odometry(odometry[static_cast<std::size_t>(i)], robot::test::kStepCovariance));
    const v1::Feed answer = client.hear();
    ASSERT_TRUE(answer.has_correction()) << i;
    ASSERT_EQ(answer.correction().stamp_ns(), odometry[static_cast<std::size_t>(i)].stamp.ns);
    ASSERT_FALSE(answer.correction().has_stored());
    if (answer.correction().wants_scan()) client.say(test::scan(odometry[static_cast<std::size_t>(i)].stamp, 5));
  }
  answered.count_down();
  client.say(test::end_of_recording());
  v1::Feed last = client.hear();
  while (last.has_situation()) last = client.hear();  // which may change while it catches up
  EXPECT_TRUE(last.has_ended());
  behind.join();
  EXPECT_EQ(robot.node().agent().newest_sample(), odometry.back().stamp);
  EXPECT_EQ(robot.node().agent().keyframes().size(), static_cast<std::size_t>(kSamples));
  EXPECT_EQ(front.state().stored, odometry.back().stamp);
  EXPECT_EQ(feed->take_thrown(), "");
  feed.reset();
  EXPECT_NE(access(path.c_str(), F_OK), 0);
}

/// Through the socket: one stamp in the future costs that one sample, and a clock that goes back a second or two.
TEST(LiveFeed, OutlivesStampsInTheFutureAndAClockThatGoesBack) {
  for (const double rate : {1.0, 200.0}) {
    const Trajectory trajectory = robot::test::drifting_odometry(1700);
    const std::string path = path_of("live_feed_clock_");
    test::NodeTarget robot;
    std::unique_ptr<LiveFeed> feed = opened(path, robot);
    std::jthread behind([&](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        const auto input = feed->front().take(0.01);
        if (!input) continue;
        EXPECT_TRUE(give(robot, *input));
        feed->front().note_heard();
        feed->front().note_stored();
        feed->front().publish(robot.state());
      }
    });
    Client client(path);
    client.say(test::hello());
    EXPECT_TRUE(client.hear().has_welcome());
    std::string alerts;
    std::size_t next = 0;
    const auto is_taken = [&](Timestamp stamp) {
      client.say(test::odometry({stamp, trajectory[next++].pose}, robot::test::kStepCovariance));
      while (true) {
        const v1::Feed heard = client.hear();
        for (const auto& alert : heard.situation().alert()) alerts += alert.text() + "\n";
        if (heard.has_correction() || heard.has_refused()) return heard.has_correction();
      }
    };
    const Timestamp start = trajectory[0].stamp;
    const auto seconds = [&](double from_s, double for_s) {
      int taken = 0;
      for (int i = 0; i < for_s * rate; ++i) taken += is_taken(start + (from_s + i / rate)) ? 1 : 0;
      return taken / rate;
    };
    EXPECT_EQ(seconds(0.0, 2.0), 2.0);
    EXPECT_FALSE(is_taken(start + 86'400.0));
    EXPECT_EQ(seconds(2.0, 1.0), 1.0);
    EXPECT_EQ(alerts, "");
    EXPECT_NEAR(seconds(-86'400.0, 5.0), 3.0, 1.0 + 1 / rate);
    EXPECT_NE(alerts.find("odometry samples are refused"), std::string::npos) << alerts;
    client.say(test::end_of_recording());
    while (!client.hear().has_ended()) continue;
    behind.request_stop();
    behind.join();
    EXPECT_EQ(robot.node().agent().chain().session, 8U);
    EXPECT_EQ(feed->front().state().chain.session, 8U);
    EXPECT_EQ(robot.node().agent().newest_sample(), feed->front().state().newest->stamp);
    EXPECT_EQ(feed->front().odometry_trouble(), "");
    EXPECT_EQ(feed->front().state().alerts.size(), 1U);
    EXPECT_NE(feed->front().state().alerts.at(0).text.find("session 8 has begun"), std::string::npos);
  }
}

/// The trajectory that a robot corrects comes to who asked for it, to the bit.
TEST(LiveFeed, SendsTheCorrectedTrajectoryToWhoWantsIt) {
  const std::string path = path_of("live_feed_way_");
  test::NodeTarget robot;
  std::unique_ptr<LiveFeed> feed = opened(path, robot);
  Client other(path), client(path);
  other.say(test::hello(true));
  v1::Feed hello;
  hello.mutable_hello()->set_protocol_version(kFeedVersion);
  hello.mutable_hello()->set_wants_trajectory(true);
  client.say(test::framed(hello));
  EXPECT_TRUE(client.hear().has_welcome());
  EXPECT_TRUE(client.hear().has_situation());
  EXPECT_TRUE(feed->front().wants_trajectory());
  const Trajectory odometry = robot::test::drifting_odometry(30);
  feed->front().say({{2, 7}, 5, odometry, {odometry[3], odometry[9]}});
  const v1::Feed heard = client.hear();
  ASSERT_TRUE(heard.has_trajectory());
  EXPECT_EQ(heard.trajectory().map_epoch(), 2U);
  EXPECT_EQ(heard.trajectory().map_revision(), 7U);
  EXPECT_EQ(heard.trajectory().constraints(), 5U);
  const auto poses = [](const auto& stamps, const auto& numbers) {
    Trajectory out;
    for (int i = 0; i < stamps.size(); ++i) {
      const auto at = [&](int k) { return numbers.Get(7 * i + k); };
      out.push_back({{stamps.Get(i)}, {Eigen::Quaterniond(at(6), at(3), at(4), at(5)), {at(0), at(1), at(2)}}});
    }
    return out;
  };
  EXPECT_EQ(poses(heard.trajectory().stamp_ns(), heard.trajectory().t_map_body()), odometry);
  EXPECT_EQ(poses(heard.trajectory().map_stamp_ns(), heard.trajectory().t_world_body()),
            (Trajectory{odometry[3], odometry[9]}));
  client.say(test::odometry(odometry[0], Matrix6d::Zero()));
  EXPECT_EQ(client.hear().correction().stamp_ns(), odometry[0].stamp.ns);
  EXPECT_TRUE(other.hear().has_welcome());
  EXPECT_TRUE(other.hear().has_situation());
  EXPECT_TRUE(other.hear().has_correction());  // and no trajectory
}

/// A robot program that ends first sends everything that it still has to send.
TEST(LiveFeed, SaysTheEndBeforeItGoes) {
  const Trajectory odometry = robot::test::drifting_odometry(3);
  const std::string path = path_of("live_feed_end_");
  test::NodeTarget robot;
  std::unique_ptr<LiveFeed> feed = opened(path, robot);
  Client client(path);
  client.say(test::hello() + test::odometry(odometry[0], Matrix6d::Zero()) + test::end_of_recording());
  EXPECT_TRUE(client.hear().has_welcome());
  EXPECT_TRUE(client.hear().has_situation());
  EXPECT_TRUE(client.hear().has_correction());
  FeedFront& front = feed->front();
  for (int i = 0; i < 2; ++i) {
    const auto input = front.take(10.0);
    ASSERT_TRUE(input);
    EXPECT_TRUE(give(robot, *input));
    front.note_heard();
  }
  front.note_stored();
  feed.reset();
  EXPECT_TRUE(client.hear().has_ended());
}

FeedHello of_ros() {
  FeedHello out{.version = kFeedVersion, .client = "ros", .sensors = Sensors{.scans = true}};
  out.ros = std::optional(FeedRos{});
  return out;
}
intake::RawMessage odometry_at(int i, std::string& bytes) {
  using namespace intake::test;
  bytes = intake::test::odometry(kStart + i * kPeriod, 0.1 * i, "odom", "base_link");
  return {"/odom", "nav_msgs/msg/Odometry", "cdr", bytes};
}
template <class Kind>
int count(const std::vector<FromRobot>& heard) {
  return static_cast<int>(
      std::ranges::count_if(heard, [](const auto& one) { return std::holds_alternative<Kind>(one); }));
}

/// In the robot's process, without the socket: answered at once, while others listen at the socket.
TEST(LocalClient, FeedsInMemoryAndOthersListen) {
  const std::string path = path_of("live_feed_local_");
  test::NodeTarget robot;
  std::unique_ptr<LiveFeed> feed = opened(path, robot);
  Client listener(path);
  listener.say(test::hello(true));
  EXPECT_TRUE(listener.hear().has_welcome());
  EXPECT_TRUE(listener.hear().has_situation());
  auto client = LocalClient::join(*feed, of_ros());
  ASSERT_TRUE(client.has_value()) << client.error().message;
  EXPECT_EQ(count<FeedWelcome>((*client)->hear().value()), 1);
  std::string bytes;
  for (int i = 0; i < 10; ++i) {
    (*client)->say(odometry_at(i, bytes));
    const auto heard = (*client)->hear().value();
    EXPECT_EQ(count<FeedAnswer>(heard), 1);
    EXPECT_EQ(count<FeedRaw>(heard), 2);  // transform and pose
    EXPECT_EQ(count<FeedNote>(heard), i == 0 ? 1 : 0);
  }
  for (int i = 0; i < 10;) i += listener.hear().has_correction() ? 1 : 0;
  (*client)->say({"/odom", "nav_msgs/msg/Odometry", "cdr", "nonsense"});
  EXPECT_EQ(count<FeedRefusal>((*client)->hear().value()), 1);
  while (!feed->is_fed()) std::this_thread::yield();

  Client second(path);
  second.say(test::hello());
  EXPECT_NE(second.hear().closed().why().find("feeds this robot already"), std::string::npos);
  const auto third = LocalClient::join(*feed, of_ros());
  EXPECT_EQ(count<FeedOver>((*third)->hear().value()), 1);
  EXPECT_FALSE((*third)->hear().has_value());
  (*third)->say(odometry_at(10, bytes));  // nobody hears it

  client->reset();
  Client other(path);
  other.say(test::hello());
  EXPECT_TRUE(other.hear().has_welcome());
  std::size_t samples = 0;
  while (const auto input = feed->front().take(0.0)) samples += sample_in<OdometrySample>(*input) ? 1 : 0;
  EXPECT_EQ(samples, 10U);
}

/// Odometry waits for the scan of its time; a scan that does not come is not waited for for ever.
TEST(LocalClient, HoldsOdometryForItsScans) {
  using namespace intake::test;
  const std::string path = path_of("live_feed_held_");
  test::NodeTarget robot;
  std::unique_ptr<LiveFeed> feed = opened(path, robot);
  auto client = LocalClient::join(*feed, of_ros());
  ASSERT_TRUE(client.has_value()) << client.error().message;
  const auto hold = [&](bool for_scans) {
    (*client)->use_intake([&](intake::SensorIntake& intake) { intake.hold_odometry(for_scans, false); });
  };
  const auto answers = [&] { return count<FeedAnswer>((*client)->hear().value()); };
  hold(true);
  std::string bytes;
  for (int i = 0; i < 3; ++i) (*client)->say(odometry_at(i, bytes));
  EXPECT_EQ(answers(), 0);
  bytes = points(kStart + kPeriod, kAtOnce, "base_link");
  (*client)->say({"/points", "sensor_msgs/msg/PointCloud2", "cdr", bytes});
  EXPECT_EQ(answers(), 2);
  hold(false);
  EXPECT_EQ(answers(), 1);
}

}  // namespace live_feed_test
}  // namespace tutti::program
