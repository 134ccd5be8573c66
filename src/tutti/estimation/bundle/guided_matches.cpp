// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/bundle/guided_matches.hpp"

#include <algorithm>
#include <bit>
#include <limits>
#include <map>
#include <optional>

namespace tutti::bundle {
namespace {

int hamming(std::span<const std::uint64_t> a, std::span<const std::uint64_t> b) {
  int bits = 0;
  for (std::size_t w = 0; w < a.size(); ++w) bits += std::popcount(a[w] ^ b[w]);
  return bits;
}

/// Rows of the descriptors of every landmark.
std::vector<std::vector<std::uint32_t>> descriptors_of(const VisualPayload& visual) {
  std::vector<std::vector<std::uint32_t>> out(visual.landmarks.size());
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

std::vector<Image> images_of(const PosedSubmap& posed) {
  const VisualPayload& visual = *posed.submap->visual;
  const auto descriptors = descriptors_of(visual);
  std::vector<Image> out;
  for (const auto& frame : visual.frames) {
    const std::uint32_t k = frame.keyframe - posed.submap->keyframes.front().index;
    if (k >= posed.T_world_body.size() || frame.camera >= visual.cameras.size()) continue;
    const Camera& camera = visual.cameras[frame.camera];
    Image image{(posed.T_world_body[k] * camera.T_body_camera).inverse(), &camera.model, {}};
    for (Observation view : frame.observations) {
      if (view.landmark >= visual.landmarks.size() || descriptors[view.landmark].empty()) continue;
      if (view.descriptor >= visual.descriptors.size()) view.descriptor = descriptors[view.landmark].front();
      image.views.push_back(view);
    }
    std::sort(image.views.begin(), image.views.end(),
              [](const Observation& a, const Observation& b) { return a.pixel.x() < b.pixel.x(); });
    out.push_back(std::move(image));
  }
  return out;
}

class PairMatcher {
 public:
  PairMatcher(const PosedSubmap& first, const PosedSubmap& second, const GuidedMatchConfig& config)
      : first_(first), one_(*first.submap->visual), other_(*second.submap->visual), config_(config) {
    for (const auto& image : images_of(second)) look_in(image);
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
  void look_in(const Image& image) {
    for (std::uint32_t l = 0; l < one_.landmarks.size(); ++l) {
      if (descriptors_[l].empty()) continue;
      const Eigen::Vector3d p_world = first_.T_world_body.front() * one_.landmarks[l].position.cast<double>();
      const auto pixel = project(*image.camera, image.T_camera_world * p_world);
      if (!pixel || !in_image(*image.camera, *pixel)) continue;
      if (const auto match = best_view(image, *pixel, descriptors_[l])) ++votes_[{l, *match}];
    }
  }

  /// The landmark of the view near the pixel that looks like one of `rows` and no other's view does nearly as much.
  [[nodiscard]] std::optional<std::uint32_t> best_view(const Image& image, const Eigen::Vector2d& pixel,
                                                       const std::vector<std::uint32_t>& rows) const {
    const auto at = pixel.cast<float>();
    const auto radius = static_cast<float>(config_.radius_px);
    const auto left = std::partition_point(image.views.begin(), image.views.end(),
                                           [&](const Observation& v) { return v.pixel.x() < at.x() - radius; });
    int best = std::numeric_limits<int>::max(), second = best;
    std::uint32_t landmark = kNoIndex;
    for (auto view = left; view != image.views.end() && view->pixel.x() <= at.x() + radius; ++view) {
      if ((view->pixel - at).norm() > radius) continue;
      int distance = std::numeric_limits<int>::max();
      for (const auto row : rows)
        distance = std::min(distance, hamming(one_.descriptors.row(row), other_.descriptors.row(view->descriptor)));
      if (distance < best) {
        if (view->landmark != landmark) second = best;
        best = distance;
        landmark = view->landmark;
      } else if (view->landmark != landmark) {
        second = std::min(second, distance);
      }
    }
    const double bits = 64.0 * one_.descriptors.words;
    if (best > config_.max_hamming * bits || best > config_.max_hamming_ratio * second) return std::nullopt;
    return landmark;
  }

  const PosedSubmap& first_;
  const VisualPayload& one_;
  const VisualPayload& other_;
  const GuidedMatchConfig& config_;
  std::vector<std::vector<std::uint32_t>> descriptors_ = descriptors_of(one_);
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
  std::vector<LandmarkMatch> out;
  for (const auto& pair : pairs) {
    const auto first = by_id.find(pair.first);
    const auto second = by_id.find(pair.second);
    if (first == by_id.end() || second == by_id.end()) continue;
    if (!are_comparable(*first->second->submap, *second->second->submap)) continue;
    for (const auto& [l, m] : PairMatcher(*first->second, *second->second, config).mutual())
      out.push_back({{pair.first, l}, {pair.second, m}});
  }
  return out;
}

}  // namespace tutti::bundle
