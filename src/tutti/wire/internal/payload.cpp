// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/wire/internal/payload.hpp"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>

#include <algorithm>
#include <array>
#include <span>

#include "tutti/model/proxy_graph.hpp"
#include "tutti/v1/messages.pb.h"
#include "tutti/wire/limits.hpp"

namespace tutti::wire {
namespace {

using google::protobuf::internal::WireFormatLite;

/// A field that may take far more memory than its bytes: integers, a byte or more each, and messages.
struct Field {
  int number = 0;
  std::size_t at_most = 0;  ///< Elements, in one message.
  const char* what = nullptr;
  bool is_message = false;
  std::span<const Field> inside = {};  ///< If it is a message: its fields.
};

constexpr std::size_t kMostChains = tutti::ProxyGraph::kMostChains;

constexpr std::array kCloud = {Field{v1::Cloud::kVoxelFieldNumber, kMaxCloudPoints, "points"}};
constexpr std::array kVisual = {Field{v1::Visual::kCameraFieldNumber, kMaxCameras, "cameras", true},
                                Field{v1::Visual::kImuKeyframeFieldNumber, kMaxKeyframes, "IMU keyframes"}};
constexpr std::array kSubmap = {
    Field{v1::Submap::kStampNsFieldNumber, kMaxKeyframes, "keyframes"},
    Field{v1::Submap::kPoseFieldNumber, 6 * kMaxKeyframes, "pose numbers"},
    Field{v1::Submap::kRepresentativeFieldNumber, kMaxKeyframes, "flags"},
    Field{v1::Submap::kOdometryFieldNumber, 6 * kMaxKeyframes, "odometry numbers"},
    Field{v1::Submap::kOdometryCovarianceFieldNumber, 21 * kMaxKeyframes, "covariance numbers"},
    Field{v1::Submap::kCloudFieldNumber, 1, "clouds", true, kCloud},  // several would be merged
    Field{v1::Submap::kVisualFieldNumber, 1, "visual payloads", true, kVisual}};
constexpr std::array kProxyGraph = {
    Field{v1::ProxyGraph::kRunFieldNumber, kMostChains, "chains", true},
    Field{v1::ProxyGraph::kComponentRobotFieldNumber, kMostChains, "robots of components"},
    Field{v1::ProxyGraph::kComponentSessionFieldNumber, kMostChains, "sessions of components"},
    Field{v1::ProxyGraph::kComponentFieldNumber, kMostChains, "components"}};
constexpr std::array kAgentState = {Field{v1::AgentState::kIntegerFieldNumber, kMaxStateBytes / 32, "integers"}};

std::span<const Field> fields_of(MessageKind kind) {
  switch (kind) {
    case MessageKind::submap:
      return kSubmap;
    case MessageKind::proxy_graph:
    case MessageKind::proxy_graph_delta:
      return kProxyGraph;
    case MessageKind::cloud:
      return kCloud;
    case MessageKind::agent_state:
    case MessageKind::tracked_images:
      return kAgentState;
    default:
      return {};  // field_message.hpp
  }
}

/// Every integer, a length too, ends with a byte below 128.
bool ends_integer(char byte) { return (static_cast<unsigned char>(byte) & 0x80U) == 0; }

/// `bytes` without the length they begin with.
std::string_view after_length(std::string_view bytes) {
  return {std::ranges::find_if(bytes, ends_integer) + 1, bytes.end()};
}

/// Elements that a field of this type and with these bytes, from its length on, adds.
std::size_t elements(const Field& field, WireFormatLite::WireType type, std::string_view bytes) {
  const bool has_length = type == WireFormatLite::WIRETYPE_LENGTH_DELIMITED;
  if (field.is_message) return has_length ? 1 : 0;
  if (has_length) return static_cast<std::size_t>(std::ranges::count_if(after_length(bytes), ends_integer));
  return type == WireFormatLite::WIRETYPE_VARINT ? 1 : 0;
}

Status check_fields(std::string_view message, std::span<const Field> fields) {
  const auto unreadable = [] { return fail(ErrorCode::parse, "not the protobuf message expected"); };
  google::protobuf::io::CodedInputStream in(reinterpret_cast<const std::uint8_t*>(message.data()),
                                            static_cast<int>(message.size()));
  const auto position = [&in] { return static_cast<std::size_t>(in.CurrentPosition()); };
  std::array<std::size_t, kSubmap.size()> counts{};  // no message has more fields
  while (const std::uint32_t tag = in.ReadTag()) {
    const std::size_t begin = position();
    if (!WireFormatLite::SkipField(&in, tag)) return unreadable();
    const auto field = std::ranges::find(fields, WireFormatLite::GetTagFieldNumber(tag), &Field::number);
    if (field == fields.end()) continue;
    const std::string_view bytes = message.substr(begin, position() - begin);
    const std::size_t added = elements(*field, WireFormatLite::GetTagWireType(tag), bytes);
    std::size_t& count = counts[static_cast<std::size_t>(field - fields.begin())];
    count += added;
    if (count > field->at_most)
      return fail(ErrorCode::invalid, "{} {} or more, at most {} are accepted", count, field->what, field->at_most);
    if (added == 0 || field->inside.empty()) continue;
    if (auto ok = check_fields(after_length(bytes), field->inside); !ok) return in_context(field->what, ok.error());
  }
  if (!in.ConsumedEntireMessage()) return unreadable();
  return {};
}

}  // namespace

Status check_counts(MessageKind kind, std::string_view payload) { return check_fields(payload, fields_of(kind)); }

}  // namespace tutti::wire
