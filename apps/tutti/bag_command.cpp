// SPDX-License-Identifier: BSD-3-Clause
// tutti bag: what robots have recorded.
#include <fmt/chrono.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>

#include "commands.hpp"
#include "options.hpp"
#include "progress_line.hpp"
#include "ros_commands.hpp"
#include "tutti/bags/bag_info.hpp"
#include "tutti/bags/near_types.hpp"
#include "tutti/mission/bag_mission.hpp"
#include "tutti/mission/bag_verdict.hpp"

namespace tutti::app {
namespace {

/// "2026-03-01 12:00:00.250"
std::string utc(Timestamp stamp) {
  const std::chrono::sys_time<std::chrono::nanoseconds> time{std::chrono::nanoseconds(stamp.ns)};
  const auto second = std::chrono::floor<std::chrono::seconds>(time);
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(time - second).count();
  return fmt::format("{:%F %T}.{:03}", fmt::gmtime(std::chrono::system_clock::to_time_t(second)), ms);
}

/// Names in a bag are anybody's: none may speak to the terminal.
std::string printable(std::string text) {
  std::ranges::replace_if(
      text, [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }, '?');
  return text;
}

void print_topics(const bags::BagInfo& info) {
  std::size_t topic_width = 5, type_width = 4;
  for (const bags::TopicInfo& topic : info.topics) {
    topic_width = std::max(topic_width, topic.topic.size());
    type_width = std::max(type_width, topic.type.size());
  }
  const auto print = [&](const auto&... columns) {
    const std::string line = fmt::format("{:<{}}  {:<{}}  {:>8}  {:>8}  {:<23}  {:<23}  {}", columns...);
    fmt::print("{}\n", printable(line.substr(0, line.find_last_not_of(' ') + 1)));
  };
  print("topic", topic_width, "type", type_width, "messages", "Hz", "first (UTC)", "last (UTC)", "frames");
  for (const bags::TopicInfo& topic : info.topics) {
    const bool any = topic.count > 0;
    print(topic.topic, topic_width, topic.type, type_width, topic.count,
          topic.rate_hz() > 0.0 ? fmt::format("{:.2f}", topic.rate_hz()) : "-", any ? utc(topic.first) : "-",
          any ? utc(topic.last) : "-",
          topic.problem.empty() ? topic.frames : "first message not understood: " + topic.problem);
  }
}

/// Replays the robots of the bag, and says whether they fit themselves.
int check(const mission::BagVerdict& verdict) {
  if (!verdict.is_ready) return complain("bag info", "--check: the bag cannot be run");
  ProgressLine progress;
  const auto found =
      mission::check_bag(verdict, [&progress, stop = announced_stop("what is known by now is reported")](double share) {
        progress.show(share, fmt::format("{:4.0f} % compared", 100.0 * share));
        return stop();
      });
  progress.close();
  for (const std::string& line : found.lines) fmt::print("check: {}\n", printable(line));
  return found.fits ? 0 : 1;
}

int show_bag(const std::string& path, bool is_checked) {
  const auto bag = bags::open_bag(path);
  if (!bag) {
    std::error_code failure;
    const std::string folder = std::filesystem::is_directory(path, failure) ? mission::known_folder(path) : "";
    return complain("bag info", folder.empty() ? bag.error().message : path + ": " + folder);
  }
  const bags::BagInfo info = bags::inspect(**bag);
  fmt::print("bag        {}\nmessages   {} of {} topics\nstorage    {}\n\n", path, info.messages, info.topics.size(),
             (*bag)->storage());
  if (!info.topics.empty()) print_topics(info);
  fmt::print("\n");
  for (const std::string& line : bags::uses(info)) fmt::print("{}\n", printable(line));
  for (const std::string& line : bags::near_types(info)) fmt::print("{}\n", printable(line));
  for (const std::string& note : info.notes) fmt::print("note: {}\n", printable(note));
  const mission::BagVerdict verdict = mission::judge_bag(path, info.robots);
  fmt::print("\n");
  for (const std::string& warning : verdict.warnings) fmt::print("warning: {}\n", printable(warning));
  fmt::print("{}\n", printable(verdict.text));
  std::fflush(stdout);
  for (const std::string& error : info.said) fmt::print(stderr, "{}\n", printable(error));
  if (info.errors == 0) return is_checked ? check(verdict) : 0;
  return complain("bag info", fmt::format("{}: {} records or chunks could not be read", path, info.errors));
}

}  // namespace

void add_bag_command(CLI::App& app, int& exit_code) {
  auto* bag =
      app.add_subcommand("bag", "What robots have recorded: rosbag2's folders, .mcap and .db3 files, ROS 1's .bag.");
  bag->require_subcommand(1);
  const auto path = std::make_shared<std::string>();
  auto* info = bag->add_subcommand(
      "info", "Topics with type, count, rate, times and frames; what Tutti would use of them, and what is missing.");
  info->footer(
      "All of the bag is read, one chunk at a time. One that is cut off is read up to the cut.\n"
      "The last line is the verdict: \"ready\" with the line to type, or \"not ready\" with what is missing;\n"
      "before it are warnings, where much of the recording would be left out.\n"
      "Example: tutti bag info recording/\n");
  info->add_option("bag", *path, "A folder that rosbag2 wrote, or an .mcap, .db3 or (ROS 1) .bag file; packed or not.")
      ->required()
      ->type_name("BAG");
  const auto is_checked = std::make_shared<bool>(false);
  info->add_flag("--check", *is_checked,
                 "Also compare what the scans see of the motion with odometry: late clocks, a LiDAR that is elsewhere "
                 "than\nstated, other axes, drift, odometry that stood still. Exit code 1 where they contradict each "
                 "other. Takes\nas long as tutti run");
  info->callback([path, is_checked, &exit_code] { exit_code = show_bag(*path, *is_checked); });
  add_bag_play(*bag, exit_code);
}

}  // namespace tutti::app
