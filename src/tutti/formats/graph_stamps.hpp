// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/base/ids.hpp"
#include "tutti/base/result.hpp"
#include "tutti/base/timestamp.hpp"

/// Reads and writes the csv that a mission writes beside graph.g2o, with the keyframe that each vertex is and when it
/// was taken: `id,robot,keyframe,stamp_ns` (docs/report.md). Sessions are not in the file: keyframes are read as of
/// session 0.
namespace tutti::formats {

struct VertexStamp {
  std::int64_t vertex_id = 0;
  KeyframeId keyframe;
  Timestamp stamp;
  friend bool operator==(const VertexStamp&, const VertexStamp&) = default;
};

/// For people: where the times of a graph without stamps are from.
inline constexpr const char* kCountedSeconds = "none in the file: the n-th pose of a robot counts as at n seconds";

/// The path at which the stamps of a graph's file are expected: "x_stamps.csv" beside "x.g2o".
std::string stamps_beside(const std::string& graph_path);

/// True if the stamps of vertices, of these robots, can be times of keyframes: they increase along every robot, and
/// most steps take at least a millisecond. The vertices of a robot are neighbours.
bool are_times(std::span<const std::uint32_t> robots, std::span<const Timestamp> stamps);

/// The rows in file order. Errors name file and line.
Result<std::vector<VertexStamp>> parse_graph_stamps(std::string_view text, const std::string& name);
Result<std::vector<VertexStamp>> read_graph_stamps(const std::string& path);
/// The row of each of these vertices, in their order. An error names the file, `path`, and the vertex of `graph` that
/// has none.
Result<std::vector<VertexStamp>> rows_of(std::span<const std::int64_t> vertex_ids, std::span<const VertexStamp> rows,
                                         const std::string& path, const std::string& graph);
Status write_graph_stamps(const std::string& path, std::span<const VertexStamp> stamps);

}  // namespace tutti::formats
