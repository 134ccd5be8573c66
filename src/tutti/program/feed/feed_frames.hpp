// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/node/journal.hpp"
#include "tutti/program/feed/feed_sensors.hpp"
#include "tutti/program/feed/feed_target.hpp"
#include "tutti/program/feed/smooth_map.hpp"

/// The frames of a live feed (proto/tutti/v1/feed.proto): 4 bytes of length, little endian, and a protobuf message.
namespace tutti::program {

inline constexpr std::uint32_t kFeedVersion = 1;
inline constexpr std::size_t kMaxFeedBytes = 16U << 20U;  ///< Of a message: a scan of a million points.
inline constexpr std::size_t kMaxImuSamples = 10'000;     ///< Of a message: ten seconds at 1 kHz.
/// What clients may say, by its number in the protocol less one.
inline constexpr const char* kFromClient[] = {"hello", "odometry", "scan", "end_of_recording", "images", "imu", "time"};

/// Puts frames together from bytes as they come. Keeps no more than one frame.
class FrameReader {
 public:
  /// Takes from the front of `bytes` what the next frame needs. Nothing: it is not complete, and all bytes are used. An
  /// error: no such frame is read, and no further one can be found.
  Result<std::optional<std::string>> take(std::string_view& bytes);

 private:
  std::string header_, payload_;
};

struct FeedHello {
  std::uint32_t version = 0;
  std::string client;
  bool listens_only = false;
  Result<FeedSensors> sensors = FeedSensors{};  ///< An error: why they cannot be.
  std::optional<std::int64_t> clock_offset_ns = {}, clock_now_ns = {};
  bool wants_way = false;
};
struct FeedEnd {};
struct FeedImu {
  std::vector<ImuSample> samples;  ///< At least one.
};
struct FeedTime {
  std::int64_t clock_now_ns = 0;
};
/// A message of a newer protocol.
struct FeedUnknown {
  std::uint32_t number = 0;
};
/// Well formed, but its values are none that a robot could take.
struct BadSample {
  Timestamp stamp;
  std::string why;
};
/// What a client may say.
using FromClient =
    std::variant<FeedHello, node::OdometrySample, Scan, FeedEnd, FedImages, FeedImu, FeedTime, FeedUnknown, BadSample>;
/// Of any bytes.
Result<FromClient> decode_from_client(std::string_view payload);

/// Text goes out as UTF-8, which protobuf asks for: what is not plain becomes '?'.
std::string plain(std::string text);

/// What it is told, as whole frames. `offset_ns`: FeedClock::offset_ns(), by which stamps are told.
std::string welcome_frame(const FeedState& state, const Pose3& T_map_odom, std::int64_t offset_ns);
std::string correction_frame(const FeedState& state, const SmoothMap::Answer& answer, std::uint64_t dropped,
                             std::int64_t offset_ns);
/// `why`: empty for the map's newest correction.
std::string jump_frame(const FeedState& state, const SmoothMap::Jump& jump, std::int64_t offset_ns,
                       const std::string& why = {});
std::string situation_frame(const FeedState& state, std::int64_t offset_ns);
std::string refused_frame(Timestamp stamp, const std::string& why, std::int64_t offset_ns);
std::string time_answer_frame(std::int64_t client_now_ns, Timestamp robot_now, std::int64_t offset_ns,
                              std::int64_t measured_ns, const std::optional<Timestamp>& stored);
/// Nothing: it is too long for a message.
std::optional<std::string> way_frame(const FeedWay& way, std::int64_t offset_ns);
std::string ended_frame();
std::string closed_frame(const std::string& why);

}  // namespace tutti::program
