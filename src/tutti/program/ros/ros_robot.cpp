// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/ros/ros_robot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <optional>
#include <thread>
#include <utility>

#include "tutti/bags/ros_definitions.hpp"
#include "tutti/intake/sensor_intake.hpp"
#include "tutti/program/clock.hpp"
#include "tutti/program/feed/ros_answers.hpp"
#include "tutti/program/ros/complaints.hpp"
#include "tutti/program/ros/robot_topics.hpp"
#include "tutti/program/ros/ros_diagnosis.hpp"
#include "tutti/program/ros/ros_images.hpp"
#include "tutti/program/ros/unstored.hpp"

namespace tutti::ros {
namespace {

using program::Clock, program::FeedClient, program::Level;

constexpr const char *kOdometryType = "nav_msgs/msg/Odometry", *kFixType = "sensor_msgs/msg/NavSatFix",
                     *kBatteryType = "sensor_msgs/msg/BatteryState";
constexpr double kWait_s = 0.02;
constexpr double kAnswers_s = 2.0;  // more than the robot takes for any
constexpr double kConnectsAgain_s = 0.1;
constexpr double kPath_s = 1.0, kDiagnostics_s = 1.0;
constexpr double kScansFollow_s = 1.0;  // where nothing may be lost

Qos in_qos(bool lossless, int depth) { return {.reliable = lossless, .latched = false, .depth = lossless ? 0 : depth}; }

class Robot final : public RosRobot {
 public:
  Robot(RosRobotOptions options, std::shared_ptr<Participant> participant)
      : options_(std::move(options)),
        participant_(std::move(participant)),
        intake_(options_.intake),
        complaints_(options_.say),
        topics_(options_.name_space, participant_, complaints_) {}
  ~Robot() override {
    thread_.request_stop();
    if (thread_.joinable()) thread_.join();
  }
  Robot(const Robot&) = delete;
  Robot& operator=(const Robot&) = delete;

  Status open();

 private:
  [[nodiscard]] bool by_tf() const { return !options_.intake.odometry_frames.empty(); }
  Status subscribe();
  Status subscribe_points();
  void run(const std::stop_token& stop);
  void turn();
  bool connect();
  void take_messages();
  void feed();
  void say_sample(const node::OdometrySample& sample);
  void say_sensors() { say_fixes(), say_images(), say_scans(); }
  void say_fixes();
  Status say_battery(std::string_view cdr);
  void say_scans();
  void say_images();
  [[nodiscard]] intake::FeedSensors sensors() const;
  void hear(int timeout_ms, const std::function<bool(const program::FromRobot&)>& until);
  void note(const program::FromRobot& said);
  void each_second();
  void look_for_odometry();
  void publish_diagnostics();
  void complain(const std::string& what, const Status& status) { complaints_.add(what, status); }
  bool waits_for_robot();

  RosRobotOptions options_;
  std::shared_ptr<Participant> participant_;
  intake::RosIntake intake_;
  std::unique_ptr<Reader> odometry_, points_, fixes_, battery_, tf_, tf_static_, own_tf_, own_tf_static_;
  std::unique_ptr<FeedClient> client_;
  std::optional<program::RosAnswers> answers_;
  std::optional<program::FeedWay> way_;  // heard before there was any odometry
  program::FeedSituation situation_;
  Unstored unstored_;
  bool wants_scan_ = false, ended_ = false;
  double last_odometry_s_ = 0.0, last_message_s_ = 0.0, path_s_ = 0.0, second_s_ = 0.0;
  bool said_no_odometry_ = false;
  Complaints complaints_;
  RobotTopics topics_;
  std::unique_ptr<RosImages> images_;  // null: none are wanted
  intake::FeedSensors sensors_;        // that the robot was told of
  std::optional<Timestamp> fed_;       // the newest odometry
  std::jthread thread_;
};

Status Robot::open() {
  if (Status ok = topics_.open(); !ok) return ok;
  for (const std::string& topic : {by_tf() ? "/tf" : options_.odometry, options_.points, options_.fixes})
    if (const auto name = resolve(topic.empty() ? "none" : topic, options_.name_space); !name)
      return tl::unexpected(name.error());
  if (options_.images) {
    if (Status ok = resolve(*options_.images, options_.name_space); !ok) return ok;
    images_ = std::make_unique<RosImages>(
        RosImages::Options{*options_.images, options_.lossless, options_.patience_s, options_.say}, participant_,
        intake_, complaints_);
  }
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  return {};
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
  constexpr int kOdometryDepth = 1000, kFixesDepth = 100;  // how long this thread may be held up
  const Qos tf = by_tf() && options_.lossless ? in_qos(true, 0) : kTfQos;
  if (Status ok = make(tf_static_, "/tf_static", kTfType, kStaticTfQos); !ok) return ok;
  if (Status ok = make(tf_, "/tf", kTfType, tf); !ok) return ok;
  if (resolve("tf", options_.name_space).value() != "/tf") {
    if (Status ok = make(own_tf_static_, "tf_static", kTfType, kStaticTfQos); !ok) return ok;
    if (Status ok = make(own_tf_, "tf", kTfType, tf); !ok) return ok;
  }
  if (!by_tf())
    if (Status ok = make(odometry_, options_.odometry, kOdometryType, in_qos(options_.lossless, kOdometryDepth)); !ok)
      return ok;
  if (Status ok = subscribe_points(); !ok) return ok;
  if (Status ok = make(battery_, options_.battery, kBatteryType, in_qos(false, 1)); !ok) return ok;
  return make(fixes_, options_.fixes, kFixType, in_qos(options_.lossless, kFixesDepth));
}

/// A reader hears messages of one type only, and scans come in several: while nobody publishes what this one hears, it
/// gives way to one of the type that somebody does.
Status Robot::subscribe_points() {
  constexpr int kDepth = 10;  // how long this thread may be held up
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

void Robot::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) try {
      turn();
    } catch (const std::exception& error) {
      options_.say(Level::error, fmt::format("the part that speaks ROS has thrown, which is a defect of it; it begins "
                                             "anew: {}",
                                             error.what()));
      client_.reset();
      std::this_thread::sleep_for(std::chrono::duration<double>(kConnectsAgain_s));
    }
}

void Robot::turn() {
  if (!client_ && !connect()) return std::this_thread::sleep_for(std::chrono::duration<double>(kConnectsAgain_s));
  if (waits_for_robot()) return;
  participant_->wait(kWait_s);
  if (const Status ok = subscribe_points(); !ok) complain(options_.points, ok);
  take_messages();
  if (images_ && client_ && sensors() != sensors_) client_.reset();  // a robot is told of cameras when it is greeted
  if (!client_ && !connect()) return;
  feed();
  if (client_) hear(0, [](const program::FromRobot&) { return false; });
  each_second();
}

intake::FeedSensors Robot::sensors() const {
  intake::FeedSensors out{.scans = !options_.points.empty(), .cameras = {}, .depth = {}, .imu = {}};
  if (images_) images_->describe(out);
  return out;
}

bool Robot::connect() {
  sensors_ = sensors();
  auto client = FeedClient::connect(options_.socket, options_.who, sensors_, true);
  if (!client) return false;
  client_ = std::move(*client);
  bool is_welcome = false;
  hear(static_cast<int>(1e3 * kAnswers_s), [&](const program::FromRobot& said) {
    const auto* welcome = std::get_if<program::FeedWelcome>(&said);
    if (welcome == nullptr) return false;
    intake_.begin_behind(welcome->newest);
    return is_welcome = true;
  });
  if (!is_welcome) client_.reset();
  if (is_welcome && !tf_) {
    last_odometry_s_ = Clock::steady_s();
    if (const Status ok = subscribe(); !ok) options_.say(Level::error, ok.error().message);
  }
  return is_welcome;
}

void Robot::take_messages() {
  const auto take = [&](const std::unique_ptr<Reader>& reader, const auto& add) {
    if (!reader) return;
    reader->take([&](const Message& message) {
      last_message_s_ = Clock::steady_s();
      complain(reader->topic(), add(message.cdr));
    });
  };
  take(tf_static_, [&](std::string_view cdr) { return intake_.add_tf(cdr, true); });
  take(tf_, [&](std::string_view cdr) { return intake_.add_tf(cdr, false); });
  take(own_tf_static_, [&](std::string_view cdr) { return intake_.add_tf(cdr, true, intake::RosIntake::TfOf::robot); });
  take(own_tf_, [&](std::string_view cdr) {
    if (topics_.open_own_tf())
      options_.say(Level::info, fmt::format("transforms come on {}: map -> odom is published there", own_tf_->topic()));
    return intake_.add_tf(cdr, false, intake::RosIntake::TfOf::robot);
  });
  take(odometry_, [&](std::string_view cdr) { return intake_.add_odometry(cdr); });
  take(points_, [&](std::string_view cdr) { return intake_.add_points(cdr, points_->type()); });
  take(fixes_, [&](std::string_view cdr) { return intake_.add_fix(cdr); });
  take(battery_, [&](std::string_view cdr) { return say_battery(cdr); });
  if (images_) images_->take();
}

void Robot::feed() {
  const bool is_quiet = Clock::steady_s() - last_message_s_ > kScansFollow_s;
  const bool waits_for_scans = options_.lossless && points_ && !is_quiet;
  while (client_ && !(options_.lossless && unstored_.is_much())) {
    if (images_ && options_.lossless && !is_quiet && images_->holds_odometry()) break;
    const auto sample = intake_.next_odometry(waits_for_scans);
    if (!sample) break;
    last_odometry_s_ = Clock::steady_s();
    ended_ = said_no_odometry_ = false;
    say_sample(*sample);
  }
  say_sensors();
  const bool has_ended =
      options_.end_after_s > 0.0 && answers_ && !ended_ && Clock::steady_s() - last_odometry_s_ > options_.end_after_s;
  if (!has_ended || !client_) return;
  ended_ = true;
  options_.say(Level::info, fmt::format("no odometry for {} s: the recording has ended", options_.end_after_s));
  if (!client_->say_end()) client_.reset();
}

/// The sample, and what it was answered.
void Robot::say_sample(const node::OdometrySample& sample) {
  if (!answers_) {
    answers_.emplace(intake_.frames()->odom, options_.map_frame, options_.tolerance_s);
    if (way_) answers_->hear(*way_);
    answers_->hear(situation_.team_mates);
    options_.say(Level::info, fmt::format("odometry comes: {} -> {}; publishes {} -> {}", intake_.frames()->odom,
                                          intake_.frames()->body, answers_->map_frame(), intake_.frames()->odom));
  }
  if (!client_->say(sample)) return client_.reset();
  fed_ = sample.stamp;
  unstored_.add(sample.stamp, 0);
  hear(static_cast<int>(1e3 * kAnswers_s), [&](const program::FromRobot& said) {
    const auto* answer = std::get_if<program::FeedAnswer>(&said);
    const auto* refused = std::get_if<program::FeedRefusal>(&said);
    if (answer == nullptr || answer->stamp != sample.stamp) return refused != nullptr && refused->stamp == sample.stamp;
    wants_scan_ = answer->wants_scan;
    answers_->hear(*answer, sample.T_odom_body);
    topics_.publish_pose(*answers_);
    return true;
  });
  say_sensors();
}

Status Robot::say_battery(std::string_view cdr) {
  const auto health = intake::read_battery(cdr);
  if (!health) return tl::unexpected(health.error());
  if (client_ && !client_->say(*health)) client_.reset();
  return {};
}

void Robot::say_fixes() {
  while (client_) {
    const auto fix = intake_.next_fix();
    if (!fix) return;
    if (const std::string note = intake_.take_note(); !note.empty()) options_.say(Level::info, note);
    if (!client_->say(*fix)) client_.reset();
  }
}

void Robot::say_images() {
  if (!images_ || !client_ || !fed_) return;
  if (!images_->feed(*client_, sensors_, *fed_, unstored_)) client_.reset();
}

/// Those of whose time odometry is there; they may come before or after it.
void Robot::say_scans() {
  while (client_) {
    const auto scan = intake_.next_scan(wants_scan_);
    if (!scan) {
      complain(points_->topic(), tl::unexpected(scan.error()));
      continue;
    }
    if (const std::string note = intake_.take_note(); !note.empty()) options_.say(Level::info, note);
    if (!*scan) return;
    unstored_.add((*scan)->stamp, (*scan)->cloud->points.size() * sizeof(Eigen::Vector3f));
    if (const Status ok = client_->say(**scan); !ok) {
      complain(points_->topic(), ok);
      if (ok.error().code == ErrorCode::io) client_.reset();
    }
  }
}

void Robot::hear(int timeout_ms, const std::function<bool(const program::FromRobot&)>& until) {
  while (client_) {
    const auto said = client_->hear(timeout_ms);
    if (!said) {
      options_.say(Level::debug, said.error().message);
      return client_.reset();
    }
    if (!*said) return;
    note(**said);
    if (until(**said)) return;
  }
}

void Robot::note(const program::FromRobot& said) {
  if (const auto* answer = std::get_if<program::FeedAnswer>(&said)) unstored_.drop(answer->stored);
  if (const auto* progress = std::get_if<program::FeedProgress>(&said)) unstored_.drop(progress->stored);
  if (const auto* refused = std::get_if<program::FeedRefusal>(&said))
    complain("the robot refuses", fail(ErrorCode::invalid, "{}", refused->why));
  if (const auto* jump = std::get_if<program::FeedJump>(&said))
    options_.say(Level::warning, fmt::format("jump by {:.2f} m: {}", jump->translation_m, jump->why));
  if (const auto* way = std::get_if<program::FeedWay>(&said)) {
    way_ = *way;
    if (answers_) answers_->hear(*way);
    path_s_ = 0.0;
  }
  if (const auto* situation = std::get_if<program::FeedSituation>(&said)) {
    situation_ = *situation;
    if (answers_) answers_->hear(situation->team_mates);
    if (answers_) topics_.publish_team_mates(*answers_);
  }
  if (const auto* over = std::get_if<program::FeedOver>(&said))
    complain("the robot ends the connection", fail(ErrorCode::io, "{}", over->why));
}

void Robot::each_second() {
  const double now_s = Clock::steady_s();
  if (answers_ && now_s - path_s_ > kPath_s && topics_.publish_path(*answers_)) path_s_ = now_s;
  if (now_s - second_s_ < kDiagnostics_s) return;
  second_s_ = now_s;
  look_for_odometry();
  for (const auto* reader : {&odometry_, &points_, &fixes_})
    if (*reader && (*reader)->writers() > 1)
      complain((*reader)->topic(), fail(ErrorCode::invalid, "{} publishers, expected one", (*reader)->writers()));
  publish_diagnostics();
}

void Robot::look_for_odometry() {
  if (said_no_odometry_ || ended_ || !tf_ || Clock::steady_s() - last_odometry_s_ < options_.patience_s) return;
  said_no_odometry_ = true;
  const Reader& reader = by_tf() ? *tf_ : *odometry_;
  const std::string otherwise = by_tf()
                                    ? fmt::format("there is no {} among its frames", options_.intake.odometry_frames)
                                    : "its publisher says nothing that can be taken";
  options_.say(Level::warning, fmt::format("no odometry on {} for {} s: {}", reader.topic(), options_.patience_s,
                                           why_silent(*participant_, reader, otherwise)));
}

void Robot::publish_diagnostics() {
  const bags::RosDiagnostic out = diagnosis({.name = options_.name_space + ": live feed",
                                             .is_connected = client_ != nullptr,
                                             .counts = intake_.counts(),
                                             .in_map = answers_ && answers_->last() && answers_->last()->in_map,
                                             .status = situation_.status,
                                             .alerts = situation_.alerts,
                                             .troubles = complaints_.take()});
  topics_.publish(out, Timestamp{static_cast<std::int64_t>(program::wall_clock_ns())});
}

/// Where nothing may be lost: true while the robot has to catch up with what it was told.
bool Robot::waits_for_robot() {
  if (!options_.lossless || !unstored_.is_much() || !client_) return false;
  std::this_thread::sleep_for(std::chrono::duration<double>(kWait_s));
  if (!client_->say_time()) client_.reset();
  hear(static_cast<int>(1e3 * kAnswers_s),
       [](const program::FromRobot& said) { return std::holds_alternative<program::FeedProgress>(said); });
  return true;
}

}  // namespace

Result<std::unique_ptr<RosRobot>> RosRobot::open(RosRobotOptions options, std::shared_ptr<Participant> participant) {
  auto robot = std::make_unique<Robot>(std::move(options), std::move(participant));
  if (Status ok = robot->open(); !ok) return tl::unexpected(ok.error());
  return robot;
}

}  // namespace tutti::ros
