// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/shown_map.hpp"

namespace tutti::mapfile {

ShownMap shown_map(const node::ServerNode& server, Timestamp now) {
  const server::MapServer& map = server.map_server();
  const server::MapServerState& state = map.state();
  ShownMap shown{.revision = state.revision, .time = now, .map = map.map(), .broadcast = server.broadcast()};
  shown.content.submaps = state.submaps;
  shown.content.payload_sizes = state.payload_sizes;
  shown.content.verdicts = state.verdicts;
  shown.content.words = state.words;
  shown.content.names = server.robot_names();
  return shown;
}

}  // namespace tutti::mapfile
