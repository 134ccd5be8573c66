// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/lab/feed_player.hpp"

#include <algorithm>
#include <chrono>
#include <deque>
#include <memory>
#include <thread>
#include <utility>

#include "tutti/evaluation/agreement.hpp"
#include "tutti/evaluation/association.hpp"
#include "tutti/formats/image_file.hpp"
#include "tutti/lab/mission_input.hpp"
#include "tutti/lab/update_json.hpp"
#include "tutti/mission/runner.hpp"
#include "tutti/model/pose_at.hpp"
#include "tutti/program/clock.hpp"
#include "tutti/program/feed/feed_client.hpp"

namespace tutti::lab {
namespace {

using program::FeedClient;

constexpr int kWait_ms = 100;
constexpr double kConnects_s = 120.0;
constexpr std::size_t kMostInputs = 2'000, kMostBytes = 24U << 20U;  // of FeedFront::Limits less than half

Sensors sensors_of(const Recording& recording) {
  Sensors out{.scans = recording.scans != nullptr, .cameras = {}, .depth = {}, .imu = {}};
  if (!recording.images) return out;
  out.cameras = recording.images->cameras;
  if (recording.images->load_depth) out.depth = recording.images->depth;
  if (!recording.imu.empty()) out.imu = recording.imu_noise;
  return out;
}

class Player {
 public:
  Player(const FeedPlayerOptions& options, const MissionConfig& config, mission::MissionRecording robot,
         double duration_s)
      : options_(options), config_(config), robot_(std::move(robot)), duration_s_(duration_s) {}
  Status play(const std::atomic<bool>& stop);

 private:
  Status connect(const std::atomic<bool>& stop);
  /// Until `is_it`, or `stop`.
  template <class IsIt>
  Status hear_until(const std::atomic<bool>& stop, const IsIt& is_it);
  Status say_sample(std::size_t i, const std::atomic<bool>& stop);
  Status say_sensors(Timestamp now);
  Status say_images(Timestamp now);
  Status say(const Input& input, Timestamp now);
  void note_stored(const std::optional<Timestamp>& stored);
  Status wait_for_robot(const std::atomic<bool>& stop);
  [[nodiscard]] std::optional<EncodedImages> images(std::size_t instant, Timestamp stamp) const;
  void score(const program::FeedTrajectory& trajectory);

  const FeedPlayerOptions& options_;
  const MissionConfig& config_;
  mission::MissionRecording robot_;
  double duration_s_;
  std::unique_ptr<FeedClient> client_;
  std::unique_ptr<program::EventLog> scores_;
  std::optional<Timestamp> known_;  // what the robot has already
  bool wants_scan_ = false;
  std::deque<std::pair<Timestamp, std::size_t>> said_;  // stamps and bytes of what the robot has not stored yet
  std::size_t said_bytes_ = 0;
  std::size_t imu_ = 0, scan_ = 0, images_ = 0, measured_ = 0;
};

Status Player::connect(const std::atomic<bool>& stop) {
  const double until_s = program::Clock::steady_s() + kConnects_s;
  while (true) {
    auto client = FeedClient::connect(options_.socket, "tutti mission play", sensors_of(robot_.recording),
                                      !options_.scores.empty());
    if (client) {
      client_ = std::move(*client);
      return hear_until(stop, [&](const program::FromRobot& message) {
        const auto* welcome = std::get_if<program::FeedWelcome>(&message);
        if (welcome != nullptr) known_ = welcome->newest;
        return welcome != nullptr;
      });
    }
    if (stop || program::Clock::steady_s() > until_s) return tl::unexpected(client.error());
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

template <class IsIt>
Status Player::hear_until(const std::atomic<bool>& stop, const IsIt& is_it) {
  while (!stop) {
    const auto message = client_->hear(kWait_ms);
    if (!message) return tl::unexpected(message.error());
    if (!*message) continue;
    if (const auto* trajectory = std::get_if<program::FeedTrajectory>(&**message)) score(*trajectory);
    if (const auto* over = std::get_if<program::FeedOver>(&**message))
      return fail(ErrorCode::io, "the robot has ended the connection: {}", over->why);
    if (is_it(**message)) return {};
  }
  return fail(ErrorCode::io, "stopped");
}

Status Player::say(const Input& input, Timestamp now) {
  if (Status ok = client_->say(input); !ok) return ok;
  said_.emplace_back(now, bytes_of(input));
  said_bytes_ += said_.back().second;
  return {};
}

void Player::note_stored(const std::optional<Timestamp>& stored) {
  for (; stored && !said_.empty() && said_.front().first <= *stored; said_.pop_front())
    said_bytes_ -= said_.front().second;
}

/// However fast the mission is played, the robot leaves nothing out because it is behind: as one that replays it is
/// only later.
Status Player::wait_for_robot(const std::atomic<bool>& stop) {
  const auto is_behind = [&] { return said_.size() > kMostInputs || said_bytes_ > kMostBytes; };
  while (is_behind() && !stop) {
    std::this_thread::sleep_for(std::chrono::milliseconds(kWait_ms / 5));
    if (Status ok = client_->say_time(); !ok) return ok;
    const Status heard = hear_until(stop, [&](const program::FromRobot& message) {
      const auto* progress = std::get_if<program::FeedProgress>(&message);
      if (progress != nullptr) note_stored(progress->stored);
      return progress != nullptr;
    });
    if (!heard) return heard;
  }
  return {};
}

/// The sample, and what it was answered.
Status Player::say_sample(std::size_t i, const std::atomic<bool>& stop) {
  const Recording& recording = robot_.recording;
  const auto& [stamp, pose] = recording.odometry[i];
  const Matrix6d covariance = i == 0 ? Matrix6d(Matrix6d::Zero()) : recording.increment_covariance[i - 1];
  if (Status ok = wait_for_robot(stop); !ok) return ok;
  if (Status ok = say(OdometrySample{stamp, pose, covariance}, stamp); !ok) return ok;
  return hear_until(stop, [&](const program::FromRobot& message) {
    if (const auto* answer = std::get_if<program::FeedAnswer>(&message)) {
      wants_scan_ = answer->wants_scan;
      note_stored(answer->stored);
      return answer->stamp == stamp;
    }
    const auto* refused = std::get_if<program::FeedRefusal>(&message);
    return refused != nullptr && refused->stamp == stamp;
  });
}

/// What was seen and felt until then; the IMU as far as it takes to know how the body moved until then.
Status Player::say_sensors(Timestamp now) {
  const Recording& recording = robot_.recording;
  const bool is_known = known_ && now < *known_;
  std::vector<ImuSample> samples;
  while (imu_ < recording.imu.size() && (imu_ == 0 || recording.imu[imu_ - 1].stamp < now))
    samples.push_back(recording.imu[imu_++]);
  if (recording.images && !samples.empty() && !is_known)
    if (Status ok = client_->say(samples); !ok) return ok;
  for (; measured_ < recording.measured.size(); ++measured_) {
    const Input& sample = recording.measured[measured_];
    if (stamp_of(sample) > now) break;
    if (is_known || stamp_of(sample) < recording.odometry.front().stamp) continue;  // as RobotActor does
    if (Status ok = say(sample, now); !ok) return ok;
  }
  const auto is_due = [&] { return stamp_at(recording, recording.scan_stamps, scan_).value_or(kLastTimestamp) <= now; };
  for (; recording.scans && is_due(); ++scan_) {
    if (!wants_scan_ || is_known) continue;
    auto scan = recording.scans->scan(scan_);
    if (!scan) return tl::unexpected(scan.error());
    if (!*scan) continue;
    if (Status ok = say(std::move(**scan), now); !ok) return ok;
  }
  return recording.images && !is_known ? say_images(now) : Status();
}

/// Images that are taken at odometry's samples have odometry's stamps (TrackingSource).
Status Player::say_images(Timestamp now) {
  const ImageStream& stream = *robot_.recording.images;
  const double tolerance_s = config_.tracking.max_stamp_difference_s;
  const bool at_samples = robot_.recording.image_stamps.empty();
  for (; images_ < stream.stamps.size(); ++images_) {
    const Timestamp stamp = stream.stamps[images_];
    if (stamp > (at_samples ? now + tolerance_s : now)) break;
    if (stamp + tolerance_s < robot_.recording.odometry.front().stamp) continue;
    const bool is_of_sample = at_samples && std::abs(stamp - now) <= tolerance_s;
    auto seen = images(images_, is_of_sample ? now : stamp);
    if (!seen) continue;
    if (Status ok = say(std::move(*seen), now); !ok) return ok;
  }
  return {};
}

/// Without those that cannot be read: the robot finds out that there are none.
std::optional<EncodedImages> Player::images(std::size_t instant, Timestamp stamp) const {
  const ImageStream& stream = *robot_.recording.images;
  EncodedImages out{stamp, {}, {}};
  for (std::uint32_t camera = 0; camera < stream.cameras.size(); ++camera) {
    const auto image = stream.load(instant, camera);
    if (!image || image->empty()) continue;
    const CameraModel& model = stream.cameras[camera].model;
    if (image->width_px != model.width_px || image->height_px != model.height_px) continue;
    out.images.push_back({camera, true, std::string(image->grey.begin(), image->grey.end())});
  }
  if (out.images.empty() || out.images.front().camera != 0) return std::nullopt;
  if (stream.load_depth)
    if (const auto depth = stream.load_depth(instant); depth && !depth->empty())
      out.depth = EncodedImage{0, false, formats::encode_depth(*depth)};
  return out;
}

/// As RobotActor does: how far every estimate is from the reference at the map's nodes.
void Player::score(const program::FeedTrajectory& trajectory) {
  if (!scores_) return;
  const Recording& recording = robot_.recording;
  Trajectory truth, odometry;
  if (robot_.score_against_reference)
    for (const auto& pair : evaluation::associate(trajectory.map, recording.reference, config_.association))
      truth.push_back({pair.stamp, pair.reference});
  for (const StampedPose& keyframe : trajectory.corrected)
    if (const auto pose = pose_at(recording.odometry, keyframe.stamp)) odometry.push_back({keyframe.stamp, *pose});
  const auto rmse = [&](const Trajectory& estimate) -> std::optional<double> {
    const auto error = evaluation::agreement(estimate, truth);
    return error ? std::optional(error->rmse_m) : std::nullopt;
  };
  mission::UpdateRecord update{
      .revision = trajectory.map_age.second, .onboard_rmse_m = rmse(odometry), .server_rmse_m = rmse(trajectory.map)};
  update.answers.push_back({config_.agent.policy.name, trajectory.constraints, rmse(trajectory.corrected)});
  scores_->write(to_json(update));
}

Status Player::play(const std::atomic<bool>& stop) {
  if (!options_.scores.empty()) {
    std::error_code error;
    std::filesystem::create_directories(options_.scores, error);
    auto log = program::EventLog::open(options_.scores, options_.robot, program::Level::error);
    if (!log) return tl::unexpected(log.error());
    scores_ = std::move(*log);
  }
  if (Status ok = connect(stop); !ok) return ok;
  const Trajectory& odometry = robot_.recording.odometry;
  const auto due_s = [&](std::size_t i) { return robot_.start_s + (odometry[i].stamp - odometry.front().stamp); };
  std::optional<program::Clock> clock;
  for (std::size_t i = 0; i < odometry.size() && due_s(i) <= duration_s_; ++i) {
    const bool is_known = known_ && odometry[i].stamp <= *known_;
    // It goes on from where the robot stood, as a recording that is replayed.
    if (!clock && !is_known) clock.emplace(options_.rate, i == 0 ? 0.0 : due_s(i));
    while (!is_known && !stop) {
      const double wait_s = clock->wall_s_until(Timestamp{} + due_s(i));
      if (wait_s <= 0.0) break;
      std::this_thread::sleep_for(std::chrono::duration<double>(std::min(wait_s, 1e-3 * kWait_ms)));
    }
    if (stop) return {};
    if (!is_known)
      if (Status ok = say_sample(i, stop); !ok) return ok;
    if (Status ok = say_sensors(odometry[i].stamp); !ok) return ok;
  }
  if (Status ok = client_->say_end(); !ok) return ok;
  const bool stays = scores_ != nullptr;
  const Status heard = hear_until(stop, [&](const program::FromRobot& message) {
    return !stays && std::holds_alternative<program::FeedEnd>(message);
  });
  if (!stop) return heard;
  for (auto message = client_->hear(kWait_ms); message && *message;
       message = client_->hear(kWait_ms))  // the last map's
    if (const auto* trajectory = std::get_if<program::FeedTrajectory>(&**message)) score(*trajectory);
  return {};
}

}  // namespace

Status play_feed(const FeedPlayerOptions& options, const std::atomic<bool>& stop) {
  const auto config = load(options.mission);
  if (!config) return tl::unexpected(config.error());
  const auto number = program::number_of(options.robot, robot_names(*config), false);
  if (!number) return tl::unexpected(number.error());
  auto input = load_input(*config, options.mission.data, options.mission.seed);
  if (!input) return tl::unexpected(input.error());
  const double duration_s = mission::duration_of(*config, input->robots);
  mission::MissionRecording robot = std::move(input->robots.at(number->value));
  if (robot.recording.visual && !robot.recording.images)
    return fail(
        ErrorCode::unsupported,
        "robot {}: its images are submaps of a tracker or none that can be used, which no driver feeds: tutti run "
        "replays them",
        options.robot);
  return Player(options, *config, std::move(robot), duration_s).play(stop);
}

}  // namespace tutti::lab
