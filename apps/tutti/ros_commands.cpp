// SPDX-License-Identifier: BSD-3-Clause
// ROS 2's topics over DDS: tutti bag play, and --ros of robot and server.
#include "ros_commands.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "options.hpp"
#include "tutti/program/robot_program.hpp"
#include "tutti/program/ros/bag_play.hpp"
#include "tutti/program/ros/ros_robot.hpp"
#include "tutti/program/ros/ros_server.hpp"
#include "tutti/program/stop.hpp"

namespace tutti::app {

struct RosArguments {
  bool wanted = false;
  std::string odometry = "odom";
  std::vector<std::string> images;
  std::string depth, imu;
  bool has_images = false, has_depth = false;
  ros::RosRobotOptions robot;
  ros::RosServerOptions server;
  std::string name_space;
  bool has_name_space = false;
};

namespace {

constexpr const char* kInsecureHelp =
    "Join ROS 2's domain on the networks that CYCLONEDDS_URI names, else on all, although anybody there may publish; "
    "default: this machine only";

Result<std::shared_ptr<ros::Participant>> join_domain(bool insecure) {
  const char* const domain = std::getenv("ROS_DOMAIN_ID");
  const auto number = ros::domain_of(domain == nullptr ? "" : domain);
  if (!number) return tl::unexpected(number.error());
  return ros::Participant::open(*number, insecure ? ros::Reach::network : ros::Reach::this_machine);
}

int play_bags(const ros::BagPlayOptions& options, bool insecure) {
  program::stop_on_signals();
  const auto participant = join_domain(insecure);
  const auto played = participant ? ros::play(options, *participant, program::stop_asked())
                                  : Result<ros::BagPlayed>(tl::unexpected(participant.error()));
  if (!played)
    return complain("bag play", played.error().message, played.error().code == ErrorCode::configuration ? 2 : 1);
  fmt::print("{} messages of {} topics, {:.1f} s of the bag in {:.1f} s, the latest {:.0f} ms late\n", played->messages,
             played->topics, played->bag_s, played->wall_s, 1e3 * played->latest_s);
  return 0;
}

}  // namespace

void add_bag_play(CLI::App& bag, int& exit_code) {
  const auto options = std::make_shared<ros::BagPlayOptions>();
  const auto insecure = std::make_shared<bool>(false);
  options->say = [](const std::string& text) { fmt::print(stderr, "tutti bag play: {}\n", text); };
  auto* command = bag.add_subcommand(
      "play", "Publish what bags hold as ROS 2's topics, over DDS and without ROS, as fast as it was recorded.");
  command->footer(
      "Of the domain ROS_DOMAIN_ID, on this machine; with --insecure CYCLONEDDS_URI says which network. Publishers "
      "are\n"
      "reliable: subscribers may be or not, and of those that are not, what the network loses is lost. docs/ros.md "
      "has\n"
      "the rest.\n"
      "Example: tutti bag play recordings/alpha recordings/bravo --wait-for /alpha/odom --rate 2\n");
  command
      ->add_option("bags", options->bags,
                   "Folders that rosbag2 wrote, .mcap or .db3 files; of several with one clock the messages come in "
                   "the order of time.")
      ->required()
      ->type_name("BAG");
  command
      ->add_option("--namespace", options->name_space,
                   "In front of every topic but /tf, /tf_static and /clock; frames stay as they are.")
      ->type_name("NAME");
  add_number(*command, "--rate", options->rate, "Times real time.", "R", within(1e-3, 1e6));
  command
      ->add_option("--topics", options->topics,
                   "Only this one, as the bag has it; may be given several times; default: all.")
      ->type_name("TOPIC");
  command
      ->add_option(
          "--wait-for", options->wait_for,
          "A topic as it is published: it has a subscriber before the first message is sent; may be given several "
          "times.")
      ->type_name("TOPIC");
  add_number(*command, "--delay", options->delay_s,
             "Before the first message; subscribers find out where it plays, which takes a moment.", "S",
             within(0.0, 1e6));
  command->add_flag("--clock", options->clock, "Publish /clock too, 40 times a second, for use_sim_time.");
  command->add_flag("--insecure", *insecure, kInsecureHelp);
  command->callback([options, insecure, &exit_code] { exit_code = play_bags(*options, *insecure); });
}

std::shared_ptr<RosArguments> add_ros_robot_options(CLI::App& robot) {
  auto out = std::make_shared<RosArguments>();
  auto* const ros = robot.add_flag("--ros", out->wanted,
                                   "Take odometry, scans, images, IMU samples and position fixes from ROS 2's topics, "
                                   "and publish map -> odom, the corrected trajectory and "
                                   "team-mates, over DDS and without ROS, on this machine; with --insecure on the "
                                   "networks that CYCLONEDDS_URI names, else on all (docs/ros.md)");
  robot
      .add_option_function<std::string>(
          "--namespace",
          [out](const std::string& name) {
            out->name_space = name;
            out->has_name_space = true;
          },
          "Of its topics, with --ros; default: its name, '/' for none")
      ->type_name("NAME")
      ->needs(ros);
  robot
      .add_option("--odom", out->odometry,
                  "Topic of nav_msgs/Odometry, below the namespace; or two frames of /tf: odom->base_link")
      ->type_name("TOPIC")
      ->capture_default_str()
      ->needs(ros);
  robot
      .add_option("--points", out->robot.points,
                  "Topic of sensor_msgs/PointCloud2, or of a Livox's CustomMsg, below the namespace; '' for none")
      ->type_name("TOPIC")
      ->capture_default_str()
      ->needs(ros);
  robot
      .add_option("--battery", out->robot.battery,
                  "Topic of sensor_msgs/BatteryState, below the namespace; '' for none")
      ->type_name("TOPIC")
      ->capture_default_str()
      ->needs(ros);
  robot
      .add_option(
          "--start-pose", out->robot.start_pose,
          "Topic of geometry_msgs/PoseWithCovarianceStamped, below the namespace: where the robot is in the map "
          "of --map, as RViz's \"2D Pose Estimate\" tells it; '' for none")
      ->type_name("TOPIC")
      ->capture_default_str()
      ->needs(ros);
  robot.add_option("--fixes", out->robot.fixes, "Topic of sensor_msgs/NavSatFix, below the namespace; '' for none")
      ->type_name("TOPIC")
      ->capture_default_str()
      ->needs(ros);
  robot
      .add_option_function<std::string>(
          "--images",
          [out](const std::string& topics) {
            out->has_images = true;
            std::istringstream in(topics);
            for (std::string topic; std::getline(in, topic, ',');) out->images.push_back(topic);
          },
          "Topics of sensor_msgs/Image or CompressedImage, below the namespace, each with a sensor_msgs/CameraInfo "
          "beside it: of one camera, or of a stereo pair; '' for none; default: those that are there, if the mission "
          "finds closures from images")
      ->type_name("TOPIC[,TOPIC]")
      ->needs(ros);
  robot
      .add_option_function<std::string>(
          "--depth",
          [out](const std::string& topic) {
            out->has_depth = true;
            out->depth = topic;
          },
          "Topic of the depth images (16UC1, 32FC1, or of compressedDepth) that are registered to the one camera, "
          "below "
          "the namespace; '' for none; default: found by what messages show")
      ->type_name("TOPIC")
      ->needs(ros);
  robot
      .add_option("--imu", out->imu,
                  "Topic of sensor_msgs/Imu, which goes with images, below the namespace; default: the one that is "
                  "there")
      ->type_name("TOPIC")
      ->needs(ros);
  robot
      .add_option("--map-frame", out->robot.map_frame,
                  "Frame that map -> odom is published from; default: of r1/odom it is r1/map")
      ->type_name("FRAME")
      ->needs(ros);
  robot
      .add_option(
          "--grid", out->robot.grid,
          "Topic of the server's nav_msgs/OccupancyGrid, which is published in the robot's own map as map, below "
          "the namespace; '' for none")
      ->type_name("TOPIC")
      ->capture_default_str()
      ->needs(ros);
  robot
      .add_option("--world-frame", out->robot.world_frame,
                  "Frame that world -> map is published from, the server's; '' for none")
      ->type_name("FRAME")
      ->capture_default_str()
      ->needs(ros);
  robot
      .add_flag("--reliable", out->robot.lossless,
                "Ask for reliable publishers, keep all and wait for it: nothing is lost however fast a bag is played; "
                "corrections come a scan later")
      ->needs(ros);
  add_number(robot, "--end-after", out->robot.end_after_s,
             "So long without odometry, once there was any, the recording has ended; 0 = never", "S", within(0.0, 1e6))
      ->needs(ros);
  return out;
}

std::shared_ptr<RosArguments> add_ros_server_options(CLI::App& server) {
  auto out = std::make_shared<RosArguments>();
  auto* const ros = server.add_flag("--ros", out->wanted,
                                    "Publish the map as ROS 2's topics map (nav_msgs/OccupancyGrid) and map_points "
                                    "(sensor_msgs/PointCloud2), over DDS and without ROS, on this machine; with "
                                    "--insecure on the networks that CYCLONEDDS_URI names, else on all (docs/ros.md)");
  server.add_option("--namespace", out->server.name_space, "Namespace of these topics; '/' for none")
      ->type_name("NAME")
      ->capture_default_str()
      ->needs(ros);
  server
      .add_option("--map-frame", out->server.frame,
                  "Frame that they are in, with _N behind it where the map that is shown is of component N")
      ->type_name("FRAME")
      ->capture_default_str()
      ->needs(ros);
  add_number(server, "--map-period", out->server.period_s, "Between two maps, at least", "S", within(0.1, 1e6))
      ->needs(ros);
  return out;
}

bool wants_ros(const RosArguments& arguments) { return arguments.wanted; }

namespace {

/// On stderr, as the program's own log has it.
std::function<void(program::Level, const std::string&)> log_of(const std::string& name, program::Level console) {
  return [log = std::shared_ptr<program::EventLog>(program::EventLog::on_console(name, console))](
             program::Level level, const std::string& text) { log->say(level, text); };
}

}  // namespace

Status feed_from_ros(const RosArguments& arguments, program::RobotOptions& options) {
  const bool takes_images = arguments.has_images ? !arguments.images.empty() : options.settings.with_images;
  for (const auto& [option, topic] : {std::pair("--imu", arguments.imu), std::pair("--depth", arguments.depth)})
    if (!takes_images && !topic.empty())
      return fail(
          ErrorCode::configuration,
          "{} is '{}', but no images are taken that it could go with: expected --images, or a mission that finds "
          "closures from images",
          option, topic);
  const auto participant = join_domain(options.bus.allow_insecure);
  if (!participant) return tl::unexpected(participant.error());
  ros::RosRobotOptions ros = arguments.robot;
  ros.name_space = arguments.has_name_space ? arguments.name_space : options.name;
  if (takes_images) {
    ros.images = options.settings.sensors.images;
    ros.images->images = arguments.images;
    ros.images->depth = arguments.depth;
    ros.images->with_depth = !arguments.has_depth || !arguments.depth.empty();
    ros.images->imu = arguments.imu;
  }
  (arguments.odometry.find("->") == std::string::npos ? ros.odometry : ros.odometry_frames) = arguments.odometry;
  ros.who = "tutti robot --ros " + options.version;
  ros.say = log_of(options.name + " ros", options.console);
  auto robot = ros::RosRobot::open(std::move(ros), *participant);
  if (!robot) return tl::unexpected(robot.error());
  options.beside_feed = [robot = std::shared_ptr<ros::RosRobot>(std::move(*robot))](program::LiveFeed& feed) {
    robot->begin(feed);
    return std::shared_ptr<void>(robot.get(), [robot](void*) { robot->end(); });
  };
  return {};
}

Status show_on_ros(const RosArguments& arguments, program::ServerOptions& options) {
  const auto participant = join_domain(options.bus.allow_insecure);
  if (!participant) return tl::unexpected(participant.error());
  ros::RosServerOptions ros = arguments.server;
  ros.say = log_of("server ros", options.console);
  options.views.emplace_back([ros, participant = *participant](const storage::TableStore& map) {
    return ros::view_on_ros(ros, participant, map);
  });
  return {};
}

}  // namespace tutti::app
