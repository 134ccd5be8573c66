// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/g2o.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numeric>
#include <span>

#include "tutti/base/check.hpp"
#include "tutti/formats/internal/chain.hpp"
#include "tutti/formats/internal/text.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::formats {
namespace {

using internal::LineReader;
using internal::shown;

constexpr double kRounding = 1e-12;    // an eigenvalue this far below zero, as a share of the largest, is zero
constexpr double kLeastShare = 1e-9;   // of the largest eigenvalue, that takes the place of a negative one
constexpr double kMaxAngle_rad = 1e6;  // of SE(2): its square stays finite, and its rounding below 1e-9 rad
constexpr std::array<int, 3> kPlanarAxes = {0, 1, 5};  // x y theta within [tx ty tz rx ry rz]

struct Vertex {
  std::int64_t id = 0;
  Pose3 pose;
};
/// Edge between ids; PoseGraphEdge has positions.
struct IdEdge {
  std::int64_t from = 0;
  std::int64_t to = 0;
  Pose3 T_from_to;
  Matrix6d information;
  int line = 0;
};
/// Information matrices that were not positive semidefinite.
struct Repairs {
  std::size_t count = 0;
  double worst_share = 0.0;
};
struct Lines {
  std::vector<Vertex> vertices;
  std::vector<IdEdge> edges;
  std::vector<std::int64_t> fixed;
  Repairs repairs;
  bool has_2d = false;
  bool has_3d = false;
};

Pose3 lift(double x, double y, double theta) { return {so3_exp({0.0, 0.0, theta}), {x, y, 0.0}}; }

/// Pose in the columns from `first` on: x y theta, or x y z qx qy qz qw.
Result<Pose3> read_pose(const LineReader& line, std::size_t first, bool is_2d) {
  if (is_2d) {
    double v[3];
    if (auto ok = line.numbers(first, v); !ok) return tl::unexpected(ok.error());
    if (auto ok = check_position(line, {v[0], v[1], 0.0}); !ok) return tl::unexpected(ok.error());
    if (std::abs(v[2]) > kMaxAngle_rad)
      return line.fail(ErrorCode::invalid, "angle is {:g} rad, expected at most {:g}", v[2], kMaxAngle_rad);
    return lift(v[0], v[1], v[2]);
  }
  double v[7];
  if (auto ok = line.numbers(first, v); !ok) return tl::unexpected(ok.error());
  if (auto ok = check_position(line, {v[0], v[1], v[2]}); !ok) return tl::unexpected(ok.error());
  const auto q = internal::to_unit(line, {v[6], v[3], v[4], v[5]});
  if (!q) return tl::unexpected(q.error());
  return Pose3{*q, {v[0], v[1], v[2]}};
}

/// The nearest positive semidefinite matrix (Frobenius norm): negative eigenvalues become 0, but for the share that
/// keeps the solver's equations regular. `information` is symmetric; unchanged when it is semidefinite to rounding.
Status make_semidefinite(const LineReader& line, Eigen::MatrixXd& information, Repairs& repairs) {
  if (information.llt().info() == Eigen::Success) return {};  // positive definite, the usual case
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(information);
  const Eigen::VectorXd& values = eigen.eigenvalues();  // ascending
  const double least = values(0), largest = values(values.size() - 1);
  if (least >= -kRounding * largest) return {};
  if (!(largest > 0.0) || !values.allFinite())
    return line.fail(ErrorCode::invalid, "eigenvalues of the information are {:.3g} to {:.3g}, expected a positive one",
                     least, largest);
  information =
      eigen.eigenvectors() * values.cwiseMax(kLeastShare * largest).asDiagonal() * eigen.eigenvectors().transpose();
  information = (0.5 * (information + information.transpose())).eval();
  ++repairs.count;
  repairs.worst_share = std::max(repairs.worst_share, -least / largest);
  return {};
}

/// Upper triangle, row by row, from column `first` on.
Result<Matrix6d> read_information(const LineReader& line, std::size_t first, bool is_2d, Repairs& repairs) {
  std::array<double, 21> upper{};
  if (auto ok = line.numbers(first, std::span(upper).first(is_2d ? 6 : 21)); !ok) return tl::unexpected(ok.error());
  Eigen::MatrixXd given(is_2d ? 3 : 6, is_2d ? 3 : 6);
  std::size_t next = 0;
  for (int row = 0; row < given.rows(); ++row)
    for (int column = row; column < given.cols(); ++column) given(row, column) = given(column, row) = upper[next++];
  if (auto ok = make_semidefinite(line, given, repairs); !ok) return tl::unexpected(ok.error());
  if (!is_2d) return Matrix6d(given);

  Matrix6d information = Matrix6d::Zero();
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      information(kPlanarAxes[static_cast<std::size_t>(row)], kPlanarAxes[static_cast<std::size_t>(column)]) =
          given(row, column);
  const auto or_one = [](double value) { return value > 0.0 ? value : 1.0; };
  information(2, 2) = or_one(0.5 * information(0, 0) + 0.5 * information(1, 1));
  information(3, 3) = information(4, 4) = or_one(information(5, 5));
  return information;
}

Status read_vertex(const LineReader& line, bool is_2d, Lines& lines) {
  const auto layout = is_2d ? "VERTEX_SE2 id x y theta" : "VERTEX_SE3:QUAT id x y z qx qy qz qw";
  if (auto ok = line.expect_columns(is_2d ? 5 : 9, layout); !ok) return ok;
  const auto id = line.integer(1, "vertex id");
  if (!id) return tl::unexpected(id.error());
  const auto pose = read_pose(line, 2, is_2d);
  if (!pose) return tl::unexpected(pose.error());
  lines.vertices.push_back({*id, *pose});
  return {};
}

Status read_edge(const LineReader& line, bool is_2d, Lines& lines) {
  const auto layout = is_2d ? "EDGE_SE2 from to, 3 of the pose, 6 of the information"
                            : "EDGE_SE3:QUAT from to, 7 of the pose, 21 of the information";
  if (auto ok = line.expect_columns(is_2d ? 12 : 31, layout); !ok) return ok;
  const auto from = line.integer(1, "vertex id");
  if (!from) return tl::unexpected(from.error());
  const auto to = line.integer(2, "vertex id");
  if (!to) return tl::unexpected(to.error());
  if (*from == *to) return line.fail(ErrorCode::invalid, "edge from vertex {} to itself", *from);
  const auto pose = read_pose(line, 3, is_2d);
  if (!pose) return tl::unexpected(pose.error());
  const auto information = read_information(line, is_2d ? 6 : 10, is_2d, lines.repairs);
  if (!information) return tl::unexpected(information.error());
  lines.edges.push_back({*from, *to, *pose, *information, line.line()});
  return {};
}

Status read_line(const LineReader& line, Lines& lines) {
  const std::string_view tag = line.columns()[0];
  if (tag == "FIX") {
    for (std::size_t i = 1; i < line.columns().size(); ++i) {
      const auto id = line.integer(i, "vertex id");
      if (!id) return tl::unexpected(id.error());
      lines.fixed.push_back(*id);
    }
    return {};
  }
  const bool is_vertex = tag == "VERTEX_SE2" || tag == "VERTEX_SE3:QUAT";
  const bool is_2d = tag == "VERTEX_SE2" || tag == "EDGE_SE2";
  if (!is_vertex && tag != "EDGE_SE2" && tag != "EDGE_SE3:QUAT")
    return line.fail(ErrorCode::unsupported,
                     "tag is {}, expected VERTEX_SE2, EDGE_SE2, VERTEX_SE3:QUAT, EDGE_SE3:QUAT or FIX", shown(tag));
  (is_2d ? lines.has_2d : lines.has_3d) = true;
  if (lines.has_2d && lines.has_3d)
    return line.fail(ErrorCode::unsupported, "tag is {} after lines of the other dimension, expected one of both", tag);
  return is_vertex ? read_vertex(line, is_2d, lines) : read_edge(line, is_2d, lines);
}

/// Sorted ids of all poses; an error when a vertex comes twice.
Result<std::vector<std::int64_t>> collect_ids(const Lines& lines, const std::string& name) {
  std::vector<std::int64_t> ids;
  for (const Vertex& vertex : lines.vertices) ids.push_back(vertex.id);
  if (lines.vertices.empty())
    for (const IdEdge& edge : lines.edges) ids.insert(ids.end(), {edge.from, edge.to});
  std::sort(ids.begin(), ids.end());
  const auto repeated = std::adjacent_find(ids.begin(), ids.end());
  if (!lines.vertices.empty() && repeated != ids.end())
    return fail(ErrorCode::invalid, "{}: vertex {} comes twice", name, *repeated);
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  return ids;
}

/// Ids to positions in `ids`.
class Positions {
 public:
  explicit Positions(const std::vector<std::int64_t>& ids) : ids_(ids) {}
  [[nodiscard]] Result<std::size_t> of(std::int64_t id, const std::string& where) const {
    const auto found = std::lower_bound(ids_.begin(), ids_.end(), id);
    if (found == ids_.end() || *found != id)
      return fail(ErrorCode::invalid, "{}: names vertex {}, which is not in the file", where, id);
    return static_cast<std::size_t>(found - ids_.begin());
  }

 private:
  const std::vector<std::int64_t>& ids_;
};

Result<Lines> read_lines(std::string_view text, const std::string& name) {
  LineReader line(text, name);
  Lines lines;
  while (line.next())
    if (auto ok = read_line(line, lines); !ok) return tl::unexpected(ok.error());
  return lines;
}

/// Without vertices, poses are the identity.
Result<G2oFile> assemble(const Lines& lines, const std::string& name) {
  auto ids = collect_ids(lines, name);
  if (!ids) return tl::unexpected(ids.error());
  if (ids->empty()) return fail(ErrorCode::parse, "{}: no vertex and no edge, expected a pose graph", name);

  G2oFile file;
  file.vertex_ids = std::move(*ids);
  file.has_vertices = !lines.vertices.empty();
  file.is_2d = lines.has_2d;
  const Positions positions(file.vertex_ids);
  file.indefinite_edges = lines.repairs.count;
  file.worst_indefinite_share = lines.repairs.worst_share;
  for (const std::int64_t id : lines.fixed) {
    const auto found = positions.of(id, name + ": FIX");
    if (!found) return tl::unexpected(found.error());
    file.fixed.push_back(*found);
  }
  std::sort(file.fixed.begin(), file.fixed.end());
  file.fixed.erase(std::unique(file.fixed.begin(), file.fixed.end()), file.fixed.end());
  file.graph.edges.reserve(lines.edges.size());
  for (const IdEdge& edge : lines.edges) {
    const std::string where = fmt::format("{}:{}: edge", name, edge.line);
    const auto from = positions.of(edge.from, where);
    if (!from) return tl::unexpected(from.error());
    const auto to = positions.of(edge.to, where);
    if (!to) return tl::unexpected(to.error());
    file.graph.edges.push_back({*from, *to, edge.T_from_to, edge.information});
  }

  file.graph.poses.resize(file.vertex_ids.size());
  for (const Vertex& vertex : lines.vertices) file.graph.poses[*positions.of(vertex.id, name)] = vertex.pose;
  return file;
}

Status place_along_edges(G2oFile& file, const std::string& name) {
  const std::size_t components = internal::chain_poses(file.graph, file.vertex_ids);
  if (components != 1)
    return fail(ErrorCode::invalid, "{}: no VERTEX lines and {} connected components, expected 1 to chain poses in",
                name, components);
  for (std::size_t i = 0; i < file.graph.poses.size(); ++i)
    if (!file.graph.poses[i].translation.allFinite())
      return fail(ErrorCode::invalid, "{}: position of vertex {}, chained from the edges, is not finite", name,
                  file.vertex_ids[i]);
  return {};
}

void write_pose(std::string& out, const Pose3& pose, bool is_2d) {
  const Eigen::Vector3d& t = pose.translation;
  const Eigen::Quaterniond& q = pose.rotation;
  if (is_2d)
    fmt::format_to(std::back_inserter(out), " {} {} {}", t.x(), t.y(), 2.0 * std::atan2(q.z(), q.w()));
  else
    fmt::format_to(std::back_inserter(out), " {} {} {} {} {} {} {}", t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
}

void write_information(std::string& out, const Matrix6d& information, bool is_2d) {
  static constexpr std::array<int, 6> kAllAxes = {0, 1, 2, 3, 4, 5};
  const std::span<const int> axes = is_2d ? std::span<const int>(kPlanarAxes) : std::span<const int>(kAllAxes);
  for (std::size_t row = 0; row < axes.size(); ++row)
    for (std::size_t column = row; column < axes.size(); ++column)
      fmt::format_to(std::back_inserter(out), " {}", information(axes[row], axes[column]));
}

}  // namespace

Result<G2oFile> parse_g2o_edges(std::string_view text, const std::string& name) {
  return read_lines(text, name).and_then([&](const Lines& lines) { return assemble(lines, name); });
}

Result<G2oFile> parse_g2o(std::string_view text, const std::string& name) {
  auto file = parse_g2o_edges(text, name);
  if (!file || file->has_vertices) return file;
  if (auto ok = place_along_edges(*file, name); !ok) return tl::unexpected(ok.error());
  return file;
}

Result<G2oFile> read_g2o_edges(const std::string& path) {
  return read_file(path).and_then([&](const std::string& text) { return parse_g2o_edges(text, path); });
}

Result<G2oFile> read_g2o(const std::string& path) {
  return read_file(path).and_then([&](const std::string& text) { return parse_g2o(text, path); });
}

std::string to_g2o(const G2oFile& file) {
  const auto& [poses, edges] = file.graph;
  TUTTI_CHECK(file.vertex_ids.size() == poses.size(), "{} ids for {} poses", file.vertex_ids.size(), poses.size());
  std::string out;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    fmt::format_to(std::back_inserter(out), "{} {}", file.is_2d ? "VERTEX_SE2" : "VERTEX_SE3:QUAT", file.vertex_ids[i]);
    write_pose(out, poses[i], file.is_2d);
    out += '\n';
  }
  for (const std::size_t i : file.fixed) fmt::format_to(std::back_inserter(out), "FIX {}\n", file.vertex_ids.at(i));
  for (const PoseGraphEdge& edge : edges) {
    fmt::format_to(std::back_inserter(out), "{} {} {}", file.is_2d ? "EDGE_SE2" : "EDGE_SE3:QUAT",
                   file.vertex_ids.at(edge.from), file.vertex_ids.at(edge.to));
    write_pose(out, edge.T_from_to, file.is_2d);
    write_information(out, edge.information, file.is_2d);
    out += '\n';
  }
  return out;
}

Status write_g2o(const std::string& path, const G2oFile& file) { return write_file(path, to_g2o(file)); }

Status write_g2o(const std::string& path, const PoseGraph& graph) {
  G2oFile file{.graph = graph, .vertex_ids = std::vector<std::int64_t>(graph.poses.size())};
  std::iota(file.vertex_ids.begin(), file.vertex_ids.end(), 0);
  return write_g2o(path, file);
}

}  // namespace tutti::formats
