// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/wire/submap_copy_codec.hpp"

#include <utility>

#include "tutti/v1/messages.pb.h"
#include "tutti/wire/frame.hpp"
#include "tutti/wire/internal/job_message.hpp"
#include "tutti/wire/internal/payload.hpp"
#include "tutti/wire/limits.hpp"

namespace tutti::wire {
namespace {

constexpr std::size_t kRoomForId = 64;

}  // namespace

Status validate(const SubmapRequest& request) {
  if (request.submaps.size() <= kMaxRequested) return {};
  return fail(ErrorCode::invalid, "submap request: {} submaps, at most {} are accepted", request.submaps.size(),
              kMaxRequested);
}

Status validate(const SubmapCopy& copy) {
  if (copy.frame.size() <= kMaxMessageBytes - kRoomForId) return {};
  return fail(ErrorCode::invalid, "submap copy: a frame of {} bytes, expected at most {}", copy.frame.size(),
              kMaxMessageBytes - kRoomForId);
}

std::string encode(const SubmapRequest& request) {
  expect_valid(validate(request));
  v1::SubmapIds out;
  for (const SubmapId& id : request.submaps) write(id, out);
  return pack_frame(MessageKind::submap_request, out.SerializeAsString());
}

Result<SubmapRequest> decode_submap_request(std::string_view bytes) {
  const auto parsed = parse_frame<v1::SubmapIds>(MessageKind::submap_request, bytes);
  if (!parsed) return tl::unexpected(parsed.error());
  auto submaps = read(parsed->message);
  if (!submaps) return in_context("submap request", submaps.error());
  SubmapRequest request{std::move(*submaps)};
  if (auto ok = validate(request); !ok) return tl::unexpected(ok.error());
  return request;
}

std::string encode(const SubmapCopy& copy) {
  expect_valid(validate(copy));
  v1::SubmapCopy out;
  out.set_robot(copy.id.chain.robot.value);
  out.set_session(copy.id.chain.session);
  out.set_index(copy.id.index);
  out.set_frame(copy.frame);
  return pack_frame(MessageKind::submap_copy, out.SerializeAsString());
}

Result<SubmapCopy> decode_submap_copy(std::string_view bytes) {
  auto parsed = parse_frame<v1::SubmapCopy>(MessageKind::submap_copy, bytes);
  if (!parsed) return tl::unexpected(parsed.error());
  v1::SubmapCopy& in = parsed->message;
  SubmapCopy copy{.id = {{RobotId{in.robot()}, in.session()}, in.index()}, .frame = std::move(*in.mutable_frame())};
  if (auto ok = validate(copy); !ok) return tl::unexpected(ok.error());
  return copy;
}

}  // namespace tutti::wire
