// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "tutti/node/odometry_gate.hpp"
#include "tutti/program/feed/carried_pose.hpp"
#include "tutti/program/feed/feed_target.hpp"

namespace tutti::program {

struct FeedEnded {};
/// The clock of odometry began anew: later inputs are of a new session.
struct FeedAnew {
  std::string why;
};
/// One entry of the robot's queue. Sensors mean that later inputs are of these sensors.
using FeedInput = std::variant<Input, FeedEnded, std::shared_ptr<const Sensors>, FeedAnew>;

/// The input's stamp; zero for what has none.
Timestamp stamp_of(const FeedInput& input);

/// Stands between a live feed and its robot, each of which runs in a thread of its own; every call may be made from
/// either. It answers samples at once, by carrying the robot's last correction on with odometry, and queues them in
/// order for the robot, which merges, packs, stores and updates behind. Only take() blocks.
///
/// The queue is bounded. When the robot falls behind, scans are refused first; then neighbouring odometry samples are
/// joined, so that the trajectory becomes coarser but stays whole. An alert reports either. Inputs that the robot has
/// taken are kept until they are stored, and are handed out again when the robot had to be made anew from its store.
///
/// Images wait until odometry and the IMU have reached their stamp, so that the robot knows where it was then; of IMU
/// samples the newest are kept for the images that need them.
class FeedFront final : public FeedTarget {
 public:
  struct Limits {
    std::size_t inputs = 8'000;  ///< Odometry is joined beyond this many queued inputs (40 s at 200 Hz); scans and
                                 ///< images are refused from half of it on.
    std::size_t scan_bytes = 128U << 20U;  ///< Bytes of queued scans.
    std::size_t image_bytes = 64U << 20U;  ///< Bytes of queued images: 9 s of EuRoC's stereo pairs at 20 Hz.
    std::size_t imu = 30'000;              ///< IMU samples that are kept: half a minute at 1 kHz.
    int tries = 3;                         ///< An input that makes the robot's program fail this often is left out.
  };
  /// `robot` is the robot's state now, all of which is stored.
  FeedFront(FeedState robot, const Limits& limits);

  // For the feed.
  Status add(Input input) override;
  void set_sensors(const Sensors& sensors) override;
  Status finish() override;
  [[nodiscard]] FeedState state() const override;
  std::vector<FeedRefusal> take_refusals() override;
  void want_trajectory() override;
  std::vector<FeedTrajectory> take_trajectories() override;

  // For the robot.
  /// The next input, or null when none came within `wall_s` of wall time. Until note_heard() it counts as being worked
  /// on, so that an input that makes the robot fail can be found.
  std::shared_ptr<const FeedInput> take(double wall_s);
  void note_heard();
  /// The sensors that inputs from now on come from; never null.
  [[nodiscard]] std::shared_ptr<const Sensors> sensors() const;
  /// imu_over() the IMU samples that are kept.
  [[nodiscard]] std::vector<ImuSample> imu(Timestamp from, Timestamp until) const;
  /// The robot has taken every input.
  [[nodiscard]] bool is_drained() const;
  /// All inputs that the robot took are stored, and need not be kept.
  void note_stored();
  /// The robot was made again from its store, whose newest sample is `stored`: inputs taken after that are handed out
  /// again.
  void begin_again(const std::optional<Timestamp>& stored);
  /// Reports to the client that an input already accepted was refused by the robot.
  void refuse(Timestamp stamp, std::string why);
  /// Sets what the robot knows now; ignored while a robot made again has not caught up with what it knew before.
  void publish(FeedState robot);
  [[nodiscard]] bool wants_trajectory() const;
  /// Queues a trajectory for the client; only the newest kTrajectories wait.
  void say(FeedTrajectory trajectory);
  static constexpr std::size_t kTrajectories = 4;
  /// The last report of the robot's body, unless that is older than kHealthLasts.
  [[nodiscard]] Health health() const;
  static constexpr std::chrono::seconds kHealthLasts{60};
  /// Sets the robot's own status, which clients are shown.
  void say_status(const NodeStatus& status);
  /// Shows `trouble` to clients as an alert until it is called with an empty text.
  void say_trouble(std::string trouble);
  /// The trouble with the odometry that comes, for people; empty when there is none.
  [[nodiscard]] std::string odometry_trouble() const;
  /// From now on everything from clients is refused, because the program ends.
  void close();
  /// The client has ended the recording, its end is stored, and nothing was fed since.
  [[nodiscard]] bool has_ended() const;

  struct Load {
    std::size_t waiting = 0;                             ///< Inputs that the robot has not taken yet.
    std::size_t scans_left_out = 0, samples_joined = 0;  ///< Since the robot had last caught up.
    std::size_t images_left_out = 0;                     ///< Sets of images, since the robot had last caught up.
    friend bool operator==(const Load&, const Load&) = default;
  };
  [[nodiscard]] Load load() const;
  /// More is waiting, or not stored yet, than should be fed where nothing may be left out: less than half of the
  /// limits.
  [[nodiscard]] bool is_filling() const;
  /// Totals since the front was made; images are counted as sets of one time.
  struct Figures {
    std::uint64_t images = 0, images_left_out = 0, imu = 0, imu_left_out = 0, fixes = 0, fixes_left_out = 0;
    std::size_t image_bytes = 0;  ///< Bytes of the images that wait now.
  };
  [[nodiscard]] Figures figures() const;

 private:
  [[nodiscard]] std::size_t waiting() const { return inputs_.size() - taken_; }
  [[nodiscard]] std::size_t due() const { return waiting() - held_; }
  [[nodiscard]] bool is_stored() const { return inputs_.size() == held_; }  // all that was due
  Status hear(OdometrySample& sample);
  Status hear(Scan& scan) { return hear_sensor(std::move(scan)); }
  Status hear(EncodedImages& images);
  Status hear(TrackedImages& images);
  Status hear(ImuSamples& samples);
  Status hear(PositionFix& fix) { return hear_sensor(fix); }
  Status hear(RobotRange& range) { return hear_sensor(std::move(range)); }
  Status hear(Health& health);
  Status hear(StartPose& start);
  Status hear_sensor(Input input);
  Status take(const OdometrySample& sample);
  void begin_anew(std::string why);
  using Queued = std::shared_ptr<const FeedInput>;
  void push(FeedInput input) { push_back(std::make_shared<const FeedInput>(std::move(input))); }
  void push_back(Queued input);
  [[nodiscard]] bool is_due(Timestamp images) const;
  void note_behind(Timestamp stamp);
  [[nodiscard]] bool is_ahead(Timestamp stamp, const InputKind& kind) const;
  [[nodiscard]] Status may_wait(const Input& input) const;
  [[nodiscard]] std::size_t most_bytes(const Input& input) const;
  void free_bytes_of(const FeedInput& input);
  void release(bool all = false);
  void thin();
  void leave_out_what_fails();

  /// By Input::index().
  template <class T>
  using OfKinds = std::array<T, kInputKinds.size()>;

  const Limits limits_;
  mutable std::mutex mutex_;
  std::condition_variable fed_;
  FeedState robot_;          // as it was published
  node::OdometryGate gate_;  // before carried_
  CarriedPose carried_;
  std::deque<Queued> inputs_;        // taken ones, then those that are due, then held ones
  std::size_t taken_ = 0;            // of them, how many the robot has taken
  std::size_t held_ = 0;             // of them, how many wait for odometry or the IMU (Needs::odometry_and_imu)
  std::size_t anew_ = 0;             // of them, how many FeedAnew
  OfKinds<std::size_t> bytes_{};     // in them
  OfKinds<std::size_t> left_out_{};  // since all was taken last
  OfKinds<std::optional<Timestamp>> newest_;
  std::shared_ptr<const Sensors> sensors_ = std::make_shared<const Sensors>();
  std::deque<ImuSample> imu_;
  OfKinds<std::uint64_t> heard_{}, refused_{};
  bool in_hand_ = false;  // the last one taken, and not got through
  Queued failed_;         // the input with which the robot's program failed last,
  int failures_ = 0;      // and how often
  std::optional<Timestamp> stored_;
  std::vector<FeedRefusal> refusals_;
  std::size_t samples_joined_ = 0;  // since all was taken last
  double finest_s_ = 0.0;           // samples that are closer are one
  std::set<Timestamp> jumps_;       // samples before which odometry has jumped
  Timestamp behind_since_;
  bool wants_trajectory_ = false;
  std::deque<FeedTrajectory> trajectories_;
  Health health_;
  std::chrono::steady_clock::time_point health_came_;
  decltype(FeedState::status) status_;
  std::string trouble_;
  Timestamp trouble_since_;
  bool ended_ = false, closed_ = false;
};

}  // namespace tutti::program
