// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/bus/envelope.hpp"
#include "tutti/model/status.hpp"

namespace tutti::node {

/// A robot's or worker's status on its way to the server. Texts become plain (wire::plain_text()).
bus::Envelope to_server(bus::Endpoint from, NodeStatus status);
/// The server's on its way to whoever looks on.
bus::Envelope to_viewers(MissionStatus status);
/// The name of a robot or worker that was given none: "robot_7".
std::string default_name(bus::Endpoint endpoint);

}  // namespace tutti::node
