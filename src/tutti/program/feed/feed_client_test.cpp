// SPDX-License-Identifier: BSD-3-Clause
// The example client, in Python, over a real socket.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include "support/paths.hpp"
#include "support/program/feed/node_target.hpp"
#include "support/robot/drifting_robot.hpp"
#include "tutti/formats/trajectory_file.hpp"
#include "tutti/program/feed/feed_server.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::program {
namespace feed_client_test {

namespace fs = std::filesystem;

/// One that has the Debian package python3-protobuf; empty: there is none.
std::string python3() {
  for (const std::string program : {"python3", "/usr/bin/python3"})
    if (std::system((program + " -c 'import google.protobuf' 2>/dev/null").c_str()) == 0) return program;
  return {};
}

/// Serves until the client, which runs on its own, has ended; its exit code.
int run_client(FeedServer& server, const std::string& command) {
  const pid_t client = fork();
  if (client == 0) {
    execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
    _exit(127);
  }
  int status = 0;
  while (waitpid(client, &status, WNOHANG) == 0) server.serve(5);
  server.serve(0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST(FeedClient, TheExampleFeedsARobotAndGoesOnWhereItStood) {
  const std::string python = python3();
  if (python.empty()) GTEST_SKIP() << "python3-protobuf is not installed: nothing was tried";
  std::string name = (fs::temp_directory_path() / "tutti-client-XXXXXX").string();
  const fs::path folder = mkdtemp(name.data());
  test::NodeTarget target;
  auto server = FeedServer::listen(folder / "feed", target, {});
  ASSERT_TRUE(server.has_value()) << server.error().message;
  const Trajectory odometry = robot::test::drifting_odometry(240);
  const auto run = [&](std::size_t samples) {
    ASSERT_TRUE(formats::write_tum(folder / "odometry.txt",
                                   {odometry.begin(), odometry.begin() + static_cast<std::ptrdiff_t>(samples)}));
    const std::string command =
        fmt::format("PYTHONPATH={} {} {} {}/feed < {}/odometry.txt > {}/corrected.txt", TUTTI_PYTHON_FOLDER, python,
                    tutti::test::source_path("examples/feed_client.py").string(), folder.string(), folder.string(),
                    folder.string());
    ASSERT_EQ(run_client(**server, command), 0);
  };
  run(100);
  EXPECT_EQ(target.node().agent().keyframes().size(), 100U);
  EXPECT_GE(target.take_sent().size(), 3U);  // submaps, the last one of the end
  const auto corrected = formats::read_trajectory(folder / "corrected.txt", "tum");
  ASSERT_TRUE(corrected.has_value()) << corrected.error().message;
  ASSERT_EQ(corrected->size(), 100U);
  EXPECT_LT(local(corrected->back().pose, odometry[99].pose).norm(), 1e-4);
  const auto message = robot::test::broadcast(target.node().agent(), 1, robot::test::kWorld);
  target.receive({bus::Endpoint::server(),
                  bus::Endpoint::of(RobotId{1}),
                  bus::MessageKind::proxy_graph,
                  {},
                  std::make_shared<const std::string>(wire::encode(message))});
  run(240);  // of which it sends 140
  const auto rest = formats::read_trajectory(folder / "corrected.txt", "tum");
  ASSERT_TRUE(rest.has_value());
  EXPECT_EQ(rest->size(), 140U);
  EXPECT_GT((rest->front().pose.translation - odometry[100].pose.translation).norm(), 0.01);
  fs::remove_all(folder);
}

}  // namespace feed_client_test
}  // namespace tutti::program
