// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/wire/codec.hpp"
#include "tutti/wire/internal/field_message.hpp"
#include "tutti/wire/submap_copy_codec.hpp"

namespace tutti::wire {

Status validate(const NodeStatus& status) { return check_message(MessageKind::status, status); }
std::string encode(const NodeStatus& status) { return encode_fields(MessageKind::status, status); }
Result<NodeStatus> decode_status(std::string_view bytes) {
  return decode_fields<NodeStatus>(MessageKind::status, bytes);
}

Status validate(const MissionStatus& status) { return check_message(MessageKind::mission_status, status); }
std::string encode(const MissionStatus& status) { return encode_fields(MessageKind::mission_status, status); }
Result<MissionStatus> decode_mission_status(std::string_view bytes) {
  return decode_fields<MissionStatus>(MessageKind::mission_status, bytes);
}

Status validate(const ClosureDecision& decision) { return check_message(MessageKind::decision, decision); }
std::string encode(const ClosureDecision& decision) { return encode_fields(MessageKind::decision, decision); }
Result<ClosureDecision> decode_decision(std::string_view bytes) {
  return decode_fields<ClosureDecision>(MessageKind::decision, bytes);
}

Status validate(const MarkOrder& order) { return check_message(MessageKind::mark, order); }
std::string encode(const MarkOrder& order) { return encode_fields(MessageKind::mark, order); }
Result<MarkOrder> decode_mark_order(std::string_view bytes) {
  return decode_fields<MarkOrder>(MessageKind::mark, bytes);
}

Status validate(const ClosureVerdict& verdict) { return check_message(MessageKind::verdict, verdict); }
std::string encode(const ClosureVerdict& verdict) { return encode_fields(MessageKind::verdict, verdict); }
Result<ClosureVerdict> decode_verdict(std::string_view bytes) {
  return decode_fields<ClosureVerdict>(MessageKind::verdict, bytes);
}

Status validate(const Receipt& receipt) { return check_message(MessageKind::receipt, receipt); }
std::string encode(const Receipt& receipt) { return encode_fields(MessageKind::receipt, receipt); }
Result<Receipt> decode_receipt(std::string_view bytes) { return decode_fields<Receipt>(MessageKind::receipt, bytes); }

Status validate(const Job& job) { return check_message(MessageKind::job, job); }
std::string encode(const Job& job) { return encode_fields(MessageKind::job, job); }
Result<Job> decode_job(std::string_view bytes) { return decode_fields<Job>(MessageKind::job, bytes); }

Status validate(const Verdicts& verdicts) { return check_message(MessageKind::verdicts, verdicts); }
std::string encode(const Verdicts& verdicts) { return encode_fields(MessageKind::verdicts, verdicts); }
Result<Verdicts> decode_verdicts(std::string_view bytes) {
  return decode_fields<Verdicts>(MessageKind::verdicts, bytes);
}

Status validate(const SubmapRequest& request) { return check_message(MessageKind::submap_request, request); }
std::string encode(const SubmapRequest& request) { return encode_fields(MessageKind::submap_request, request); }
Result<SubmapRequest> decode_submap_request(std::string_view bytes) {
  return decode_fields<SubmapRequest>(MessageKind::submap_request, bytes);
}

Status validate(const SubmapCopy& copy) { return check_message(MessageKind::submap_copy, copy); }
std::string encode(const SubmapCopy& copy) { return encode_fields(MessageKind::submap_copy, copy); }
Result<SubmapCopy> decode_submap_copy(std::string_view bytes) {
  return decode_fields<SubmapCopy>(MessageKind::submap_copy, bytes);
}

}  // namespace tutti::wire
