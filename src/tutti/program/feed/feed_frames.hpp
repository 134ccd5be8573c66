// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "tutti/base/result.hpp"
#include "tutti/node/journal.hpp"
#include "tutti/program/feed/feed_target.hpp"
#include "tutti/program/feed/smooth_map.hpp"

/// The frames of a live feed (proto/tutti/v1/feed.proto): 4 bytes of length, little endian, and a protobuf message.
namespace tutti::program {

inline constexpr std::uint32_t kFeedVersion = 1;
inline constexpr std::size_t kMaxFeedBytes = 16U << 20U;  ///< Of a message: a scan of a million points.

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
};
struct FeedEnd {};
/// Well formed, but its values are none that a robot could take.
struct BadSample {
  Timestamp stamp;
  std::string why;
};
/// What a client may say.
using FromClient = std::variant<FeedHello, node::OdometrySample, Scan, FeedEnd, BadSample>;
/// Of any bytes.
Result<FromClient> decode_from_client(std::string_view payload);

/// What it is told, as whole frames.
std::string welcome_frame(const FeedState& state, const Pose3& T_map_odom);
std::string correction_frame(const FeedState& state, const SmoothMap::Answer& answer, std::uint64_t dropped);
/// `why`: empty for the map's newest correction.
std::string jump_frame(const FeedState& state, const SmoothMap::Jump& jump, const std::string& why = {});
std::string situation_frame(const FeedState& state);
std::string refused_frame(Timestamp stamp, const std::string& why);
std::string ended_frame();
std::string closed_frame(const std::string& why);

}  // namespace tutti::program
