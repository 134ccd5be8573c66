// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/map_task.hpp"

#include <memory>
#include <utility>

#include "tutti/server/update_cost.hpp"

namespace tutti::node {

MapOfTask make_map(MapTask task) {
  MapOfTask out{.made = server::make_map(std::move(task.job)),
                .is_update = task.is_update,
                .pace = {.begun = task.begun},
                .broadcast = std::move(task.broadcast),
                .step = {}};
  const server::MadeMap& made = out.made;
  out.pace.cost_s = server::counted_cost_s(made);
  ProxyGraphMessage message = std::move(out.made.message);
  message.graph.incarnation = task.incarnation;
  out.broadcast.send(std::move(message), task.names,
                     std::make_shared<const server::Beliefs>(server::beliefs_of(made.map)), task.robots, task.at_once,
                     task.begun, out.step);
  return out;
}

}  // namespace tutti::node
