// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/bundle/guided_matches.hpp"

#include <algorithm>
#include <map>
#include <optional>

#include "tutti/perception/visual/hamming.hpp"

namespace tutti::bundle {
namespace {

/// Rows of the descriptors of every landmark.
using LandmarkRows = std::vector<std::vector<std::uint32_t>>;

LandmarkRows rows_of(const VisualPayload& visual) {
  LandmarkRows out(visual.landmarks.size());
  for (const auto& frame : visual.frames)
    for (const auto& view : frame.observations)
      if (view.landmark < out.size() && view.descriptor < visual.descriptors.size())
        out[view.landmark].push_back(view.descriptor);
  return out;
}

/// An image of a submap, its views of landmarks by their column, each with a descriptor: its own, or one of its
/// landmark's.
struct Image {
  Pose3 T_camera_world;
  const CameraModel* camera = nullptr;
  std::vector<Observation> views;
};

std::vector<Image> images_of(const PosedSubmap& posed, const LandmarkRows& rows) {
  const VisualPayload& visual = *posed.submap->visual;
  std::vector<Image> out;
  for (const auto& frame : visual.frames) {
    const std::uint32_t k = frame.keyframe - posed.submap->keyframes.front().index;
    if (k >= posed.T_world_body.size() || frame.camera >= visual.cameras.size()) continue;
    const Camera& camera = visual.cameras[frame.camera];
    Image image{(posed.T_world_body[k] * camera.T_body_camera).inverse(), &camera.model, {}};
    for (Observation view : frame.observations) {
      if (view.landmark >= visual.landmarks.size() || rows[view.landmark].empty()) continue;
      if (view.descriptor >= visual.descriptors.size()) view.descriptor = rows[view.landmark].front();
      image.views.push_back(view);
    }
    std::sort(image.views.begin(), image.views.end(),
              [](const Observation& a, const Observation& b) { return a.pixel.x() < b.pixel.x(); });
    out.push_back(std::move(image));
  }
  return out;
}

/// A submap with a payload, ready to be matched with any other.
struct Prepared {
  explicit Prepared(const PosedSubmap& its) : posed(its), visual(*its.submap->visual) {}

  const PosedSubmap& posed;
  const VisualPayload& visual;
  LandmarkRows rows = rows_of(visual);
  std::vector<Image> images = images_of(posed, rows);
};

class PairMatcher {
 public:
  PairMatcher(const Prepared& one, const Prepared& other, const GuidedMatchConfig& config)
      : one_(one), other_(other), config_(config) {
    for (const auto& image : other.images) match_in(image);
  }

  /// Landmarks that name each other.
  [[nodiscard]] std::vector<std::pair<std::uint32_t, std::uint32_t>> mutual() const {
    std::map<std::uint32_t, std::pair<int, std::uint32_t>> best_of_one, best_of_other;
    for (const auto& [pair, votes] : votes_) {
      auto& of_one = best_of_one[pair.first];
      if (votes > of_one.first) of_one = {votes, pair.second};
      auto& of_other = best_of_other[pair.second];
      if (votes > of_other.first) of_other = {votes, pair.first};
    }
    std::vector<std::pair<std::uint32_t, std::uint32_t>> out;
    for (const auto& [l, best] : best_of_one)
      if (best_of_other.at(best.second).second == l) out.emplace_back(l, best.second);
    return out;
  }

 private:
  void match_in(const Image& image) {
    for (std::uint32_t l = 0; l < one_.rows.size(); ++l) {
      if (one_.rows[l].empty()) continue;
      const Eigen::Vector3d p_world =
          one_.posed.T_world_body.front() * one_.visual.landmarks[l].position.cast<double>();
      const auto pixel = project(*image.camera, image.T_camera_world * p_world);
      if (!pixel || !in_image(*image.camera, *pixel)) continue;
      if (const auto match = best_view(image, *pixel, one_.rows[l])) ++votes_[{l, *match}];
    }
  }

  /// The landmark of the view near the pixel that looks like one of `rows` and no other's view does nearly as much.
  [[nodiscard]] std::optional<std::uint32_t> best_view(const Image& image, const Eigen::Vector2d& pixel,
                                                       const std::vector<std::uint32_t>& rows) const {
    const auto at = pixel.cast<float>();
    const auto radius = static_cast<float>(config_.radius_px);
    const auto left = std::partition_point(image.views.begin(), image.views.end(),
                                           [&](const Observation& v) { return v.pixel.x() < at.x() - radius; });
    const Descriptors &ours = one_.visual.descriptors, &theirs = other_.visual.descriptors;
    std::uint32_t best = visual::kNoDistance, second = best;
    std::uint32_t landmark = kNoIndex;
    for (auto view = left; view != image.views.end() && view->pixel.x() <= at.x() + radius; ++view) {
      if ((view->pixel - at).norm() > radius) continue;
      const auto distance = visual::least_distance(theirs.row(view->descriptor), ours, rows);
      if (distance < best) {
        if (view->landmark != landmark) second = best;
        best = distance;
        landmark = view->landmark;
      } else if (view->landmark != landmark) {
        second = std::min(second, distance);
      }
    }
    const double bits = 64.0 * ours.words;
    if (best > config_.max_hamming * bits || best > config_.max_hamming_ratio * second) return std::nullopt;
    return landmark;
  }

  const Prepared& one_;
  const Prepared& other_;
  const GuidedMatchConfig& config_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> votes_;
};

bool are_comparable(const Submap& a, const Submap& b) {
  return a.visual && b.visual && a.visual->descriptors.kind == b.visual->descriptors.kind &&
         a.visual->descriptors.words == b.visual->descriptors.words;
}

}  // namespace

std::vector<LandmarkMatch> guided_matches(std::span<const PosedSubmap> submaps, std::span<const SubmapPair> pairs,
                                          const GuidedMatchConfig& config) {
  std::map<SubmapId, const PosedSubmap*> by_id;
  for (const auto& posed : submaps) by_id[posed.submap->id] = &posed;
  std::map<SubmapId, Prepared> prepared;
  const auto prepare = [&](const PosedSubmap& posed) -> const Prepared& {
    return prepared.try_emplace(posed.submap->id, posed).first->second;
  };
  std::vector<LandmarkMatch> out;
  for (const auto& pair : pairs) {
    const auto first = by_id.find(pair.first);
    const auto second = by_id.find(pair.second);
    if (first == by_id.end() || second == by_id.end()) continue;
    if (!are_comparable(*first->second->submap, *second->second->submap)) continue;
    for (const auto& [l, m] : PairMatcher(prepare(*first->second), prepare(*second->second), config).mutual())
      out.push_back({{pair.first, l}, {pair.second, m}});
  }
  return out;
}

}  // namespace tutti::bundle
