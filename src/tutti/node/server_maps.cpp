// SPDX-License-Identifier: BSD-3-Clause
// When a ServerNode makes its map, and what follows.
#include <algorithm>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/node/map_meta.hpp"
#include "tutti/node/server_node.hpp"
#include "tutti/node/submap_frames.hpp"
#include "tutti/storage/map_tables.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::node {

bool ServerNode::is_due(const std::optional<Timestamp>& timer, Timestamp now) const {
  return !is_making_map_ && timer && *timer <= now;
}

Step ServerNode::tend(Timestamp now) {
  Step step;
  ask_again(now, step);
  settle(now, step);
  if (is_due(review_at_, now)) {
    broadcast_.send_waiting(robots_, now, step);
    review_at_ = broadcast_.next_review();
  }
  return step;
}

std::optional<MapTask> ServerNode::begin_map(Timestamp now) {
  const bool is_update = is_due(timer_, now);
  if (!is_update && !is_due(compute_at_, now)) return std::nullopt;
  timer_.reset();
  compute_at_.reset();
  is_making_map_ = true;
  const bool operator_decided = std::exchange(operator_decided_, false);
  MapTask task{.job = is_update ? server_.begin_update() : server_.begin_rebuild(),
               .is_update = is_update,
               .begun = now,
               .incarnation = config_.incarnation,
               .robots = robots_,
               .names = robot_names(),
               .at_once = operator_decided,
               .broadcast = std::move(broadcast_)};
  for (const RobotId robot : robots_)
    if (const auto owner = registry_.owner(robot)) task.job.owners.push_back(*owner);
  return task;
}

Step ServerNode::end_map(MapOfTask made, Timestamp now) {
  TUTTI_CHECK(is_making_map_, "a map that was not begun");
  Step step = std::move(made.step);
  const std::size_t submaps = made.made.job.submaps.size();
  server_.finish(std::move(made.made), may_refine(now));
  keep_retired(now, step);
  broadcast_ = std::move(made.broadcast);
  last_broadcast_ = broadcast_.last();
  if (made.is_update) {
    pacer_.end(made.pace);
    step.writes.push_back(to_row(made.pace));
  }
  is_making_map_ = false;
  has_map_ = true;
  ++changes_;
  if (server_.has_news()) timer_ = pacer_.earliest(now, operator_decided_);
  review_at_ = broadcast_.next_review();
  const server::MapEstimate& map = server_.map();
  const auto accepted = std::ranges::count_if(map.closures, &server::JudgedClosure::accepted);
  const MapCounts counts{server_.state().revision, map.nodes.size(), static_cast<std::uint64_t>(accepted),
                         map.components};
  if (stored_counts_ != counts) {
    stored_counts_ = counts;
    step.writes.push_back(to_row(counts));
  }
  send_refinement_job(now, step);
  note_settling(now);
  if (!made.is_update) return step;
  step.writes.push_back(meta());
  step.emit(now, MapUpdated{.revision = server_.state().revision,
                            .submaps = submaps,
                            .accepted = static_cast<std::size_t>(counts.closures),
                            .cost = map.cost,
                            .degrees_of_freedom = map.degrees_of_freedom,
                            .from_measurements = map.from_measurements});
  return step;
}

void ServerNode::keep_retired(Timestamp now, Step& step) {
  const server::Retired retired = server_.take_retired();
  for (const SubmapPair& pair : retired.dropped)
    step.writes.push_back({map_tables::kVerdicts, key_of(pair), std::nullopt});
  for (const SubmapId& id : retired.submaps) {
    step.writes.push_back(retired_row(id));
    step.writes.push_back({map_tables::kMeta, place_key(id), std::nullopt});
    const auto frame = frames_->frame(id);
    auto message = frame ? wire::decode_submap(*frame) : tl::unexpected(frame.error());
    if (!message) {  // it stays as it is: larger than it need be
      step.emit(now, MessageRefused{bus::Endpoint::server(), bus::MessageKind::submap, message.error().message});
      continue;
    }
    message->submap = without_payloads(std::move(message->submap));
    step.writes.push_back({map_tables::kSubmaps, key_of(id), wire::encode(*message)});
  }
}

Step ServerNode::on_timer(Timestamp now) {
  Step step = tend(now);
  if (auto task = begin_map(now)) step.add(end_map(make_map(std::move(*task)), now));
  return step;
}

}  // namespace tutti::node
