// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
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
/// What is fed to a robot.
using FeedInput = std::variant<node::OdometrySample, Scan, FeedEnded>;

/// Between a feed and its robot, which are a thread each: samples are answered at once, by odometry from what the robot
/// said last, and wait in their order for the robot, which merges, packs, stores and updates behind. No call waits for
/// the other side but take(). What waits is bounded: first scans are refused, then odometry is taken together, which
/// an alert says; the way is never lost. What the robot has taken is kept until it is stored, and comes again to a
/// robot that had to be made again.
class FeedFront final : public FeedTarget {
 public:
  struct Limits {
    std::size_t inputs = 8'000;            ///< That wait: 40 s at 200 Hz. Of half as many on no scan is taken.
    std::size_t scan_bytes = 128U << 20U;  ///< In scans that wait.
    int tries = 3;                         ///< Of an input with which the robot goes; then it is left out.
  };
  /// `robot`: as it stands, all of it stored.
  FeedFront(FeedState robot, const Limits& limits);

  // For the feed.
  Status add_odometry(const node::OdometrySample& sample) override;
  Status add_scan(const Scan& scan) override;
  Status finish() override;
  [[nodiscard]] FeedState state() const override;
  std::vector<FeedRefusal> take_refusals() override;

  // For the robot.
  /// The next input, waiting for it so many wall seconds; nothing: there is none. Until note_heard() the robot has not
  /// got through it.
  std::optional<FeedInput> take(double wall_s);
  void note_heard();
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
  /// Told to clients as an alert, until it is empty.
  void say_trouble(std::string trouble);
  /// Nothing is taken from clients any more: the program ends.
  void close();
  /// The client said so, it is stored, and nothing was fed since.
  [[nodiscard]] bool has_ended() const;

  struct Load {
    std::size_t waiting = 0;                             ///< Inputs that the robot has not taken yet.
    std::size_t scans_left_out = 0, samples_joined = 0;  ///< Since it had caught up last.
    friend bool operator==(const Load&, const Load&) = default;
  };
  [[nodiscard]] Load load() const;

 private:
  [[nodiscard]] std::size_t waiting() const { return inputs_.size() - taken_; }
  void push(FeedInput input);
  void note_behind(Timestamp stamp);
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
  bool in_hand_ = false;        // the last one taken, and not got through
  Failed failed_;
  std::optional<Timestamp> stored_;
  std::vector<FeedRefusal> refusals_;
  std::size_t scans_left_out_ = 0, samples_joined_ = 0;  // since all was taken last
  double finest_s_ = 0.0;                                // samples that are closer are one
  std::set<Timestamp> jumps_;                            // samples before which odometry has jumped
  Timestamp behind_since_;
  std::string trouble_;
  Timestamp trouble_since_;
  bool ended_ = false, closed_ = false;
};

}  // namespace tutti::program
