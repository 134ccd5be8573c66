// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/decision_sender.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "tutti/base/content_hash.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::node {

DecisionSender::DecisionSender(bus::Endpoint self, const ClosureDecision& decision)
    : DecisionSender(self, fmt::format("{}/{}/{}", to_string(decision.wish), decision.given_ns, self.number),
                     wire::encode(decision)) {}

DecisionSender::DecisionSender(bus::Endpoint self, const MarkOrder& order)
    : DecisionSender(self, fmt::format("mark/{}/{}/{}", order.number, order.given_ns, self.number),
                     wire::encode(order)) {}

DecisionSender::DecisionSender(bus::Endpoint self, std::string id, std::string frame)
    : self_(self),
      id_(std::move(id)),
      bytes_(std::make_shared<const std::string>(std::move(frame))),
      content_(content_hash(*bytes_)) {}

std::optional<bus::Envelope> DecisionSender::due(double now_s) {
  if (sent_ > 0 && now_s < next_s_) return std::nullopt;
  next_s_ = now_s + kAgain_s;
  return bus::Envelope{self_, bus::Endpoint::server(), bus::MessageKind::decision, fmt::format("{}/{}", id_, sent_++),
                       bytes_};
}

std::optional<std::string> DecisionSender::answer(const MissionStatus& status) const {
  const auto found = std::ranges::find(status.decisions, content_, &MissionStatus::Decision::content);
  return found == status.decisions.end() ? std::nullopt : std::optional(found->why);
}

}  // namespace tutti::node
