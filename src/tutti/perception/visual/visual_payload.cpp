// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/visual_payload.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <queue>
#include <utility>

#include "tutti/geometry/symmetric.hpp"
#include "tutti/perception/visual/hamming.hpp"

namespace tutti::visual {
namespace {

// About what each takes on the wire.
constexpr double kLandmarkBytes = 8.0, kObservationBytes = 8.0, kBytesPerWord = 8.0;

/// An image with what belongs to it.
struct Image {
  std::uint32_t keyframe;
  const TrackedImage* tracked;
  const Camera* camera;
  Pose3 T_camera_submap;
  double turn_variance_rad2, shift_variance_m2;
};

/// A keypoint: of which image, which one.
struct Seen {
  std::uint32_t image;
  std::uint32_t keypoint;
};

struct Found {
  Landmark landmark;
  std::vector<Seen> seen;
};

Status check_image(const TrackedImage& image, const std::vector<Camera>& cameras) {
  if (image.camera >= cameras.size()) return fail(ErrorCode::invalid, "camera {} of {}", image.camera, cameras.size());
  const Descriptors& descriptors = image.descriptors;
  if (descriptors.size() != 0 && descriptors.size() != image.keypoints.size())
    return fail(ErrorCode::invalid, "{} descriptors of {} keypoints", descriptors.size(), image.keypoints.size());
  for (const TrackedKeypoint& keypoint : image.keypoints) {
    if (!keypoint.pixel.allFinite() || !in_image(cameras[image.camera].model, keypoint.pixel.cast<double>()))
      return fail(ErrorCode::invalid, "keypoint at ({}, {}) is not in the image", keypoint.pixel.x(),
                  keypoint.pixel.y());
    if (!std::isfinite(keypoint.sigma_px) || keypoint.sigma_px <= 0.0F)
      return fail(ErrorCode::invalid, "keypoint with a standard deviation of {} px", keypoint.sigma_px);
  }
  return {};
}

/// By keyframe, then by camera, as the payload has them.
Result<std::vector<Image>> flatten(std::span<const KeyframeImages> keyframes, const std::vector<Camera>& cameras) {
  std::vector<Image> out;
  for (const KeyframeImages& keyframe : keyframes) {
    if (!is_valid(keyframe.T_submap_body)) return fail(ErrorCode::invalid, "keyframe {}: no pose", keyframe.keyframe);
    for (const TrackedImage& image : keyframe.images) {
      if (auto ok = check_image(image, cameras); !ok)
        return in_context(fmt::format("keyframe {}, image of camera {}", keyframe.keyframe, image.camera), ok.error());
      const Camera& camera = cameras[image.camera];
      out.push_back({keyframe.keyframe, &image, &camera, (keyframe.T_submap_body * camera.T_body_camera).inverse(),
                     keyframe.turn_variance_rad2, keyframe.shift_variance_m2});
    }
  }
  const auto key = [](const Image& image) { return std::pair(image.keyframe, image.tracked->camera); };
  std::ranges::sort(out, {}, key);
  const auto twice = std::ranges::adjacent_find(out, {}, key);
  if (twice != out.end())
    return fail(ErrorCode::invalid, "keyframe {}: two images of camera {}", twice->keyframe, twice->tracked->camera);
  return out;
}

/// The one kind of all descriptors; no bits yet.
Result<Descriptors> common_kind(const std::vector<Image>& images) {
  Descriptors out;
  for (const Image& image : images) {
    const Descriptors& its = image.tracked->descriptors;
    if (its.size() == 0) continue;
    if (out.words == 0) out = {.kind = its.kind, .words = its.words};
    if (its.kind != out.kind || its.words != out.words)
      return fail(ErrorCode::invalid, "keyframe {}: descriptors of another kind than before", image.keyframe);
  }
  return out;
}

Result<std::map<std::uint64_t, std::vector<Seen>>> tracks_of(const std::vector<Image>& images) {
  std::map<std::uint64_t, std::vector<Seen>> out;
  for (std::uint32_t i = 0; i < images.size(); ++i) {
    const auto& keypoints = images[i].tracked->keypoints;
    for (std::uint32_t k = 0; k < keypoints.size(); ++k) {
      if (keypoints[k].track == 0) continue;
      auto& seen = out[keypoints[k].track];
      if (!seen.empty() && seen.back().image == i)
        return fail(ErrorCode::invalid, "keyframe {}: track {} twice in the image of camera {}", images[i].keyframe,
                    keypoints[k].track, images[i].tracked->camera);
      seen.push_back({i, k});
    }
  }
  return out;
}

Landmark to_landmark(const TriangulatedPoint& point) {
  return {point.position.cast<float>(), static_cast<float>(largest_sigma(point.covariance))};
}

/// The reprojection errors of a track's views, and those that pixels and odometry explain: root mean squares.
struct TrackResidual {
  std::size_t views;
  double rms_px, expected_px;
};

/// Infinite where the views fit no point.
constexpr double kNoFit_px = std::numeric_limits<double>::infinity();

TrackResidual residual_of(const std::vector<View>& views, const std::vector<Seen>& seen,
                          const std::vector<Image>& images, const TriangulatedPoint& point) {
  constexpr double kBehind_px = 1e3;  // where it ought to be seen and cannot be
  TrackResidual out{views.size(), 0.0, 0.0};
  const Image& middle = images[seen[seen.size() / 2].image];
  for (std::size_t v = 0; v < views.size(); ++v) {
    const View& view = views[v];
    const Eigen::Vector3d in_camera = view.T_camera_submap * point.position;
    const auto pixel = project(*view.camera, in_camera);
    out.rms_px += pixel ? (*pixel - view.pixel).squaredNorm() : kBehind_px * kBehind_px;
    const Image& image = images[seen[v].image];
    const double turn_rad2 = std::abs(image.turn_variance_rad2 - middle.turn_variance_rad2);
    const double shift_m2 = std::abs(image.shift_variance_m2 - middle.shift_variance_m2);
    const double focal_px2 = view.camera->fx * view.camera->fx;
    out.expected_px +=
        2.0 * (view.sigma_px * view.sigma_px + focal_px2 * (turn_rad2 + shift_m2 / in_camera.squaredNorm()));
  }
  const auto n = static_cast<double>(views.size());
  out.rms_px = std::sqrt(out.rms_px / n);
  out.expected_px = std::sqrt(out.expected_px / n);
  return out;
}

/// Any two views fit nearly any calibration: tracks of more decide where there are enough.
Status check_residuals(std::vector<TrackResidual> residuals, const VisualSubmapConfig& config) {
  constexpr std::size_t kEnough = 20;
  const auto more = std::ranges::partition(residuals, [](const TrackResidual& it) { return it.views < 3; });
  if (more.size() >= kEnough) residuals.erase(residuals.begin(), more.begin());
  if (residuals.empty()) return {};
  const auto median = [&](auto member) {
    const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
    std::ranges::nth_element(residuals, middle, {}, member);
    return (*middle).*member;
  };
  constexpr const char* kWhy = "calibration, camera pose on the body, stamps or odometry are wrong";
  const double rms_px = median(&TrackResidual::rms_px);
  if (rms_px == kNoFit_px)
    return fail(ErrorCode::invalid, "half of {} tracks fit no point within {} px: {}", residuals.size(),
                config.triangulation.max_reprojection_px, kWhy);
  std::erase_if(residuals, [](const TrackResidual& it) { return it.rms_px == kNoFit_px; });
  const double expected_px = median(&TrackResidual::expected_px);
  if (rms_px <= std::max(config.max_residual_px, 2.0 * expected_px)) return {};
  return fail(ErrorCode::invalid,
              "landmarks miss their pixels by {:.1f} px (median of {} tracks), expected {:.1f} px by the odometry's "
              "covariance and at most {:.1f}: {}",
              rms_px, residuals.size(), expected_px, std::max(config.max_residual_px, 2.0 * expected_px), kWhy);
}

Result<std::vector<Found>> find_landmarks(const std::vector<Image>& images, const VisualSubmapConfig& config) {
  const auto tracks = tracks_of(images);
  if (!tracks) return tl::unexpected(tracks.error());
  std::vector<Found> out;
  std::vector<TrackResidual> residuals;
  for (const auto& [track, seen] : *tracks) {
    if (seen.size() < static_cast<std::size_t>(config.triangulation.min_views)) continue;
    std::vector<View> views;
    for (const Seen& s : seen) {
      const Image& image = images[s.image];
      const TrackedKeypoint& keypoint = image.tracked->keypoints[s.keypoint];
      views.push_back({&image.camera->model, image.T_camera_submap, keypoint.pixel.cast<double>(), keypoint.sigma_px});
    }
    const auto point = triangulate(views, config.triangulation);
    if (!point) {
      if (point.error() == TriangulationFault::misfit) residuals.push_back({views.size(), kNoFit_px, 0.0});
      continue;
    }
    residuals.push_back(residual_of(views, seen, images, *point));
    Found found{to_landmark(*point), {}};
    for (std::size_t v = 0; v < seen.size(); ++v)
      if (point->fits[v]) found.seen.push_back(seen[v]);
    out.push_back(std::move(found));
  }
  if (auto ok = check_residuals(std::move(residuals), config); !ok) return tl::unexpected(ok.error());
  return out;
}

bool has_descriptors(const Image& image) { return image.tracked->descriptors.size() != 0; }

std::size_t descriptors_kept(const Found& found, const std::vector<Image>& images, bool one) {
  const auto n = static_cast<std::size_t>(
      std::ranges::count_if(found.seen, [&](const Seen& s) { return has_descriptors(images[s.image]); }));
  return one ? std::min<std::size_t>(n, 1) : n;
}

/// Which landmarks to keep; takes from `bytes` what they need.
std::vector<bool> choose(const std::vector<Found>& found, const std::vector<Image>& images, double descriptor_bytes,
                         bool one_descriptor, double& bytes) {
  std::vector<std::uint32_t> kept_in(images.size(), 0);
  const auto gain = [&](std::size_t i) {
    double sum = 0.0;
    for (const Seen& s : found[i].seen) sum += 1.0 / (1.0 + kept_in[s.image]);
    return sum;
  };
  std::vector<bool> kept(found.size(), false);
  std::priority_queue<std::pair<double, std::size_t>> queue;  // gains only shrink: the first that keeps its own is best
  for (std::size_t i = 0; i < found.size(); ++i) queue.emplace(gain(i), i);
  while (!queue.empty()) {
    const auto [promised, i] = queue.top();
    queue.pop();
    if (const double now = gain(i); now < promised) {
      queue.emplace(now, i);
      continue;
    }
    const auto descriptors = static_cast<double>(descriptors_kept(found[i], images, one_descriptor));
    const double needed =
        kLandmarkBytes + kObservationBytes * static_cast<double>(found[i].seen.size()) + descriptor_bytes * descriptors;
    if (needed > bytes) continue;
    bytes -= needed;
    kept[i] = true;
    for (const Seen& s : found[i].seen) ++kept_in[s.image];
  }
  return kept;
}

/// The view whose descriptor differs least from all the others'; nothing when there are none.
const Seen* most_typical(const Found& found, const std::vector<Image>& images) {
  const auto row = [&](const Seen& s) { return images[s.image].tracked->descriptors.row(s.keypoint); };
  const Seen* best = nullptr;
  std::uint64_t least = ~std::uint64_t{0};
  for (const Seen& s : found.seen) {
    if (!has_descriptors(images[s.image])) continue;
    std::uint64_t sum = 0;
    for (const Seen& other : found.seen)
      if (has_descriptors(images[other.image])) sum += hamming_distance(row(s), row(other));
    if (sum >= least) continue;
    least = sum;
    best = &s;
  }
  return best;
}

/// How much of a keypoint is kept.
struct Fate {
  std::uint32_t found = kNoIndex;
  bool descriptor = false;
};

std::vector<std::vector<Fate>> decide(const std::vector<Found>& found, const std::vector<bool>& kept,
                                      const std::vector<Image>& images, bool one_descriptor) {
  std::vector<std::vector<Fate>> out;
  for (const Image& image : images)
    out.emplace_back(image.tracked->keypoints.size(), Fate{kNoIndex, has_descriptors(image) && !one_descriptor});
  for (std::uint32_t i = 0; i < found.size(); ++i) {
    if (!kept[i]) continue;
    for (const Seen& s : found[i].seen) out[s.image][s.keypoint].found = i;
    if (!one_descriptor) continue;
    if (const Seen* typical = most_typical(found[i], images)) out[typical->image][typical->keypoint].descriptor = true;
  }
  return out;
}

/// Frames with landmarks numbered in the order of their first view, and at most `others` keypoints without one each.
void fill(VisualPayload& payload, const std::vector<Image>& images, const std::vector<Found>& found,
          const std::vector<std::vector<Fate>>& fates, std::size_t others) {
  std::vector<std::uint32_t> number(found.size(), kNoIndex);
  for (std::size_t i = 0; i < images.size(); ++i) {
    const TrackedImage& tracked = *images[i].tracked;
    VisualFrame frame{images[i].keyframe, tracked.camera, {}};
    std::size_t room = others;
    for (std::size_t k = 0; k < tracked.keypoints.size(); ++k) {
      const Fate& fate = fates[i][k];
      if (fate.found == kNoIndex && (room == 0 || !fate.descriptor)) continue;
      Observation observation{tracked.keypoints[k].pixel, tracked.keypoints[k].sigma_px, kNoIndex, kNoIndex};
      if (fate.found == kNoIndex) {
        --room;
      } else {
        if (number[fate.found] == kNoIndex) {
          number[fate.found] = static_cast<std::uint32_t>(payload.landmarks.size());
          payload.landmarks.push_back(found[fate.found].landmark);
        }
        observation.landmark = number[fate.found];
      }
      if (fate.descriptor) {
        observation.descriptor = static_cast<std::uint32_t>(payload.descriptors.size());
        const auto row = tracked.descriptors.row(k);
        payload.descriptors.bits.insert(payload.descriptors.bits.end(), row.begin(), row.end());
      }
      frame.observations.push_back(observation);
    }
    payload.frames.push_back(std::move(frame));
  }
}

}  // namespace

Result<VisualPayload> make_visual_payload(std::span<const KeyframeImages> keyframes, const std::vector<Camera>& cameras,
                                          const VisualSubmapConfig& config) {
  const auto images = flatten(keyframes, cameras);
  if (!images) return tl::unexpected(images.error());
  auto descriptors = common_kind(*images);
  if (!descriptors) return tl::unexpected(descriptors.error());
  const auto found = find_landmarks(*images, config);
  if (!found) return tl::unexpected(found.error());

  const bool one = config.one_descriptor_per_landmark;
  const double descriptor_bytes = kBytesPerWord * descriptors->words;
  double bytes = 1e3 * config.budget_kb;
  const auto kept = choose(*found, *images, descriptor_bytes, one, bytes);
  const auto fates = decide(*found, kept, *images, one);
  const double each = (kObservationBytes + descriptor_bytes) * std::max(1.0, static_cast<double>(images->size()));
  VisualPayload payload{.cameras = cameras, .descriptors = std::move(*descriptors)};
  fill(payload, *images, *found, fates, static_cast<std::size_t>(bytes / each));
  return payload;
}

}  // namespace tutti::visual
