// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/status_envelope.hpp"

#include <fmt/format.h>

#include "tutti/base/plain_text.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::node {
namespace {

using bus::Endpoint, bus::MessageKind;

template <class Message>
std::shared_ptr<const std::string> encoded(Message& message) {
  message.version = plain_text(message.version);
  message.trouble = plain_text(message.trouble);
  return std::make_shared<const std::string>(wire::encode(message));
}

}  // namespace

bus::Envelope to_server(Endpoint from, NodeStatus status) {
  return {from, Endpoint::server(), MessageKind::status, {}, encoded(status)};
}

bus::Envelope to_viewers(MissionStatus status) {
  return {Endpoint::server(), Endpoint::all_viewers(), MessageKind::mission_status, {}, encoded(status)};
}

std::string default_name(Endpoint endpoint) { return fmt::format("{}_{}", name(endpoint.role), endpoint.number); }

}  // namespace tutti::node
