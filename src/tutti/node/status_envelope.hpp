// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/bus/envelope.hpp"
#include "tutti/model/status.hpp"

namespace tutti::node {

/// The message with a robot's or worker's status for the server. Its texts are made plain (tutti::plain_text()).
bus::Envelope to_server(bus::Endpoint from, NodeStatus status);
/// The message with the server's status for everybody who watches.
bus::Envelope to_viewers(MissionStatus status);
/// The name of a robot or worker that was given none, such as "robot_7".
std::string default_name(bus::Endpoint endpoint);

}  // namespace tutti::node
