// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/localise/localiser.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/geometry/covariance.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/model/pose_at.hpp"
#include "tutti/perception/lidar/undistort.hpp"

namespace tutti::localise {
namespace {

constexpr int kConfirmations = 3;         // scans that a found place must lie under
constexpr std::size_t kMostWaiting = 64;  // scans
constexpr std::size_t kMostPending = 16;
constexpr int kStartScans = 3;  // that are tried from a start pose
// The map itself errs by this where the robot is.
constexpr double kMap_m = 0.02, kMap_rad = 0.1 * kRadPerDeg;
// Registrations of one stretch err alike: so much more than they say.
constexpr double kAlike = 4.0;
constexpr double kCameraAge_s = 25.0;   // a camera's submap is due before
constexpr double kLostAfter_s = 1.0;    // of scans that contradict the map; then it searches again
constexpr double kOffMapAfter_s = 1.5;  // of scans of which none confirms; a robot that was carried may see both kinds
constexpr double kGuessedFor_s = 2.0;   // of such scans; then a place that was found is none
constexpr double kScanSilence_s = 2.0;  // without a registered scan the pose is stale

/// Submaps have the odometry that scans are registered from, whatever scans show of it.
Localiser::Setup checked(Localiser::Setup setup) {
  TUTTI_CHECK(setup.map != nullptr && setup.make_verifier != nullptr, "no map or no verifier");
  setup.submap.fit.scans = "off";
  return setup;
}

}  // namespace

Localiser::Localiser(Setup setup)
    : setup_(checked(std::move(setup))),
      verifier_(setup_.make_verifier()),
      local_maps_(setup_.map, setup_.lidar),
      chain_(setup_.map->free_robot()),
      submaps_(chain_, setup_.submap) {
  TUTTI_CHECK(verifier_ != nullptr, "no verifier");
}

Status Localiser::add(const Input& input) {
  return std::visit([&](const auto& sample) { return hear(sample); }, input);
}

Status Localiser::hear(const OdometrySample& sample) {
  if (auto ok = submaps_.add(sample); !ok) return ok;
  recent_.add(sample);
  advance();
  return {};
}

bool Localiser::wants_scan(Timestamp stamp) const {
  const bool is_followed = track_ || start_ || setup_.map->floors > 1;  // is_shut_in()
  return (searches() && submaps_.wants_scan(stamp)) ||
         (is_followed && (!last_match_ || stamp - *last_match_ >= setup_.config.track_every_s));
}

Status Localiser::hear(const Scan& scan) {
  if (scan.cloud == nullptr) return fail(ErrorCode::invalid, "a scan without points");
  if (searches() && submaps_.wants_scan(scan.stamp)) {
    if (auto ok = submaps_.add(scan); !ok) return ok;
    ++work_.in_submaps;
  }
  if (last_scan_ && scan.stamp <= *last_scan_) return {};
  last_scan_ = scan.stamp;
  if (waiting_.size() >= kMostWaiting) waiting_.pop_front();
  waiting_.push_back(scan);
  advance();
  return {};
}

/// Uses the scans that odometry has reached, and the submaps that have ended.
void Localiser::advance() {
  const auto newest = recent_.newest();
  while (newest && !waiting_.empty() && waiting_.front().stamp <= newest->stamp) {
    const Scan scan = std::move(waiting_.front());
    waiting_.pop_front();
    if (!last_match_ || scan.stamp - *last_match_ >= setup_.config.track_every_s) follow(scan);
  }
  take_submaps();
}

Status Localiser::hear(const StartPose& start) {
  if (!start.T_world_body) {
    search_anew("it was asked to search the whole map");
    return {};
  }
  if (const Status ok = check_start_pose(start); !ok) return ok;
  StartPose normalised = start;
  normalised.T_world_body->T_a_b.rotation.normalize();
  auto levels = tries_of(*setup_.map, normalised);
  if (!levels) return tl::unexpected(levels.error());
  search_anew("a start pose was given, which scans have not confirmed yet");
  const auto newest = recent_.newest();
  start_ = Start{std::move(*levels), newest ? newest->stamp : Timestamp{}};
  return {};
}

std::optional<ReadyScan> Localiser::ready(const Scan& scan, Timestamp not_before) const {
  const auto T_odom_body = pose_at(recent_.poses(), scan.stamp);
  const auto undistorted = lidar::undistort(scan, recent_.poses());
  if (!T_odom_body || !undistorted || scan.stamp < not_before) return std::nullopt;
  return ReadyScan{{scan.stamp, *T_odom_body},
                   fit::make_fit_scan(scan.stamp, *undistorted->cloud, setup_.submap.min_range_m)};
}

/// Keeps some of the scans, to ask them all about the places that are found.
void Localiser::remember(const Scan& scan) {
  const auto at = pose_at(recent_.poses(), scan.stamp);
  if (!at || !stretch_.wants({scan.stamp, *at})) return;
  if (auto usable = ready(scan, scan.stamp)) stretch_.add(std::move(*usable));
}

/// Registers a scan from all poses that the start pose stands for. The place that fits best is followed, unless another
/// one fits nearly as well.
void Localiser::try_start(const Scan& scan) {
  const auto usable = ready(scan, start_->said);
  if (!usable) return;
  std::vector<StartFit> fits;
  for (const StartTries& level : start_->levels)
    if (const LocalMap* local = local_maps_.about({level.floor, level.T_world_body.T_a_b.translation})) {
      work_.registered += level.from.size();
      add_fits(*local, usable->scan, level, fits);
    }
  if (fits.size() == 1) {
    track_ = Track{.floor = fits.front().floor,
                   .T_world_body = fits.front().prior,
                   .at = usable->at,
                   .confirmed = scan.stamp,
                   .to_confirm = kConfirmations,
                   .gate = GuessGate::of_start()};
    fits.front().match.T_world_body.covariance *= kAlike;
    track_->correct(fits.front().match.T_world_body);
    why_ = "the start pose fits, which more scans are to confirm";
    return start_.reset();
  }
  if (++start_->scans < kStartScans) return;
  why_ = fits.empty() ? "nothing within two standard deviations of the start pose fits what it sees"
                      : fmt::format("{} places near the start pose fit what it sees", fits.size());
  start_.reset();
}

void Localiser::begin_submaps() {
  ++chain_.session;  // nothing of before belongs to what comes
  stretch_.clear();
  submaps_ = robot::SubmapBuilder(chain_, setup_.submap);
  if (const auto newest = recent_.newest()) (void)submaps_.add(*newest);
}

void Localiser::search_anew(const std::string& why) {
  track_.reset();
  start_.reset();
  map_fit_.doubt();
  pending_.clear();
  places_.clear();
  state_ = State::searching;
  why_ = why;
  begin_submaps();
}

/// While it is shut in, nothing tells on which floor it is, and nothing is looked for.
bool Localiser::is_shut_in(const Scan& scan) {
  const auto at = pose_at(recent_.poses(), scan.stamp);
  if (setup_.map->floors < 2 || !at) return false;
  const bool was = shut_in_.is();
  shut_in_.see(*scan.cloud, setup_.submap.min_range_m, {scan.stamp, *at});
  if (shut_in_.is()) {
    if (!was) search_anew({});
    state_ = State::between;
    why_ = fmt::format("it sees nothing farther than {:g} m, as in a lift", ShutIn::kReach_m);
  } else if (was) {
    begin_submaps();
    state_ = State::searching;
    why_ = "it has come out, and looks for its floor";
  }
  return shut_in_.is();
}

void Localiser::predict_to(const StampedPose& to) {
  track_->predict_to(to, recent_.stated(track_->at.stamp, to.stamp));
}

void Localiser::follow(const Scan& scan) {
  last_match_ = scan.stamp;
  if (is_shut_in(scan)) return;
  if (start_ && !track_) return try_start(scan);
  if (!track_ || state_ == State::off_map) remember(scan);
  if (!track_) return;
  const auto usable = ready(scan, track_->at.stamp);
  if (!usable) return;
  predict_to(usable->at);
  const LocalMap* local = local_maps_.about(track_->position());
  if (local == nullptr) return doubt({Evidence::nothing, "the map shows nothing there"}, scan.stamp);
  ScanMatch match = match_scan(*local, usable->scan, track_->T_world_body.T_a_b);
  ++work_.registered;
  match.T_world_body.covariance *= kAlike;
  // Off the map it may have been carried: it must show what a found place must, as nobody vouches for where it is.
  const bool is_guess = track_->to_confirm > 0, may_be_elsewhere = is_guess || state_ == State::off_map;
  const Assessment assessment =
      may_be_elsewhere ? assess_guess(match, track_->T_world_body, is_guess ? track_->gate : GuessGate::of_found())
                       : assess(match, track_->T_world_body, track_->usual_quality.value_or(0.0));
  if (assessment.evidence != Evidence::confirms) return doubt(assessment, scan.stamp);
  confirm(match);
  if (track_->to_confirm == 0) map_fit_.see(*local, usable->scan, track_->T_world_body.T_a_b);
}

void Localiser::confirm(const ScanMatch& match) {
  const bool has_searched = searches();
  track_->correct(match.T_world_body);
  track_->learn(match.quality());
  track_->against_since.reset();
  track_->doubted_since.reset();
  track_->against = 0;
  track_->confirmed = track_->at.stamp;
  track_->overlap = match.overlap;
  if (track_->to_confirm > 0 && --track_->to_confirm > 0) return;
  state_ = State::localised;
  why_ = fmt::format("{:.0f} % of the scan lies on the map, {:.0f} % contradicts it", 100.0 * match.overlap,
                     100.0 * match.contradiction);
  pending_.clear();
  places_.clear();
  if (has_searched) begin_submaps();
}

/// A scan that does not confirm the pose.
void Localiser::doubt(const Assessment& assessment, Timestamp stamp) {
  if (track_->to_confirm > 0) {  // it was a guess
    track_->to_confirm = kConfirmations;
    if (assessment.evidence == Evidence::against || stamp - track_->confirmed > kGuessedFor_s) {
      track_.reset();
      why_ = "a place that was found is not confirmed: " + assessment.why;
    }
    return;
  }
  if (!track_->doubted_since) track_->doubted_since = track_->at;
  if (assessment.evidence == Evidence::against) {
    ++track_->against;
    if (!track_->against_since) track_->against_since = stamp;
    if (stamp - *track_->against_since >= kLostAfter_s && track_->against >= 3) {
      search_anew(assessment.why);
      state_ = State::lost;
      return;
    }
  }
  const StampedPose& since = *track_->doubted_since;
  if (stamp - since.stamp < kOffMapAfter_s) return;
  if (state_ != State::off_map) begin_submaps();  // it may have been carried: what it saw before is elsewhere
  const bool stands = (since.pose.translation - track_->at.pose.translation).norm() < ShutIn::kStands_m;
  if (setup_.map->floors > 1 && stands && stamp - since.stamp >= ShutIn::kFor_s) search_anew(assessment.why);
  state_ = State::off_map;
  why_ = assessment.why;
}

void Localiser::take_submaps() {
  while (const auto submap = submaps_.take_submap()) consider(*submap);
  // The robot's agent has the same and reports them; here they would only grow.
  submaps_.take_keyframes();
  submaps_.take_scan_errors();
  submaps_.take_image_errors();
}

/// Those that a submap fits. Scans prove what clouds fit roughly; the verifier is asked about images.
Result<SearchResult> Localiser::find_places(const Submap& submap) {
  const KnownMap& map = *setup_.map;
  auto alike = most_alike(map, *verifier_, submap, static_cast<std::size_t>(setup_.config.candidates));
  const auto with_clouds = std::ranges::stable_partition(
      alike, [&](SubmapId id) { return submap.cloud == nullptr || map.submaps.at(id).size.points == 0; });
  auto found = search(map, *verifier_, submap, {alike.begin(), with_clouds.begin()});
  if (!found || with_clouds.empty()) return found;
  auto rough = rough_places(map, local_maps_, submap, {with_clouds.begin(), with_clouds.end()});
  if (!rough) return rough;
  std::ranges::move(rough->places, std::back_inserter(found->places));
  found->compared += rough->compared;
  return found;
}

/// Compares a submap with the map, where that may tell something.
void Localiser::consider(const Submap& submap) {
  if (payload_size(submap) == PayloadSize() || shut_in_.is() || !searches()) return;
  auto found = find_places(submap);
  if (!found) {
    why_ = found.error().message;
    return;
  }
  work_.compared += found->compared;
  if (state_ == State::localised)
    follow_submap(*found);
  else
    decide(std::move(*found), submap);
}

void Localiser::decide(SearchResult found, const Submap& submap) {
  if (has_scans()) {
    const auto scans = stretch_.scans();
    found.places = scans.size() < Stretch::kLeast
                       ? std::vector<Hypothesis>()
                       : all_proven(local_maps_, scans, std::move(found.places), work_.registered);
  }
  const bool knows = track_ && track_->to_confirm == 0;  // it has left the map, say
  if (found.places.empty() || found.places.front().shown == Shown::no) {
    if (!knows && state_ != State::lost)
      why_ = fmt::format("none of the {} submaps of the map that look most alike shows what it saw", found.compared);
    if (!knows) places_.clear();
    if (!knows && state_ == State::ambiguous) state_ = State::searching;
    return;
  }
  const Pose3& T_odom_body = submap.keyframes.back().T_odom_body;
  const auto was_seen = [&](const Hypothesis& place) {
    return std::ranges::any_of(pending_, [&](const Hypothesis& p) { return is_same_place(p, place, T_odom_body); });
  };
  Hypothesis& best = found.places.front();
  const std::vector<Hypothesis> rivals = found.rivals();
  if (rivals.empty() && (best.shown == Shown::surely || was_seen(best))) {
    pending_.assign(1, best);  // should scans not confirm it, the next submap may
    return begin_track(best);
  }
  if (!knows) {
    places_.clear();
    state_ = rivals.empty() ? State::searching : State::ambiguous;
    why_ = rivals.empty() ? "it may be in one place, and its next submap is to show the same"
                          : fmt::format("{} places fit what it saw", rivals.size() + 1);
    const auto name = [&](const Hypothesis& place) {
      places_.push_back({place.submap, place.floor, place.T_world_odom() * T_odom_body});
    };
    if (!rivals.empty()) name(best);
    std::ranges::for_each(rivals, name);
  }
  pending_.assign(1, best);
  pending_.insert(pending_.end(), rivals.begin(), rivals.end());
  if (pending_.size() > kMostPending) pending_.resize(kMostPending);
}

/// Goes on from a place that was found, which scans have to confirm; without scans it counts.
void Localiser::begin_track(const Hypothesis& place) {
  const StampedPose& now = recent_.poses().back();
  track_ = Track{.floor = place.floor,
                 .T_world_body = carried_to(now.pose, place),
                 .at = now,
                 .confirmed = now.stamp,
                 .to_confirm = has_scans() ? kConfirmations : 0};
  if (has_scans()) {
    state_ = State::searching;
    why_ = "a place was found, which scans are to confirm";
    return;
  }
  state_ = State::localised;
  why_ = fmt::format("{} submaps of the map show what it saw", place.accepted);
  pending_.clear();
  places_.clear();
}

/// A robot without scans: its submaps say whether it is still where it should be.
void Localiser::follow_submap(const SearchResult& found) {
  predict_to(recent_.poses().back());
  const Hypothesis here{.floor = track_->floor, .T_world_body = track_->T_world_body, .at = track_->at};
  for (const Hypothesis& place : found.places) {
    if (place.shown == Shown::no) break;
    if (!is_same_place(here, place, track_->at.pose)) {
      if (place.shown != Shown::surely || !found.rivals().empty()) continue;
      search_anew(fmt::format("{} submaps of the map show it elsewhere", place.accepted));
      state_ = State::lost;
      return;
    }
    track_->correct(carried_to(track_->at.pose, place));
    track_->confirmed = track_->at.stamp;
    why_ = fmt::format("{} submaps of the map show what it saw", place.accepted);
    return;
  }
  if (track_->at.stamp - track_->confirmed <= kCameraAge_s) return;
  state_ = State::off_map;
  why_ = "no submap of the map shows what it saw";
}

State Localiser::state() const {
  const auto newest = recent_.newest();
  const bool is_silent = has_scans() && newest && newest->stamp - *last_scan_ > kScanSilence_s;
  return state_ == State::localised && is_silent ? State::stale : state_;
}

Located Localiser::located() const {
  Located out{.state = state(), .why = why_, .places = places_};
  const auto newest = recent_.newest();
  if (!newest) return out;
  out.stamp = newest->stamp;
  if (!track_ || track_->to_confirm > 0) return out;
  out.floor = track_->floor;
  RelativePose pose = track_->carried_to(newest->T_odom_body);
  pose.covariance += diagonal_covariance(kMap_m, kMap_rad);
  out.age_s = out.stamp - track_->confirmed;
  out.overlap = track_->overlap;
  if (out.state == State::stale) out.why = fmt::format("no scan has come for {:.1f} s", out.stamp - *last_scan_);
  out.T_world_body = std::move(pose);
  return out;
}

LocaliserWork Localiser::work() const {
  LocaliserWork out = work_;
  out.local_maps = local_maps_.made();
  out.extracted = local_maps_.extracted();
  return out;
}

}  // namespace tutti::localise
