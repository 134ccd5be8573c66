// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/hosted_server.hpp"

#include <fmt/format.h>

#include <chrono>

#include "tutti/base/freed_memory.hpp"
#include "tutti/drive/stopwatch.hpp"
#include "tutti/node/status_envelope.hpp"

namespace tutti::program {

HostedServer::HostedServer(std::unique_ptr<node::ServerNode> node, const storage::TableStore& map, std::string version,
                           std::function<std::string(const MissionStatus&)> trouble, const bool& is_over,
                           const std::vector<std::unique_ptr<MapViewer>>& viewers, const Clock& clock, MakeMap make_map)
    : node_(std::move(node)),
      shown_maps_(map),
      version_(std::move(version)),
      trouble_(std::move(trouble)),
      is_over_(is_over),
      viewers_(viewers),
      clock_(clock),
      make_map_(std::move(make_map)) {}

bool HostedServer::is_made() const {
  return making_.valid() && making_.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

std::optional<Timestamp> HostedServer::next_work() const { return is_made() ? kFirstTimestamp : node_->next_timer(); }

Answer HostedServer::work(Timestamp now) {
  Answer answer;
  answer.step.add(node_->tend(now));
  if (is_made()) {
    answer.step.add(node_->end_map(making_.get(), now));
    return_freed_memory();
  }
  if (auto task = node_->begin_map(now))
    making_ = std::async(std::launch::async, [this, task = std::move(*task)]() mutable {
      const double begun_s = drive::thread_cpu_s();
      node::MapOfTask made = make_map_(std::move(task));
      made.pace.cost_s =
          clock_.rate() * (drive::thread_cpu_s() - begun_s);  // a mission's clock may be faster than the wall's
      return made;
    });
  if (node_->changes() != reported_changes_) answer.step.messages.push_back(mission_status(now));
  return counted(std::move(answer));
}

Answer HostedServer::end() {
  Answer answer;
  if (making_.valid()) answer.step.add(node_->end_map(making_.get(), clock_.now()));
  return counted(std::move(answer));
}

void HostedServer::wait(double wall_s) {
  tend_viewers(clock_.now());
  if (making_.valid())
    making_.wait_for(std::chrono::duration<double>(wall_s));
  else
    Hosted::wait(wall_s);
}

bus::Envelope HostedServer::mission_status(Timestamp now) {
  reported_changes_ = node_->changes();
  MissionStatus status = node_->mission_status(now);
  status.version = version_;
  status.wall_ns = static_cast<std::int64_t>(wall_clock_ns());
  status.trouble = trouble_(status);
  status.radio = radio_.sums();
  return node::to_viewers(std::move(status));
}

void HostedServer::tend_viewers(Timestamp now) {
  std::shared_ptr<const mapfile::ShownMap> shown;
  for (const auto& viewer : viewers_) {
    if (!node_->has_map() || !viewer->wants(node_->map_server().state().revision)) continue;
    if (!shown) shown = std::make_shared<const mapfile::ShownMap>(shown_maps_.of(*node_, now));
    viewer->show(shown);
  }
}

Json HostedServer::status(Timestamp now) const {
  const MissionStatus status = node_->mission_status(now);
  return {{"program", "server"},
          {"time_s", now - Timestamp{}},
          {"revision", status.revision},
          {"submaps", status.submaps},
          {"closures", status.closures},
          {"pending_jobs", status.pending_jobs},
          {"has_news", status.has_news},
          {"has_map", node_->has_map()},
          {"line", fmt::format("map revision {}: {} submaps of {} robots, {} closures, {} maps{}", status.revision,
                               status.submaps, status.robots.size(), status.closures, status.components,
                               status.has_news                            ? ", news"
                               : node_->has_map() || status.revision == 0 ? ""
                                                                          : ", being computed")}};
}

}  // namespace tutti::program
