// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "tutti/program/feed/feed_frames.hpp"
#include "tutti/v1/feed.pb.h"

/// Values of the feed as its messages (feed.proto): of both ends.
namespace tutti::program::internal {

void write(const Pose3& T, v1::Feed::Pose& out);
void write(const Sensors& sensors, v1::Feed::Sensors& out);

/// What a client sends.
v1::Feed message_of(const Input& input);

inline constexpr std::size_t kHeaderBytes = 4;
/// As bytes on the socket: so many of the length, little endian, and the message. At most kMaxFeedBytes.
std::string framed(const v1::Feed& message);

}  // namespace tutti::program::internal
