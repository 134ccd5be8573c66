// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/hosted_server.hpp"

#include <fmt/format.h>

#include "tutti/node/status_envelope.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::program {

bus::Envelope HostedServer::mission_status(Timestamp now) {
  told_changes_ = node_->changes();
  MissionStatus status = node_->mission_status(now);
  status.version = version_;
  status.wall_ns = static_cast<std::int64_t>(wall_clock_ns());
  status.trouble = trouble_();
  for (const auto& viewer : viewers_) viewer->tell(status, radio_.sums());
  return node::to_viewers(std::move(status));
}

void HostedServer::tend_viewers(Timestamp now) {
  for (auto& [promise, why] : std::exchange(answers_, {})) promise.set_value(why);
  std::shared_ptr<const mapfile::ShownMap> shown;
  for (const auto& viewer : viewers_) {
    for (AskedWord& word : viewer->take_words()) asked_.push_back(std::move(word));
    if (!node_->has_map() || !viewer->wants(node_->map_server().state().revision)) continue;
    if (!shown) shown = std::make_shared<const mapfile::ShownMap>(mapfile::shown_map(*node_, now));
    viewer->show(shown);
  }
}

void HostedServer::take(AskedWord& asked, Timestamp now, node::Step& step) {
  const bus::Envelope envelope{bus::Endpoint::viewer(0),
                               bus::Endpoint::server(),
                               bus::MessageKind::word,
                               fmt::format("page/{}/{}", asked.word.given_ns, ++asked_words_),
                               std::make_shared<const std::string>(wire::encode(asked.word)),
                               asked.proved_name};
  node::Step taken = node_->receive(envelope, now);
  std::string why;
  for (const node::Event& event : taken.events)
    if (const auto* refused = std::get_if<node::MessageRefused>(&event.what)) why = refused->why;
  answers_.emplace_back(std::move(asked.answer), std::move(why));
  step.add(std::move(taken));
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
