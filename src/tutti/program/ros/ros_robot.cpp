// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/ros/ros_robot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <map>
#include <optional>
#include <thread>
#include <utility>

#include "tutti/bags/antenna_sample.hpp"
#include "tutti/bags/ros_definitions.hpp"
#include "tutti/bags/ros_types.hpp"
#include "tutti/program/clock.hpp"
#include "tutti/program/feed/local_client.hpp"
#include "tutti/program/ros/complaints.hpp"
#include "tutti/program/ros/image_topics.hpp"
#include "tutti/program/ros/robot_topics.hpp"
#include "tutti/program/ros/ros_diagnosis.hpp"
#include "tutti/program/ros/ros_images.hpp"

namespace tutti::ros {
namespace {

using program::Clock, program::Level, program::LocalClient;

constexpr double kWait_s = 0.02;
constexpr double kJoinsAgain_s = 0.1;
constexpr double kEachSecond_s = 1.0;
// Where nothing may be lost:
constexpr int kSilentTurns = 50;     // after so many in a row without a message, a second, no sensor sends more
constexpr std::size_t kAtOnce = 20;  // messages of a topic: the robot may be behind

Qos in_qos(bool lossless, int depth) { return {.reliable = lossless, .latched = false, .depth = lossless ? 0 : depth}; }

class Robot final : public RosRobot {
 public:
  Robot(RosRobotOptions options, std::shared_ptr<Participant> participant)
      : options_(std::move(options)),
        participant_(std::move(participant)),
        complaints_(options_.say),
        topics_(options_.name_space, participant_, complaints_) {}
  ~Robot() override { Robot::end(); }
  Robot(const Robot&) = delete;
  Robot& operator=(const Robot&) = delete;

  Status open();
  void begin(program::LiveFeed& feed) override;
  void end() override;

 private:
  [[nodiscard]] bool by_tf() const { return !options_.odometry_frames.empty(); }
  Status subscribe();
  Status subscribe_points();
  Status subscribe_ranges();
  void run(const std::stop_token& stop);
  void turn();
  bool join();
  void take_messages();
  void take(Reader* reader);
  void hold_odometry(bool holds);
  void release_odometry();
  void end_recording();
  void hear();
  void each_second();
  void look_for_odometry();
  void publish_diagnostics();

  // The robot's messages, by kind.
  void note(const program::FeedAnswer& answer);
  void note(const program::FeedRaw& message) { topics_.publish(message); }
  void note(const program::FeedNote& message) { options_.say(Level::info, message.text); }
  void note(const program::FeedSituation& situation) { situation_ = situation; }
  void note(const program::FeedRefusal& refused) { complain("the robot refuses", ErrorCode::invalid, refused.why); }
  void note(const program::FeedOver& over) { complain("the robot ends the connection", ErrorCode::io, over.why); }
  void note(const program::FeedJump& jump) {
    options_.say(Level::warning, fmt::format("jump by {:.2f} m: {}", jump.translation_m, jump.why));
  }
  void note(const program::FeedWelcome&) {}
  void note(const program::FeedOther&) {}
  void complain(const std::string& what, ErrorCode code, const std::string& why) {
    complaints_.add(what, fail(code, "{}", why));
  }

  RosRobotOptions options_;
  std::shared_ptr<Participant> participant_;
  program::LiveFeed* feed_ = nullptr;
  std::unique_ptr<Reader> odometry_, points_, fixes_, battery_, grid_, start_pose_, tf_, tf_static_, own_tf_,
      own_tf_static_;
  std::map<std::string, std::unique_ptr<Reader>> ranges_;  ///< By topic.
  std::unique_ptr<LocalClient> client_;
  program::FeedSituation situation_;
  intake::RosIntake::Counts counts_;
  bool in_map_ = false, was_fed_ = false, ended_ = false;
  double last_odometry_s_ = 0.0, second_s_ = 0.0;
  bool is_silent_turn_ = true;
  int silent_turns_ = 0;  ///< In a row.
  bool said_no_odometry_ = false, odometry_came_ = false;
  Complaints complaints_;
  RobotTopics topics_;
  std::unique_ptr<RosImages> images_;  // null: none are wanted
  std::jthread thread_;
};

Status Robot::open() {
  if (Status ok = topics_.open(); !ok) return ok;
  for (const std::string& topic :
       {by_tf() ? "/tf" : options_.odometry, options_.points, options_.fixes, options_.start_pose})
    if (const auto name = resolve(topic.empty() ? "none" : topic, options_.name_space); !name)
      return tl::unexpected(name.error());
  if (!options_.grid.empty()) {
    const auto from = resolve(options_.grid, options_.name_space);
    if (!from) return tl::unexpected(from.error());
    if (*from == resolve("map", options_.name_space).value())
      return fail(
          ErrorCode::configuration,
          "the server's grid is to be taken from {}, where this robot publishes its own: expected another topic, "
          "as the server's /world/map",
          *from);
  }
  if (!options_.images) return {};
  if (Status ok = resolve(*options_.images, options_.name_space); !ok) return ok;
  images_ = std::make_unique<RosImages>(
      RosImages::Options{*options_.images, options_.lossless, options_.patience_s, options_.say}, participant_,
      complaints_);
  return {};
}

void Robot::begin(program::LiveFeed& feed) {
  feed_ = &feed;
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

void Robot::end() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
  client_.reset();
}

/// Once the robot is there: who waits for subscribers may begin then.
Status Robot::subscribe() {
  const auto make = [&](std::unique_ptr<Reader>& out, const std::string& topic, const char* type,
                        const Qos& qos) -> Status {
    if (topic.empty()) return {};
    const auto name = resolve(topic, options_.name_space);
    auto made = participant_->reader(name.value(), type, qos, bags::ros_type_hash(type));
    if (!made) return tl::unexpected(made.error());
    out = std::move(*made);
    return {};
  };
  constexpr int kOdometryDepth = 1000, kFixesDepth = 100;  // how long this thread may be blocked
  const Qos tf = by_tf() && options_.lossless ? in_qos(true, 0) : kTfQos;
  if (Status ok = make(tf_static_, "/tf_static", bags::kTfType, kStaticTfQos); !ok) return ok;
  if (Status ok = make(tf_, "/tf", bags::kTfType, tf); !ok) return ok;
  if (resolve("tf", options_.name_space).value() != "/tf") {
    if (Status ok = make(own_tf_static_, "tf_static", bags::kTfType, kStaticTfQos); !ok) return ok;
    if (Status ok = make(own_tf_, "tf", bags::kTfType, tf); !ok) return ok;
  }
  if (!by_tf())
    if (Status ok = make(odometry_, options_.odometry, bags::kOdometryType, in_qos(options_.lossless, kOdometryDepth));
        !ok)
      return ok;
  if (Status ok = subscribe_points(); !ok) return ok;
  if (Status ok = make(grid_, options_.world_frame.empty() ? "" : options_.grid, program::RosGrid::kType, kLatchedQos);
      !ok)
    return ok;
  if (Status ok = make(battery_, options_.battery, bags::kBatteryType, in_qos(false, 1)); !ok) return ok;
  if (Status ok = make(start_pose_, options_.start_pose, program::RosClient::kPoseWithCovarianceType,
                       {.reliable = true, .latched = false, .depth = 1});
      !ok)
    return ok;
  return make(fixes_, options_.fixes, bags::kFixType, in_qos(options_.lossless, kFixesDepth));
}

/// A reader hears messages of one type only, and scans come in several: while nobody publishes what this one hears, it
/// is replaced by one of the type that somebody does.
Status Robot::subscribe_points() {
  constexpr int kDepth = 10;  // how long this thread may be blocked
  if (options_.points.empty() || (points_ && points_->writers() > 0)) return {};
  const auto name = resolve(options_.points, options_.name_space);
  std::string type = points_ ? points_->type() : std::string(bags::kScanTypes.front().name);
  for (const Publication& publication : participant_->publications())
    if (publication.topic == *name && bags::is_scan_type(publication.type)) type = publication.type;
  if (points_ && points_->type() == type) return {};
  auto made = participant_->reader(*name, type, in_qos(options_.lossless, kDepth), bags::ros_type_hash(type));
  if (!made) return tl::unexpected(made.error());
  points_ = std::move(*made);
  return {};
}

/// To whichever robots somebody publishes ranges: sensor_msgs/Range on range_to/NAME.
Status Robot::subscribe_ranges() {
  constexpr int kDepth = 100;
  constexpr std::size_t kMost = 100;
  const std::string own = resolve("range_to", options_.name_space).value() + "/";
  for (const Publication& publication : participant_->publications()) {
    const std::string& topic = publication.topic;
    if (publication.type != bags::kRangeType || !topic.starts_with(own) || bags::ranged_robot(topic).empty() ||
        ranges_.contains(topic) || ranges_.size() >= kMost)
      continue;
    auto made = participant_->reader(topic, bags::kRangeType, in_qos(options_.lossless, kDepth),
                                     bags::ros_type_hash(bags::kRangeType));
    if (!made) return tl::unexpected(made.error());
    ranges_[topic] = std::move(*made);
  }
  return {};
}

void Robot::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) try {
      turn();
    } catch (const std::exception& error) {
      options_.say(Level::error, fmt::format("the part that speaks ROS has thrown, which is a defect of it; it begins "
                                             "anew: {}",
                                             error.what()));
      client_.reset();
      std::this_thread::sleep_for(std::chrono::duration<double>(kJoinsAgain_s));
    }
}

void Robot::turn() {
  if (!client_ && !join()) return std::this_thread::sleep_for(std::chrono::duration<double>(kJoinsAgain_s));
  if (options_.lossless && feed_->front().is_filling()) {
    std::this_thread::sleep_for(std::chrono::duration<double>(kWait_s));
  } else {
    participant_->wait(kWait_s);
    complaints_.add(options_.points, subscribe_points());
    complaints_.add("range_to", subscribe_ranges());
    if (images_) images_->check_topics(*client_);
    take_messages();
    end_recording();
  }
  hear();
  each_second();
}

bool Robot::join() {
  program::FeedHello hello{
      .version = program::kFeedVersion,
      .client = options_.who,
      .sensors = Sensors{.scans = !options_.points.empty(), .cameras = {}, .depth = {}, .imu = {}}};
  program::FeedRos ros;
  ros.odometry_frames = options_.odometry_frames;
  ros.map_frame = options_.map_frame;
  ros.world_frame = options_.world_frame;
  ros.tolerance_s = options_.tolerance_s;
  hello.ros = std::optional(std::move(ros));
  auto client = LocalClient::join(*feed_, hello);
  if (!client) return false;
  client_ = std::move(*client);
  hear();
  if (!client_) return false;
  if (images_) images_->begin_again();
  if (tf_) return true;
  last_odometry_s_ = Clock::steady_s();
  if (const Status ok = subscribe(); !ok) options_.say(Level::error, ok.error().message);
  return true;
}

/// Odometry last, so that what it covers is there.
void Robot::take_messages() {
  is_silent_turn_ = true;
  hold_odometry(true);
  if (own_tf_ && own_tf_->writers() > 0 && topics_.open_own_tf())
    options_.say(Level::info, fmt::format("transforms come on {}: map -> odom is published there", own_tf_->topic()));
  for (const auto* reader : {&tf_static_, &own_tf_static_, &points_, &fixes_, &battery_, &grid_, &start_pose_})
    take(reader->get());
  for (const auto& [topic, reader] : ranges_) take(reader.get());
  if (images_) images_->take([this](Reader& reader) { take(&reader); });
  for (const auto* reader : {&tf_, &own_tf_, &odometry_}) take(reader->get());
  release_odometry();
}

void Robot::take(Reader* reader) {
  if (reader == nullptr || !client_) return;
  reader->take(
      [&](const Message& message) {
        if (!client_) return;
        is_silent_turn_ = false;
        odometry_came_ = odometry_came_ || reader == odometry_.get();
        client_->say(intake::RawMessage{reader->topic(), reader->type(), "cdr", message.cdr});
        hear();
      },
      options_.lossless ? kAtOnce : Reader::kAll);
}

void Robot::hold_odometry(bool holds) {
  if (!options_.lossless || !client_) return;
  client_->use_intake([&](intake::SensorIntake& intake) { intake.hold_odometry(holds && points_, holds && images_); });
}

/// Odometry that waits goes alone when nothing more comes. Turns are counted and not seconds: a thread that was blocked
/// has messages before it. Later odometry waits as before.
void Robot::release_odometry() {
  silent_turns_ = is_silent_turn_ ? silent_turns_ + 1 : 0;
  if (silent_turns_ != kSilentTurns) return;
  hold_odometry(false);
  hold_odometry(true);
}

void Robot::end_recording() {
  const bool has_ended =
      options_.end_after_s > 0.0 && was_fed_ && !ended_ && Clock::steady_s() - last_odometry_s_ > options_.end_after_s;
  if (!has_ended || !client_) return;
  ended_ = true;
  options_.say(Level::info, fmt::format("no odometry for {} s: the recording has ended", options_.end_after_s));
  client_->say(program::FeedEnd{});
}

void Robot::hear() {
  if (!client_) return;
  const auto all = client_->hear();
  if (!all) {
    options_.say(Level::debug, all.error().message);
    return client_.reset();
  }
  for (const program::FromRobot& message : *all) std::visit([this](const auto& what) { note(what); }, message);
}

void Robot::note(const program::FeedAnswer& answer) {
  last_odometry_s_ = Clock::steady_s();
  was_fed_ = true;
  ended_ = said_no_odometry_ = false;
  in_map_ = answer.in_map;
}

void Robot::each_second() {
  const double now_s = Clock::steady_s();
  if (now_s - second_s_ < kEachSecond_s) return;
  second_s_ = now_s;
  if (client_ && topics_.is_path_wanted())
    client_->say(intake::RawMessage{"corrected_path", program::RosClient::kPathType, "cdr", ""});
  look_for_odometry();
  for (const auto* reader : {&odometry_, &points_, &fixes_})
    if (*reader && (*reader)->writers() > 1)
      complain((*reader)->topic(), ErrorCode::invalid,
               fmt::format("{} publishers, expected one", (*reader)->writers()));
  publish_diagnostics();
}

void Robot::look_for_odometry() {
  if (said_no_odometry_ || ended_ || !tf_ || Clock::steady_s() - last_odometry_s_ < options_.patience_s) return;
  said_no_odometry_ = true;
  const bool is_own = own_tf_ && own_tf_->writers() > 0;
  const Reader& reader = !by_tf() ? *odometry_ : is_own ? *own_tf_ : *tf_;
  const bool is_either = by_tf() && own_tf_ && !is_own;
  const std::string topic = is_either ? fmt::format("{} or {}", tf_->topic(), own_tf_->topic()) : reader.topic();
  const std::string otherwise = by_tf() ? fmt::format("there is no {} among its frames", options_.odometry_frames)
                                : odometry_came_ ? "its publisher says nothing that can be taken"
                                                 : "its publisher has sent nothing yet";
  options_.say(Level::warning, fmt::format("no odometry on {} for {} s: {}", topic, options_.patience_s,
                                           why_silent(*participant_, reader, otherwise)));
}

void Robot::publish_diagnostics() {
  if (client_) client_->use_intake([&](const intake::SensorIntake& intake) { counts_ = intake.odometry().counts(); });
  const bags::RosDiagnostic out = diagnosis({.name = options_.name_space + ": live feed",
                                             .is_connected = client_ != nullptr,
                                             .counts = counts_,
                                             .in_map = in_map_,
                                             .status = situation_.status,
                                             .alerts = situation_.alerts,
                                             .troubles = complaints_.take()});
  topics_.publish(out, Timestamp{static_cast<std::int64_t>(program::wall_clock_ns())});
}

}  // namespace

Result<std::unique_ptr<RosRobot>> RosRobot::open(RosRobotOptions options, std::shared_ptr<Participant> participant) {
  auto robot = std::make_unique<Robot>(std::move(options), std::move(participant));
  if (Status ok = robot->open(); !ok) return tl::unexpected(ok.error());
  return robot;
}

}  // namespace tutti::ros
