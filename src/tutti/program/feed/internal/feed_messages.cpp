// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/feed/internal/feed_messages.hpp"

#include "tutti/base/check.hpp"

namespace tutti::program::internal {

void write(const Pose3& T, v1::Feed::Pose& out) {
  out.set_x(T.translation.x());
  out.set_y(T.translation.y());
  out.set_z(T.translation.z());
  out.set_qx(T.rotation.x());
  out.set_qy(T.rotation.y());
  out.set_qz(T.rotation.z());
  out.set_qw(T.rotation.w());
}

std::string framed(const v1::Feed& message) {
  const std::string payload = message.SerializeAsString();
  TUTTI_CHECK(payload.size() <= kMaxFeedBytes, "a feed message of {} bytes", payload.size());
  std::string out;
  for (std::size_t i = 0; i < kHeaderBytes; ++i) out += static_cast<char>(payload.size() >> (8 * i) & 0xffU);
  return out + payload;
}

}  // namespace tutti::program::internal
