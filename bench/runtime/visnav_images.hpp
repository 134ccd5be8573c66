// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "tutti/model/visual.hpp"
#include "tutti/perception/visual/hamming.hpp"

/// The 100 real stereo pairs of euroc_V1_01_visnav, read for benches.
namespace tutti::visual::bench {

inline const std::string kFolder = TUTTI_SHARED_DIR "/data/images/euroc_V1_01_visnav/";

template <class T>
T value(Result<T> result) {
  if (result) return std::move(*result);
  fmt::print(stderr, "{}\n", result.error().message);
  std::exit(1);
}

inline std::vector<Camera> read_cameras() {
  const auto json = nlohmann::json::parse(std::ifstream(kFolder + "calibration.json")).at("value0");
  std::vector<Camera> out;
  for (std::size_t c = 0; c < 2; ++c) {
    const auto number = [&](const char* list, const char* name) { return json.at(list).at(c).at(name).get<double>(); };
    const auto intrinsic = [&](const char* name) { return number("cam.intrinsics", name); };
    const auto pose = [&](const char* name) { return number("cam.T_i_c", name); };
    const CameraModel model{.kind = CameraKind::double_sphere,
                            .width_px = static_cast<int>(intrinsic("width")),
                            .height_px = static_cast<int>(intrinsic("height")),
                            .fx = intrinsic("fx"),
                            .fy = intrinsic("fy"),
                            .cx = intrinsic("cx"),
                            .cy = intrinsic("cy"),
                            .distortion = {intrinsic("p1"), intrinsic("p2"), 0.0, 0.0}};
    const Eigen::Quaterniond rotation(pose("qw"), pose("qx"), pose("qy"), pose("qz"));
    out.push_back({model, {rotation.normalized(), {pose("px"), pose("py"), pose("pz")}}});
  }
  return out;
}

struct Listed {
  Timestamp stamp;
  std::string left, right;
};

inline std::vector<std::vector<std::string>> read_csv(const std::string& path) {
  std::ifstream in(path);
  std::vector<std::vector<std::string>> out;
  for (std::string line; std::getline(in, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::vector<std::string> row;
    std::stringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) row.push_back(cell);
    out.push_back(std::move(row));
  }
  return out;
}

/// The row nearest to every query, that of smaller index among equals; kNoIndex without rows.
inline std::vector<std::uint32_t> nearest_rows(const Descriptors& queries, const Descriptors& rows) {
  std::vector<std::uint32_t> out(queries.size(), kNoIndex);
  for (std::size_t q = 0; q < queries.size(); ++q) {
    std::uint32_t least = kNoDistance;
    for (std::uint32_t i = 0; i < rows.size(); ++i)
      if (const std::uint32_t distance = hamming_distance(queries.row(q), rows.row(i)); distance < least) {
        least = distance;
        out[q] = i;
      }
  }
  return out;
}

/// Keypoints of both images that are each other's nearest get the same track; what does not meet in a point is not
/// triangulated. Tracks are numbered from the first one given.
inline void match_stereo(TrackedImage& left, TrackedImage& right, std::uint64_t first_track = 1) {
  const auto forth = nearest_rows(left.descriptors, right.descriptors);
  const auto back = nearest_rows(right.descriptors, left.descriptors);
  for (std::uint32_t i = 0; i < forth.size(); ++i)
    if (forth[i] != kNoIndex && back[forth[i]] == i)
      left.keypoints[i].track = right.keypoints[forth[i]].track = first_track + i;
}

}  // namespace tutti::visual::bench
