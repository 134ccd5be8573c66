// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "tutti/bus/transport.hpp"

/// The functions in the rows of transports().
namespace tutti::bus {

/// A port over NATS JetStream (docs/bus.md). The server's port makes the streams that the mission needs on the bus and
/// keeps those that exist. Threads of its own connect, send, receive and acknowledge. Messages that the bus has not
/// confirmed are sent again with the same id, of which the bus stores one. Sent first are status messages, then
/// retained ones, then the rest in the order of send(), of submaps the newest. Without a bus the port waits for one.
/// The destructor takes seconds at most, in which acknowledgements are delivered if the bus can be reached.
std::unique_ptr<Port> open_nats_port(Endpoint endpoint, const BusOptions& options);
/// Values of a bucket.
std::unique_ptr<LeaseBoard> open_nats_leases(const BusOptions& options);
/// Values of a stream, which has the last one of each subject.
std::unique_ptr<MapBoard> open_nats_maps(const BusOptions& options);
Status check_nats(const BusOptions& options, const BusUrl& url);

/// A port to a bus of this process, which lasts as long as the process. A sender may have max_waiting_bytes on it that
/// are not acknowledged; beyond, best-effort messages are dropped and others refused, but retained ones, of which there
/// is one for each receiver. The other limits of BusOptions do not apply.
std::unique_ptr<Port> open_memory_port(Endpoint endpoint, const BusOptions& options);
std::unique_ptr<LeaseBoard> open_memory_leases(const BusOptions& options);
std::unique_ptr<MapBoard> open_memory_maps(const BusOptions& options);

}  // namespace tutti::bus
