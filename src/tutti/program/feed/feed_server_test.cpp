// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/feed/feed_server.hpp"

#include <fcntl.h>
#include <grp.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "support/program/feed/client.hpp"
#include "support/program/feed/node_target.hpp"
#include "support/robot/drifting_robot.hpp"

namespace tutti::program {
namespace feed_server_test {

class FeedServerTest : public testing::Test {
 protected:
  FeedServerTest() { listen(); }
  ~FeedServerTest() override { std::filesystem::remove_all(folder_); }
  void listen() {
    server_.reset();
    server_ = FeedServer::listen(path_, target_, settings_).value();
  }
  int connect() {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path_.copy(address.sun_path, sizeof address.sun_path - 1);
    const int file = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    EXPECT_EQ(::connect(file, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    return file;
  }
  /// Sends this and returns the server's answers, when it has done all it can.
  std::vector<v1::Feed> say(int file, const std::string& bytes) {
    const ssize_t sent = bytes.empty() ? 0 : send(file, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    EXPECT_EQ(sent, static_cast<ssize_t>(bytes.size()));
    std::string heard;
    for (int round = 0; round < 20; ++round) {
      server_->serve(0);
      char buffer[4096];
      for (ssize_t count = 0; (count = recv(file, buffer, sizeof buffer, 0)) > 0;)
        heard.append(buffer, static_cast<std::size_t>(count));
    }
    return test::messages(heard);
  }
  [[nodiscard]] std::string sample(int i) const {
    return test::odometry(odometry_[static_cast<std::size_t>(i)], robot::test::kStepCovariance);
  }

  static std::filesystem::path new_folder() {
    std::string name = (std::filesystem::temp_directory_path() / "tutti-feed-XXXXXX").string();
    return mkdtemp(name.data());
  }
  const std::filesystem::path folder_ = new_folder();
  const std::string path_ = folder_ / "feed";
  const Trajectory odometry_ = robot::test::drifting_odometry(100);
  test::NodeTarget target_;
  FeedSettings settings_{.max_clients = 3};
  std::unique_ptr<FeedServer> server_;
};

TEST_F(FeedServerTest, FeedsARobotOverASocketAndAgain) {
  int client = connect();
  EXPECT_EQ(say(client, test::hello() + sample(0) + sample(1)).size(), 4U);
  close(client);
  server_->serve(0);
  EXPECT_EQ(server_->clients(), 0U);
  client = connect();
  const auto again = say(client, test::hello() + sample(1) + sample(2));
  ASSERT_EQ(again.size(), 4U);
  EXPECT_EQ(again[0].welcome().last_stamp_ns(), odometry_[1].stamp.ns);
  EXPECT_TRUE(again[2].has_refused());
  EXPECT_EQ(again[3].correction().stamp_ns(), odometry_[2].stamp.ns);
  EXPECT_EQ(target_.node().agent().newest_sample(), odometry_[2].stamp);
  close(client);
}

TEST_F(FeedServerTest, OneThatHasSentAllMayStillRead) {
  const int client = connect();
  const std::string bytes = test::hello() + sample(0) + test::end_of_recording();
  ASSERT_EQ(send(client, bytes.data(), bytes.size(), 0), static_cast<ssize_t>(bytes.size()));
  shutdown(client, SHUT_WR);
  const auto heard = say(client, "");
  ASSERT_EQ(heard.size(), 4U);
  EXPECT_TRUE(heard[3].has_ended());
  EXPECT_EQ(server_->clients(), 0U);
  close(client);
}

TEST_F(FeedServerTest, AClientThatNeverReadsHoldsUpNobody) {
  const int feeder = connect(), sleeper = connect();
  const std::string greeting = test::hello(true);
  ASSERT_EQ(send(sleeper, greeting.data(), greeting.size(), 0), static_cast<ssize_t>(greeting.size()));
  EXPECT_EQ(say(feeder, test::hello()).size(), 2U);
  const int one_more = connect(), too_many = connect();
  std::size_t answers = 0;
  Trajectory trajectory = robot::test::fine_odometry(400);  // 4,000 corrections of 600 bytes
  for (std::size_t i = 0; i < trajectory.size(); i += 10) {
    std::string bytes;
    for (std::size_t k = i; k < std::min(i + 10, trajectory.size()); ++k)
      bytes += test::odometry(trajectory[k], robot::test::kStepCovariance);
    for (const auto& answer : say(feeder, bytes)) answers += answer.has_correction() ? 1 : 0;
  }
  EXPECT_EQ(answers, trajectory.size());
  EXPECT_EQ(server_->clients(), 3U);
  EXPECT_GT(say(sleeper, "").back().correction().dropped(), 0U);
  for (const int file : {feeder, sleeper, one_more, too_many}) close(file);
}

TEST_F(FeedServerTest, SilentConnectionsDoNotKeepTheFeederOut) {
  std::vector<int> silent;
  for (int i = 0; i < 5; ++i) {
    silent.push_back(connect());
    server_->serve(0);
  }
  const int feeder = connect();
  EXPECT_EQ(say(feeder, test::hello() + sample(0)).size(), 3U);
  for (int i = 0; i < 5; ++i) {
    silent.push_back(connect());
    server_->serve(0);
  }
  EXPECT_EQ(say(feeder, sample(1)).size(), 1U);
  for (const int file : silent) close(file);
  close(feeder);
  for (int i = 0; i < 10; ++i) server_->serve(0);
  // Nor do listeners: the last place is who feeds'.
  const int one = connect(), two = connect(), three = connect();
  EXPECT_EQ(say(one, test::hello(true)).size(), 2U);
  EXPECT_EQ(say(two, test::hello(true)).size(), 2U);
  const auto refused = say(three, test::hello(true));
  ASSERT_EQ(refused.size(), 1U);
  EXPECT_TRUE(refused[0].has_closed());
  const int again = connect();
  EXPECT_EQ(say(again, test::hello() + sample(2)).size(), 3U);
  for (const int file : {one, two, three, again}) close(file);
}

/// Slow ones that never get to the end of their Hello, and more of them all the time.
TEST_F(FeedServerTest, WhoSpeaksAByteAtATimeKeepsNobodyOut) {
  const std::string hello = test::hello();
  std::vector<int> slow;
  for (int i = 0; i < 3; ++i) {
    slow.push_back(connect());
    server_->serve(0);
  }
  const int feeder = connect();
  EXPECT_EQ(say(feeder, hello + sample(0)).size(), 3U);
  for (int i = 1; i < 60; ++i) {
    const char& next = hello[static_cast<std::size_t>(i) % (hello.size() - 1)];
    for (const int file : slow) static_cast<void>(send(file, &next, 1, MSG_NOSIGNAL));
    slow.push_back(connect());
    EXPECT_EQ(say(feeder, sample(i)).size(), 1U) << i;
    EXPECT_LE(server_->clients(), 3U);
  }
  for (const int file : slow) close(file);
  close(feeder);
}

TEST_F(FeedServerTest, TheSocketMayBeAGroups) {
  server_.reset();
  const std::string group = ::getgrgid(::getegid())->gr_name;
  server_ = FeedServer::listen(path_, target_, settings_, {.group = group, .mode = 0660}).value();
  struct stat found {};
  ASSERT_EQ(stat(path_.c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 0777U, 0660U);
  EXPECT_EQ(found.st_gid, ::getegid());
  server_.reset();
  const auto nobodys = FeedServer::listen(path_, target_, settings_, {.group = "no-such-group"});
  ASSERT_FALSE(nobodys.has_value());
  EXPECT_NE(nobodys.error().message.find("no-such-group"), std::string::npos) << nobodys.error().message;
}

TEST_F(FeedServerTest, GarbageGetsAnErrorAndAClose) {
  const int client = connect();
  const auto heard = say(client, "GET / HTTP/1.1\r\n\r\n");
  ASSERT_EQ(heard.size(), 1U);
  EXPECT_TRUE(heard[0].has_closed());
  EXPECT_EQ(server_->clients(), 0U);
  close(client);
}

TEST_F(FeedServerTest, TheSocketIsThisUsersAndReplacesADeadOne) {
  struct stat found {};
  ASSERT_EQ(stat(path_.c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 0777U, 0600U);
  const auto in_use = FeedServer::listen(path_, target_, settings_);
  ASSERT_FALSE(in_use.has_value());
  EXPECT_NE(in_use.error().message.find("another program listens"), std::string::npos);
  server_.reset();
  EXPECT_FALSE(std::filesystem::exists(path_));
  const int dead = socket(AF_UNIX, SOCK_STREAM, 0);  // as of a program that was killed
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path_.copy(address.sun_path, sizeof address.sun_path - 1);
  ASSERT_EQ(bind(dead, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  close(dead);
  ASSERT_TRUE(std::filesystem::exists(path_));
  listen();
  const std::string file = folder_ / "file";
  std::ofstream(file) << "mine";
  EXPECT_FALSE(FeedServer::listen(file, target_, settings_).has_value());
  EXPECT_TRUE(std::filesystem::exists(file));
  EXPECT_FALSE(FeedServer::listen(folder_ / "none" / "feed", target_, settings_).has_value());
  EXPECT_FALSE(FeedServer::listen(folder_ / std::string(120, 'x'), target_, settings_).has_value());
}

}  // namespace feed_server_test
}  // namespace tutti::program
