// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/hosted_robot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "tutti/base/plain_text.hpp"
#include "tutti/model/proxy_graph.hpp"
#include "tutti/node/status_envelope.hpp"
#include "tutti/program/field_json.hpp"

namespace tutti::program {
namespace {

constexpr double kLongestWork_s = 0.05;  // then it listens again
constexpr std::size_t kBehind = 1'000;   // samples and scans that wait: 5 s at 200 Hz
constexpr double kStarts_s = 15.0;       // so long a second program of this robot ends when it learns so

/// Where the map that it localises in no longer fits, the worst first.
Json changed_places(const localise::Localiser& localiser, Timestamp now) {
  constexpr std::size_t kMost = 100;
  std::vector<std::pair<double, Json>> changed;
  for (const auto& [submap, fit] : localiser.map_fit().fits()) {
    if (!fit.has_changed()) continue;
    changed.emplace_back(fit.trust(), Json{{"submap", localiser.map().names.of(submap)},
                                           {"missing", fit.missing},
                                           {"appeared", fit.appeared},
                                           {"trust", fit.trust()},
                                           {"age_s", now - fit.seen}});
  }
  std::ranges::stable_sort(changed, {}, [](const auto& place) { return place.first; });
  Json out = Json::array();
  for (std::size_t i = 0; i < std::min(changed.size(), kMost); ++i) out.push_back(std::move(changed[i].second));
  return out;
}

}  // namespace

Answer HostedRobot::receive(const bus::Received& message, Timestamp now) {
  const auto before = driver_.node().newest_graph();
  driver_.receive(message.envelope, now);
  for (drive::UpdateTime& time : driver_.take_update_times()) {
    Json line{{"event", kUpdateTimed}};
    line.update(json_of_fields(time));
    log_.write(line);
  }
  note_conflict();
  Answer out = answer_for({message.ticket});
  const bool has_updated = std::ranges::any_of(out.step.events, [](const node::Event& event) {
    const auto* update = std::get_if<node::RobotUpdated>(&event.what);
    return update != nullptr && update->summary.synchronised > 0;
  });
  const robot::RobotAgent& agent = driver_.node().agent();
  const auto& graph = driver_.node().newest_graph();
  const bool is_wanted = options_.replay.score || (feed_ && feed_->front().wants_trajectory());
  if (graph == before || !has_updated || !is_wanted) return out;
  Trajectory map = trajectory_of(graph->graph, agent.chain());
  if (options_.replay.score) log_.write(options_.replay.score(map, agent));
  if (feed_) feed_->front().say({agent.map_age(), agent.ledger().size(), agent.corrected(), std::move(map)});
  return out;
}

/// Who has just started ends; who maps goes on, whatever others report.
void HostedRobot::note_conflict() {
  const auto& conflict = driver_.node().conflict();
  if (!conflict || warned_) return;
  warned_ = true;
  if (clock_.wall_s() - begin_s_ < kStarts_s)
    refused_ = *conflict;
  else
    log_.say(Level::warning, *conflict + "; this one goes on all the same");
}

std::optional<Timestamp> HostedRobot::next_work() const {
  std::optional<Timestamp> next = driver_.node().next_timer();
  if (!replay_ || ended_) return next;
  const double next_s = replay_->next_time();
  const Timestamp sample =
      next_s > options_.replay.duration_s ? Timestamp{} : Timestamp{} + next_s;  // at its end: at once
  return next ? std::min(*next, sample) : sample;
}

/// All samples that are due, as far as they get in a while and within one submap: what the node sends later it reads
/// from its store.
Answer HostedRobot::work(Timestamp now) {
  if (const auto timer = driver_.node().next_timer(); timer && *timer <= now) driver_.on_timer(now);
  const double until_s = clock_.wall_s() + kLongestWork_s;
  const std::size_t backlog = driver_.node().backlog().size();
  while (replay_ && !ended_ && clock_.wall_s() < until_s && driver_.node().backlog().size() == backlog) {
    const double next_s = replay_->next_time();
    if (next_s > options_.replay.duration_s) {
      driver_.finish(now);
      ended_ = true;
    } else if (Timestamp{} + next_s <= now) {
      replay_->feed_next(now);
    } else {
      break;
    }
  }
  return answer_for();
}

/// The node never hears of what the feed refuses.
NodeStatus HostedRobot::node_status(Timestamp now) const {
  NodeStatus status = driver_.node().status(now);
  status.version = options_.version;
  if (maps_ != nullptr) {
    if (status.in_map.state.empty()) status.in_map.state = "no map";
    const char* const next = maps_->has_news() ? "another map is here, which it changes to when it stands" : "";
    for (const std::string& more : {maps_->state(), std::string(next)})
      if (!more.empty())
        status.in_map.why = plain_text(status.in_map.why + (status.in_map.why.empty() ? "" : "; ") + more);
  }
  if (feed_) status.health = feed_->front().health();
  if (const std::string refused = feed_ ? feed_->front().odometry_trouble() : ""; !refused.empty())
    status.trouble = plain_text(refused);
  return status;
}

Answer HostedRobot::report(Timestamp now) {
  NodeStatus status = node_status(now);
  if (feed_) feed_->front().say_status(status);
  return {{.messages = {node::to_server(bus::Endpoint::of(driver_.node().agent().robot()), std::move(status))}}, {}};
}

bool HostedRobot::finished() const {
  if (refused_ || (options_.is_alone && !options_.stay && has_ended())) return true;
  if (options_.stay || !has_ended() || !driver_.node().backlog().empty()) {
    settled_s_.reset();
    return false;
  }
  if (!settled_s_) settled_s_ = clock_.wall_s();
  return is_whole_in_map() || clock_.wall_s() > *settled_s_ + kWaitsForMap_s;
}

std::string HostedRobot::progress(double time_s) const {
  const double end_s = options_.replay.duration_s;
  if (!feed_) return fmt::format("{:.0f} of {:.0f} s", std::min(time_s, end_s), end_s);
  const std::string behind = feed_->front().load().waiting > kBehind ? ", the map is behind what is fed" : "";
  return (has_ended() ? "the recording has ended" : feed_->is_fed() ? "a client feeds" : "no client feeds") + behind;
}

/// How much is fed, by which client and by whose clock.
Json HostedRobot::feed_status() const {
  const FeedSession::Feeder feeder = feed_->feeder();
  const FeedFront::Figures of = feed_->front().figures();
  const FeedFront::Load load = feed_->front().load();
  const FeedClock& clock = feeder.clock;
  Json of_clock{{"by", clock.how() == FeedClock::How::measured   ? "measured"
                       : clock.how() == FeedClock::How::declared ? "declared"
                                                                 : "the robot's"},
                {"offset_ns", clock.offset_ns()}};
  if (clock.measured_ns()) of_clock["measured_offset_ns"] = *clock.measured_ns();
  if (clock.drift_ppm()) of_clock["drift_ppm"] = *clock.drift_ppm();
  return {{"client", feeder.name},
          {"connected", feed_->is_fed()},
          {"bytes", feeder.bytes},
          {"clock", std::move(of_clock)},
          {"inputs_waiting", load.waiting},
          {"scans_left_out", load.scans_left_out},
          {"samples_joined", load.samples_joined},
          {"images", of.images},
          {"images_left_out", of.images_left_out},
          {"image_bytes_waiting", of.image_bytes},
          {"imu_samples", of.imu},
          {"imu_samples_left_out", of.imu_left_out},
          {"fixes", of.fixes},
          {"fixes_left_out", of.fixes_left_out}};
}

Json HostedRobot::status(Timestamp now) const {
  const NodeStatus status = node_status(now);
  const bus::LinkState link = port_.state();
  const double time_s = now - Timestamp{};
  const localise::Localiser* const localiser = driver_.node().localiser();
  Json changed = localiser ? changed_places(*localiser, localiser->located().stamp) : Json::array();
  std::string in_map = status.in_map.state.empty() ? "" : ", in its map: " + status.in_map.state;
  if (!changed.empty()) in_map += fmt::format(", something has changed in {} submaps", changed.size());
  Json out = json_of_fields(status);
  out.update({{"program", "robot"},
              {"time_s", time_s},
              {"finished", has_ended()},
              {"backlog", status.backlog_submaps},
              {"revision", status.heard_revision},
              {"connected", link.connected},
              {"alone", alone_},
              {"refused", driver_.node().conflict().value_or("")},
              {"line", fmt::format("{}, {} keyframes, {} submaps not stored yet, heard map revision {}{}{}{}",
                                   progress(time_s), status.keyframes, status.backlog_submaps, status.heard_revision,
                                   in_map, link.connected ? "" : ", no link: " + link.last_error,
                                   alone_.empty() ? "" : ", " + alone_)}});
  if (status.trouble.empty()) out.erase("trouble");
  out.erase("map_fit");  // some of the places, in turn
  if (localiser != nullptr) out["changed_places"] = std::move(changed);
  if (feed_) out["feed"] = feed_status();
  return out;
}

}  // namespace tutti::program
