// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "tutti/wire/codec.hpp"
#include "tutti/wire/internal/field_message.hpp"

namespace tutti::wire {

Status validate(const NodeStatus& status) { return check_message(MessageKind::status, status); }
std::string encode(const NodeStatus& status) { return encode_fields(MessageKind::status, status); }
Result<NodeStatus> decode_status(std::string_view bytes) {
  return decode_fields<NodeStatus>(MessageKind::status, bytes);
}

Status validate(const MissionStatus& status) {
  if (auto ok = check_message(MessageKind::mission_status, status); !ok) return ok;
  const auto not_after = [](const auto& a, const auto& b) { return a >= b; };
  if (std::ranges::adjacent_find(status.robots, not_after, &MissionStatus::Robot::robot) == status.robots.end() &&
      std::ranges::adjacent_find(status.workers, not_after, &MissionStatus::Worker::number) == status.workers.end())
    return {};
  return fail(ErrorCode::invalid, "mission status: robots or workers are not in the order of their numbers");
}
std::string encode(const MissionStatus& status) { return encode_fields(MessageKind::mission_status, status); }
Result<MissionStatus> decode_mission_status(std::string_view bytes) {
  return decode_fields<MissionStatus>(MessageKind::mission_status, bytes);
}

Status validate(const ClosureWord& word) { return check_message(MessageKind::word, word); }
std::string encode(const ClosureWord& word) { return encode_fields(MessageKind::word, word); }
Result<ClosureWord> decode_word(std::string_view bytes) { return decode_fields<ClosureWord>(MessageKind::word, bytes); }

}  // namespace tutti::wire
