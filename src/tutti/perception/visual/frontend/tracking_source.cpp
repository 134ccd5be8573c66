// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/frontend/tracking_source.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/model/nearest_stamp.hpp"
#include "tutti/perception/visual/stereo_check.hpp"

namespace tutti::visual {
namespace {

/// The index of the stamp nearest to `stamp`, of at least one.
std::size_t nearest(const std::vector<Timestamp>& stamps, Timestamp stamp) {
  constexpr double kAnyDifference_s = std::numeric_limits<double>::infinity();
  return static_cast<std::size_t>(nearest_in_time(stamps, stamp, kAnyDifference_s, std::identity()) - stamps.begin());
}

/// Are most samples within the stream images' stamps, or most images within the odometry samples'?
/// Where not, the offset of their clock by the motion in the images (ClockCheck::offset_s) is asked for.
Status check_stamps(const std::vector<Timestamp>& stamps, const Trajectory& odometry, double tolerance_s,
                    const std::function<std::optional<double>()>& by_motion) {
  if (stamps.empty() || odometry.empty())
    return fail(ErrorCode::invalid, "{} images and {} odometry samples, expected some of each", stamps.size(),
                odometry.size());
  const Timestamp begin = odometry.front().stamp, end = odometry.back().stamp;
  std::vector<double> offsets;  // odometry minus image, of the samples while there are images
  for (const StampedPose& sample : odometry)
    if (stamps.front() - tolerance_s <= sample.stamp && sample.stamp <= stamps.back() + tolerance_s)
      offsets.push_back(sample.stamp - stamps[nearest(stamps, sample.stamp)]);
  if (offsets.empty())
    return fail(ErrorCode::invalid,
                "images from {} to {} ns and odometry from {} to {} ns have no moment in common: the images begin "
                "{:.3f} s {} the odometry; is that the offset of their clocks?",
                stamps.front().ns, stamps.back().ns, begin.ns, end.ns, std::abs(begin - stamps.front()),
                begin < stamps.front() ? "after" : "before");
  const auto images = static_cast<std::size_t>(std::ranges::count_if(
      stamps, [&](Timestamp stamp) { return begin - tolerance_s <= stamp && stamp <= end + tolerance_s; }));
  const auto matched = static_cast<std::size_t>(
      std::ranges::count_if(offsets, [&](double offset) { return std::abs(offset) <= tolerance_s; }));
  const std::size_t possible = std::min(images, offsets.size());
  if (2 * matched >= possible) return {};
  const auto quantile = [&](double share) {
    const auto at = offsets.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(offsets.size() - 1));
    std::ranges::nth_element(offsets, at);
    return *at;
  };
  const double nearest_s = quantile(0.5), gap_s = typical_gap_s(stamps);
  const std::string found = fmt::format("of {} odometry samples that could have an image {} have one within {} s",
                                        possible, matched, tolerance_s);
  if (const auto moved_s = by_motion()) {
    // Whole gaps between images more bring them to samples, too: those that the motion asks for.
    const double whole_s = nearest_s + gap_s * std::round((*moved_s - nearest_s) / std::max(gap_s, 1e-6));
    const double advice_s = std::abs(whole_s - *moved_s) <= ClockCheck::kStep_s ? whole_s : *moved_s;
    return fail(ErrorCode::invalid,
                "{}; points move through the images as if these were taken {:.2f} s {} their stamps: to come to the "
                "odometry's clock, add {:.4f} s to them?",
                found, std::abs(*moved_s), *moved_s > 0.0 ? "after" : "before", advice_s);
  }
  return fail(ErrorCode::invalid,
              "{}: to come to the nearest sample, add {:.4f} or {:.4f} s to the images' stamps (medians; {:.4f} to "
              "{:.4f} for the middle half of the former), which is the offset of their clocks or none; the stamps do "
              "not tell, nor does what moves in the images",
              found, nearest_s, nearest_s + (nearest_s > 0.0 ? -gap_s : gap_s), quantile(0.25), quantile(0.75));
}

/// Follows the images at their own stamps as far as it takes to see by how much their clock is off; images that cannot
/// be read are passed over.
std::optional<double> watched_offset_s(const ImageStream& stream, const Trajectory& odometry,
                                       const TrackerConfig& config) {
  const std::vector<Camera> first(1, stream.cameras.front());
  VisualTracker tracker(first, config);
  ClockCheck clock(first.front());
  for (std::size_t instant = 0; instant < stream.stamps.size() && clock.pairs() < ClockCheck::kPairs; ++instant) {
    const Timestamp stamp = stream.stamps[instant];
    if (stamp < odometry.front().stamp || stamp > odometry.back().stamp) continue;
    const auto image = stream.load(instant, 0);
    if (!image || !check_sizes({&*image, 1}, first)) continue;
    const auto tracked = tracker.track({&*image, 1}, false);
    if (!tracked.empty()) clock.add(stamp, tracked.front());
  }
  return clock.offset_s(odometry);
}

/// The turn by what both cameras see at a few times spread over the recording, wherever the calibration expects it.
std::optional<StereoTurn> watched_turn(const ImageStream& stream, const Trajectory& odometry, TrackerConfig config) {
  constexpr std::size_t kInstants = 12;
  constexpr double kWide_rad = 0.06;  // a turn of more is no slip, and points are not found where they are looked for
  config.epipolar_px = kWide_rad * stream.cameras[1].model.fx;
  VisualTracker tracker(stream.cameras, config);
  StereoCheck check(stream.cameras[0], stream.cameras[1]);
  const auto begin = nearest(stream.stamps, odometry.front().stamp),
             end = nearest(stream.stamps, odometry.back().stamp);
  for (std::size_t i = 0; i < kInstants; ++i) {
    const std::size_t instant = begin + i * (end - begin) / (kInstants - 1);
    const auto first = stream.load(instant, 0), second = stream.load(instant, 1);
    if (!first || !second || first->empty() || second->empty()) continue;
    const std::vector<Image> images{*first, *second};
    if (!check_sizes(images, stream.cameras)) continue;
    tracker.restart(0);
    const auto tracked = tracker.track(images, false);
    check.add(tracked[0], tracked[1]);
    if (end - begin < kInstants && instant == end) break;
  }
  return check.turn();
}

/// Takes the second camera away, or turns it, where the images contradict its calibration: what to report then.
std::optional<Error> judge_turn(ImageStream& stream, const Trajectory& odometry, const TrackingConfig& config) {
  const auto turn = watched_turn(stream, odometry, config.tracker);
  if (!turn || !turn->is_wrong) return std::nullopt;
  const bool correct = turn->is_turned && config.turned_stereo == "correct";
  const Eigen::Vector3d deg = turn->turn_rad / kRadPerDeg,
                        sigma_deg = turn->covariance.diagonal().cwiseSqrt() / kRadPerDeg;
  if (correct) {
    Eigen::Quaterniond& rotation = stream.cameras[1].T_body_camera.rotation;
    rotation = (rotation * so3_exp(turn->turn_rad)).normalized();
  } else {
    stream.cameras.resize(1);
  }
  const std::string what =
      fmt::format("what both cameras see is {:.2f} px off its epipolar lines (median)", turn->stated_px);
  const std::string then = correct ? "it is turned so" : "it is not used (tracking.turned_stereo)";
  if (!turn->is_turned)
    return Error{ErrorCode::invalid, fmt::format("{}, {:.2f} however the second one is turned: check focal lengths, "
                                                 "distortion and T_body_camera of both; {}",
                                                 what, turn->turned_px, then)};
  return Error{
      ErrorCode::invalid,
      fmt::format("the second camera is turned against its T_body_camera by [{:.2f} {:.2f} {:.2f}] degrees, "
                  "+-[{:.2f} {:.2f} {:.2f}]: {}, {:.2f} once it is turned; {}",
                  deg.x(), deg.y(), deg.z(), sigma_deg.x(), sigma_deg.y(), sigma_deg.z(), what, turn->turned_px, then)};
}

}  // namespace

Result<std::shared_ptr<TrackingSource>> TrackingSource::open(ImageStream stream, Trajectory odometry,
                                                             const TrackingConfig& config) {
  const auto depth = [&] { return stream.load_depth ? std::optional(stream.depth) : std::nullopt; };
  if (const auto ok = ImageTracker::make(stream.cameras, depth(), config.tracker); !ok)
    return tl::unexpected(ok.error());
  const auto by_motion = [&] { return watched_offset_s(stream, odometry, config.tracker); };
  if (auto ok = check_stamps(stream.stamps, odometry, config.max_stamp_difference_s, by_motion); !ok)
    return tl::unexpected(ok.error());
  std::optional<Error> turned;
  if (stream.cameras.size() == 2 && config.turned_stereo != "believe") turned = judge_turn(stream, odometry, config);
  auto tracker = ImageTracker::make(stream.cameras, depth(), config.tracker);  // of what is left of them
  if (!tracker) return tl::unexpected(tracker.error());
  std::shared_ptr<TrackingSource> out(
      new TrackingSource(std::move(stream), std::move(odometry), config, std::move(*tracker)));
  if (turned) out->errors_.push_back(*std::move(turned));
  return out;
}

TrackingSource::TrackingSource(ImageStream stream, Trajectory odometry, const TrackingConfig& config,
                               std::unique_ptr<ImageTracker> tracker)
    : stream_(std::move(stream)),
      odometry_(std::move(odometry)),
      config_(config),
      tracker_(std::move(tracker)),
      clock_(stream_.cameras.front()) {}

TrackedImages TrackingSource::images(std::size_t sample, bool keyframe) {
  TUTTI_CHECK(sample < odometry_.size(), "sample {} of {}", sample, odometry_.size());
  const Timestamp stamp = odometry_[sample].stamp;
  TrackedImages out{.stamp = stamp, .cameras = tracker_->cameras(), .images = {}};
  const std::size_t instant = nearest(stream_.stamps, stamp);
  // Images since the last sample carry the tracks; those before a first one are not needed.
  const bool follows = sample > 0 && sample == next_sample_;
  if (!follows && instant >= next_instant_) {
    next_instant_ = instant;
    tracker_->restart(instant);
  }
  next_sample_ = std::max(next_sample_, sample + 1);
  for (; next_instant_ < instant && stream_.stamps[next_instant_] < stamp; ++next_instant_)
    static_cast<void>(track(next_instant_, false));
  const bool is_of_sample = std::abs(stream_.stamps[instant] - stamp) <= config_.max_stamp_difference_s;
  if (!is_of_sample || instant < next_instant_) return out;
  next_instant_ = instant + 1;
  out.images = track(instant, keyframe);
  if (sample + 1 == odometry_.size() || clock_.pairs() == ClockCheck::kPairs) check_clock();
  return out;
}

void TrackingSource::check_clock() {
  if (std::exchange(clock_checked_, true)) return;
  if (const auto offset_s = clock_.offset_s(odometry_))
    errors_.push_back(
        {ErrorCode::invalid, fmt::format("points move through the images as if these were taken "
                                         "{:.2f} s {} their stamps: to come to the odometry's clock, "
                                         "add {:.2f} s to them?",
                                         std::abs(*offset_s), *offset_s > 0.0 ? "after" : "before", *offset_s)});
  else if (const auto roll_deg = clock_.roll_deg(odometry_))
    errors_.push_back({ErrorCode::invalid,
                       fmt::format("points move through the images as if the camera was turned by {} degrees about its "
                                   "optical axis against T_body_camera",
                                   *roll_deg)});
}

std::vector<TrackedImage> TrackingSource::track(std::size_t instant, bool keyframe) {
  SeenImages seen{.stamp = stream_.stamps[instant], .instant = instant, .images = {}};
  for (std::size_t camera = 0; camera < stream_.cameras.size(); ++camera)
    seen.images.push_back(stream_.load(instant, camera));
  if (stream_.load_depth) seen.load_depth = [&] { return stream_.load_depth(instant); };
  auto tracked = tracker_->track(seen, keyframe);
  for (Error& error : tracker_->take_errors()) errors_.push_back(std::move(error));
  if (!tracked.empty()) clock_.add(seen.stamp, tracked.front());
  return tracked;
}

}  // namespace tutti::visual
