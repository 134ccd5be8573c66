// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "tutti/program/feed/feed_frames.hpp"
#include "tutti/v1/feed.pb.h"

/// Values of the feed as its messages (feed.proto).
namespace tutti::program::internal {

void write(const Pose3& T, v1::Feed::Pose& out);

inline constexpr std::size_t kHeaderBytes = 4;
/// As bytes on the socket: so many of the length, little endian, and the message. At most kMaxFeedBytes.
std::string framed(const v1::Feed& message);

}  // namespace tutti::program::internal
