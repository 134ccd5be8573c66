// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/internal/g2o_lines.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include "tutti/formats/internal/text.hpp"
#include "tutti/formats/symbol_keys.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::formats::internal {
namespace {

/// The columns of a line of a kind that is read.
struct Tag {
  std::string_view name;
  bool is_vertex = false;
  bool is_2d = false;
  bool is_toro = false;
  std::string_view layout;
  [[nodiscard]] std::size_t pose_columns() const { return is_2d ? 3 : is_toro ? 6 : 7; }
};
constexpr std::array<Tag, 8> kTags = {{
    {"VERTEX_SE2", true, true, false, "VERTEX_SE2 id x y theta"},
    {"EDGE_SE2", false, true, false, "EDGE_SE2 from to, 3 of the pose, 6 of the information"},
    {"VERTEX_SE3:QUAT", true, false, false, "VERTEX_SE3:QUAT id x y z qx qy qz qw"},
    {"EDGE_SE3:QUAT", false, false, false, "EDGE_SE3:QUAT from to, 7 of the pose, 21 of the information"},
    {"VERTEX2", true, true, true, "VERTEX2 id x y theta"},
    {"EDGE2", false, true, true, "EDGE2 from to, 3 of the pose, 6 of the information"},
    {"VERTEX3", true, false, true, "VERTEX3 id x y z roll pitch yaw"},
    {"EDGE3", false, false, true, "EDGE3 from to, 6 of the pose, 21 of the information"},
}};
constexpr std::string_view kTagNames = "VERTEX_SE2, EDGE_SE2, VERTEX_SE3:QUAT, EDGE_SE3:QUAT or FIX";

std::string where(const LineReader& line) { return fmt::format("{}:{}", line.name(), line.line()); }

constexpr double kRounding = 1e-12;    // an eigenvalue this far below zero, as a share of the largest, is zero
constexpr double kLeastShare = 1e-9;   // of the largest eigenvalue, that takes the place of a negative one
constexpr double kMaxAngle_rad = 1e6;  // of SE(2): its square stays finite, and its rounding below 1e-9 rad

Pose3 lift(double x, double y, double theta) { return {so3_exp({0.0, 0.0, theta}), {x, y, 0.0}}; }

/// Pose in the columns from `first` on: x y theta, x y z qx qy qz qw, or in TORO x y z roll pitch yaw.
Result<Pose3> read_pose(const LineReader& line, std::size_t first, Tag tag) {
  std::array<double, 7> v{};
  if (auto ok = line.numbers(first, std::span(v).first(tag.pose_columns())); !ok) return tl::unexpected(ok.error());
  if (auto ok = check_position(line, {v[0], v[1], tag.is_2d ? 0.0 : v[2]}); !ok) return tl::unexpected(ok.error());
  if (!tag.is_2d && !tag.is_toro) {
    const auto q = to_unit(line, {v[6], v[3], v[4], v[5]});
    if (!q) return tl::unexpected(q.error());
    return Pose3{*q, {v[0], v[1], v[2]}};
  }
  const std::span<const double> angles = tag.is_2d ? std::span(v).subspan(2, 1) : std::span(v).subspan(3, 3);
  for (const double angle : angles)
    if (std::abs(angle) > kMaxAngle_rad)
      return line.fail(ErrorCode::invalid, "angle is {:g} rad, expected at most {:g}", angle, kMaxAngle_rad);
  if (tag.is_2d) return lift(v[0], v[1], v[2]);
  return Pose3{so3_exp({0.0, 0.0, v[5]}) * so3_exp({0.0, v[4], 0.0}) * so3_exp({v[3], 0.0, 0.0}), {v[0], v[1], v[2]}};
}

/// The nearest positive semidefinite matrix (Frobenius norm): negative eigenvalues become 0, but for the share that
/// keeps the solver's equations regular. `information` is symmetric; unchanged when it is semidefinite to rounding.
Status make_semidefinite(const LineReader& line, Eigen::MatrixXd& information, std::size_t& repaired,
                         double& worst_share) {
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
  ++repaired;
  worst_share = std::max(worst_share, -least / largest);
  return {};
}

/// The order in which TORO writes the information of a planar edge.
constexpr std::array<std::pair<int, int>, 6> kToroPlanar = {{{0, 0}, {0, 1}, {1, 1}, {2, 2}, {0, 2}, {1, 2}}};

/// From column `first` on: the upper triangle, row by row, or as TORO has it.
Result<Matrix6d> read_information(const LineReader& line, std::size_t first, Tag tag, std::size_t& repaired,
                                  double& worst_share) {
  const int size = tag.is_2d ? 3 : 6;
  std::array<double, 21> upper{};
  if (auto ok = line.numbers(first, std::span(upper).first(tag.is_2d ? 6 : 21)); !ok) return tl::unexpected(ok.error());
  Eigen::MatrixXd given(size, size);
  std::size_t next = 0;
  if (tag.is_toro && tag.is_2d)
    for (const auto& [row, column] : kToroPlanar) given(row, column) = given(column, row) = upper[next++];
  else
    for (int row = 0; row < size; ++row)
      for (int column = row; column < size; ++column) given(row, column) = given(column, row) = upper[next++];
  if (auto ok = make_semidefinite(line, given, repaired, worst_share); !ok) return tl::unexpected(ok.error());
  if (!tag.is_2d) return Matrix6d(given);

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

Status read_vertex(const LineReader& line, Tag tag, G2oLines& lines) {
  if (auto ok = line.expect_columns(2 + tag.pose_columns(), tag.layout); !ok) return ok;
  const auto id = line.integer(1, "vertex id");
  if (!id) return tl::unexpected(id.error());
  const auto pose = read_pose(line, 2, tag);
  if (!pose) return tl::unexpected(pose.error());
  lines.vertices.push_back({*id, *pose, where(line)});
  return {};
}

Status read_edge(const LineReader& line, Tag tag, G2oLines& lines) {
  const std::size_t information_at = 3 + tag.pose_columns();
  if (auto ok = line.expect_columns(information_at + (tag.is_2d ? 6 : 21), tag.layout); !ok) return ok;
  const auto from = line.integer(1, "vertex id");
  if (!from) return tl::unexpected(from.error());
  const auto to = line.integer(2, "vertex id");
  if (!to) return tl::unexpected(to.error());
  if (*from == *to) return line.fail(ErrorCode::invalid, "edge from vertex {} to itself", vertex_name(*from));
  const auto pose = read_pose(line, 3, tag);
  if (!pose) return tl::unexpected(pose.error());
  const auto information =
      read_information(line, information_at, tag, lines.indefinite_edges, lines.worst_indefinite_share);
  if (!information) return tl::unexpected(information.error());
  lines.edges.push_back({*from, *to, *pose, *information, where(line)});
  return {};
}

/// Capitals, digits and what is between them: what other optimisers call a line.
bool looks_like_tag(std::string_view text) {
  const auto is_of_tags = [](char c) {
    return (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == ':' || c == '-';
  };
  return !text.empty() && text.front() >= 'A' && text.front() <= 'Z' && std::ranges::all_of(text, is_of_tags);
}

Status read_line(const LineReader& line, G2oLines& lines) {
  const std::string_view tag = line.columns()[0];
  if (tag.starts_with("//") || tag.starts_with('%')) return {};  // a comment
  if (tag == "FIX") {
    for (std::size_t i = 1; i < line.columns().size(); ++i) {
      const auto id = line.integer(i, "vertex id");
      if (!id) return tl::unexpected(id.error());
      lines.fixed.push_back(*id);
    }
    return {};
  }
  const auto known = std::ranges::find(kTags, tag, &Tag::name);
  if (known == kTags.end() && !looks_like_tag(tag))
    return line.fail(ErrorCode::unsupported, "tag is {}, expected one of g2o or TORO, as {}", shown(tag), kTagNames);
  if (known == kTags.end()) {
    ++lines.left_out[std::string(tag)];
    return {};
  }
  (known->is_2d ? lines.has_2d : lines.has_3d) = true;
  if (lines.has_2d && lines.has_3d)
    return line.fail(ErrorCode::unsupported, "tag is {} after lines of the other dimension, expected one of both", tag);
  return known->is_vertex ? read_vertex(line, *known, lines) : read_edge(line, *known, lines);
}

}  // namespace

Status read_g2o_lines(std::string_view text, const std::string& name, G2oLines& lines) {
  LineReader line(text, name);
  while (line.next())
    if (auto ok = read_line(line, lines); !ok) return ok;
  return {};
}

}  // namespace tutti::formats::internal
