// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <map>
#include <set>
#include <utility>

#include "tutti/mission/evaluate.hpp"
#include "tutti/perception/visual/reprojection.hpp"

namespace tutti::mission {
namespace {

/// The sum over the submaps of one robot.
struct Sum {
  std::set<KeyframeId> keyframes;  ///< With an image.
  std::size_t frames = 0;          ///< Every submap's: a keyframe that two share counts twice, as its landmarks do.
  std::size_t landmarks = 0;
  std::size_t seen = 0;  ///< Landmarks of every such keyframe.
  visual::ReprojectionError error;
};

void add(const Submap& submap, Sum& sum) {
  std::map<std::uint32_t, std::set<std::uint32_t>> seen;
  for (const VisualFrame& frame : submap.visual->frames)
    for (const Observation& it : frame.observations)
      if (auto& landmarks = seen[frame.keyframe]; it.landmark != kNoIndex) landmarks.insert(it.landmark);
  for (const auto& [keyframe, landmarks] : seen) {
    sum.keyframes.insert({submap.id.chain, keyframe});
    sum.seen += landmarks.size();
  }
  sum.frames += seen.size();
  sum.landmarks += submap.visual->landmarks.size();
  const visual::ReprojectionError error = visual::reprojection_error(submap);
  sum.error.sum_px2 += error.sum_px2;
  sum.error.views += error.views;
}

}  // namespace

void evaluate_images(const server::MapServer& server, MissionRecord& record) {
  std::map<RobotId, Sum> sums;
  for (const auto& [id, size] : server.state().payload_sizes) {
    if (size.observations == 0) continue;
    const auto payload = server.payloads().visual(id);
    if (!payload) {
      record.notes.push_back("what the cameras saw of a submap is missing: " + payload.error().message);
      continue;
    }
    Submap submap = *server.state().submaps.at(id);
    submap.visual = *payload;
    if (submap.visual) add(submap, sums[id.chain.robot]);
  }
  for (RobotRecord& robot : record.robots) {
    const auto its = sums.find(robot.id);
    if (its == sums.end()) continue;
    const Sum& sum = its->second;
    ImagesRecord& images = robot.images.emplace();
    images.keyframes = sum.keyframes.size();
    images.landmarks = sum.landmarks;
    if (sum.frames > 0) images.landmarks_per_keyframe = static_cast<double>(sum.seen) / static_cast<double>(sum.frames);
    if (sum.error.views > 0) images.reprojection_rms_px = sum.error.rms_px();
    record.notes.push_back(
        fmt::format("{}: {} keyframes with images, {:.0f} landmarks each, reprojected within {} "
                    "(RMS)",
                    robot.name, images.keyframes, images.landmarks_per_keyframe,
                    images.reprojection_rms_px ? fmt::format("{:.2f} px", *images.reprojection_rms_px) : "no figure"));
  }
}

}  // namespace tutti::mission
