// SPDX-License-Identifier: BSD-3-Clause
#pragma once

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

#include "tutti/program/feed/feed_target.hpp"
#include "tutti/program/feed/localiser.hpp"

namespace tutti::program {

struct FeedEnded {};
/// What is fed to a robot; sensors: what is fed from here on.
using FeedInput = std::variant<node::OdometrySample, Scan, FeedEnded, FedImages, std::shared_ptr<const FeedSensors>>;

/// Zero where it has none.
Timestamp stamp_of(const FeedInput& input);

/// Between a feed and its robot, which are a thread each: samples are answered at once, by odometry from what the robot
/// said last, and wait in their order for the robot, which merges, packs, stores and updates behind. No call waits for
/// the other side but take(). What waits is bounded: first scans are refused, then odometry is taken together, which
/// an alert says; the way is never lost. What the robot has taken is kept until it is stored, and comes again to a
/// robot that had to be made again.
/// Images wait for odometry and the IMU to reach their stamp, and come to the robot when it knows where it was then;
/// IMU samples wait for the images that they belong to, the newest of them.
class FeedFront final : public FeedTarget {
 public:
  struct Limits {
    std::size_t inputs = 8'000;            ///< That wait: 40 s at 200 Hz. Of half as many on no scan is taken.
    std::size_t scan_bytes = 128U << 20U;  ///< In scans that wait.
    std::size_t image_bytes = 64U << 20U;  ///< In images: 9 s of EuRoC's stereo pairs at 20 Hz.
    std::size_t imu = 30'000;              ///< Samples that are kept: half a minute at 1 kHz.
    int tries = 3;                         ///< Of an input with which the robot goes; then it is left out.
  };
  /// `robot`: as it stands, all of it stored.
  FeedFront(FeedState robot, const Limits& limits);

  // For the feed.
  Status add_odometry(const node::OdometrySample& sample) override;
  Status add_scan(const Scan& scan) override;
  void set_sensors(const FeedSensors& sensors) override;
  Status add_images(FedImages images) override;
  Status add_imu(const std::vector<ImuSample>& samples) override;
  Status finish() override;
  [[nodiscard]] FeedState state() const override;
  std::vector<FeedRefusal> take_refusals() override;
  void want_ways() override;
  std::vector<FeedWay> take_ways() override;

  // For the robot.
  /// The next input, waiting for it so many wall seconds; nothing: there is none. Until note_heard() the robot has not
  /// got through it.
  std::optional<FeedInput> take(double wall_s);
  void note_heard();
  /// Of what is fed; never null.
  [[nodiscard]] std::shared_ptr<const FeedSensors> sensors() const;
  /// imu_over() of what is kept.
  [[nodiscard]] std::vector<ImuSample> imu(Timestamp from, Timestamp until) const;
  /// Everything was taken.
  [[nodiscard]] bool is_drained() const;
  /// What was taken is stored.
  void note_stored();
  /// The robot was made again from its store, which ends at this sample: what it took after that comes again.
  void begin_again(const std::optional<Timestamp>& stored);
  /// What the robot refused that was taken from the client.
  void refuse(Timestamp stamp, std::string why);
  /// What the robot knows now.
  void publish(FeedState robot);
  [[nodiscard]] bool wants_ways() const;
  /// Kept are the newest kWays that were not taken.
  void say(FeedWay way);
  static constexpr std::size_t kWays = 4;
  /// Told to clients as an alert, until it is empty.
  void say_trouble(std::string trouble);
  /// Nothing is taken from clients any more: the program ends.
  void close();
  /// The client said so, it is stored, and nothing was fed since.
  [[nodiscard]] bool has_ended() const;

  struct Load {
    std::size_t waiting = 0;                             ///< Inputs that the robot has not taken yet.
    std::size_t scans_left_out = 0, samples_joined = 0;  ///< Since it had caught up last.
    std::size_t images_left_out = 0;                     ///< The same, moments.
    friend bool operator==(const Load&, const Load&) = default;
  };
  [[nodiscard]] Load load() const;
  /// Since it was made: moments of images, and IMU samples.
  struct Figures {
    std::uint64_t images = 0, images_left_out = 0, imu = 0, imu_left_out = 0;
    std::size_t image_bytes = 0;  ///< That wait now.
  };
  [[nodiscard]] Figures figures() const;
  static constexpr double kAhead_s = 1.0;        ///< Images and IMU are at most so far ahead of odometry.
  static constexpr double kImuPatience_s = 0.2;  ///< So long images wait for the IMU behind odometry.

 private:
  [[nodiscard]] std::size_t waiting() const { return inputs_.size() - taken_; }
  void push(FeedInput input);
  void note_behind(Timestamp stamp);
  [[nodiscard]] bool is_ahead(Timestamp stamp) const;
  Status may_wait(const FedImages& images) const;
  void release_images(bool all = false);
  void thin();
  void leave_out_what_fails();

  /// An input with which the robot has gone, and how often.
  struct Failed {
    std::size_t kind = 0;  ///< FeedInput::index()
    Timestamp stamp;
    int times = 0;
  };

  const Limits limits_;
  mutable std::mutex mutex_;
  std::condition_variable fed_;
  FeedState robot_;  // as it was published
  Localiser localiser_;
  std::deque<FeedInput> inputs_;
  std::size_t taken_ = 0;       // of them, from the front
  std::size_t scan_bytes_ = 0;  // in them
  std::shared_ptr<const FeedSensors> sensors_ = std::make_shared<const FeedSensors>();
  std::deque<FedImages> images_;  // that wait for odometry or the IMU
  std::size_t image_bytes_ = 0;   // in them and in inputs_
  std::optional<Timestamp> newest_images_;
  std::deque<ImuSample> imu_;
  std::uint64_t images_taken_ = 0, images_refused_ = 0, imu_taken_ = 0, imu_refused_ = 0;
  bool in_hand_ = false;  // the last one taken, and not got through
  Failed failed_;
  std::optional<Timestamp> stored_;
  std::vector<FeedRefusal> refusals_;
  std::size_t scans_left_out_ = 0, samples_joined_ = 0, images_left_out_ = 0;  // since all was taken last
  double finest_s_ = 0.0;                                                      // samples that are closer are one
  std::set<Timestamp> jumps_;  // samples before which odometry has jumped
  Timestamp behind_since_;
  bool wants_ways_ = false;
  std::deque<FeedWay> ways_;
  std::string trouble_;
  Timestamp trouble_since_;
  bool ended_ = false, closed_ = false;
};

}  // namespace tutti::program
