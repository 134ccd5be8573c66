// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/internal/yaml_values.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "tutti/base/check.hpp"
#include "tutti/formats/internal/text.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::formats::internal {
namespace {

void collect_scalars(const ConfigNode& node, std::vector<const ConfigNode*>& out) {
  if (node.kind == ConfigNode::Kind::list)
    for (const ConfigNode& element : node.list) collect_scalars(element, out);
  else
    out.push_back(&node);
}

}  // namespace

const ConfigNode& YamlValues::at(const ConfigNode& map, std::string_view key) {
  static const ConfigNode kNothing;
  if (const ConfigNode* node = map.find(key)) return *node;
  complain(map, ErrorCode::parse, "there is no '{}' here", key);
  return kNothing;
}

std::string YamlValues::text(const ConfigNode& map, std::string_view key) {
  const ConfigNode& node = at(map, key);
  if (node.kind != ConfigNode::Kind::scalar) complain(node, ErrorCode::parse, "{}: expected a text", key);
  return node.scalar;
}

double YamlValues::positive(const ConfigNode& map, std::string_view key) {
  const double value = numbers(map, key, 1).front();
  if (!(value > 0.0)) complain(map, ErrorCode::invalid, "{} is {}, expected a positive number", key, value);
  return value;
}

std::vector<double> YamlValues::numbers(const ConfigNode& map, std::string_view key, std::size_t count) {
  auto out = numbers(map, key);
  if (out.size() != count)
    complain(at(map, key), ErrorCode::parse, "{} has {} numbers, expected {}", key, out.size(), count);
  if (!status_) out.assign(count, 0.0);
  return out;
}

std::vector<double> YamlValues::numbers(const ConfigNode& map, std::string_view key) {
  const ConfigNode& node = at(map, key);
  const ConfigNode& data = node.kind == ConfigNode::Kind::map ? at(node, "data") : node;
  std::vector<const ConfigNode*> scalars;
  collect_scalars(data, scalars);
  std::vector<double> out;
  for (const ConfigNode* scalar : scalars) {
    const auto value = parse_number(scalar->scalar);
    if (!value || !std::isfinite(*value))
      complain(*scalar, ErrorCode::parse, "{}: {} stands there, expected a finite number", key, shown(scalar->scalar));
    out.push_back(value.value_or(0.0));
  }
  return out;
}

Pose3 YamlValues::pose(const ConfigNode& map, std::string_view key) {
  const auto values = numbers(map, key, 16);
  if (!status_) return {};
  const auto pose = pose_from_matrix(values);
  if (pose) return *pose;
  complain(at(map, key), pose.error().code, "{}: {}", key, pose.error().message);
  return {};
}

bool is_rational(CameraKind kind, std::size_t coefficients) {
  return kind == CameraKind::pinhole && (coefficients == 5 || coefficients == 8);
}

CameraModel to_camera_model(YamlValues& yaml, const ConfigNode& where, const ForeignCamera& camera) {
  constexpr double kMaxSize_px = 1e5;
  if (!yaml.status()) return {};
  CameraModel out;
  if (camera.distortion_model == "equidistant")
    out.kind = CameraKind::equidistant;
  else if (camera.model != "pinhole" || camera.distortion_model != "radial-tangential")
    yaml.complain(where, ErrorCode::unsupported,
                  "the camera is {} with distortion {}, expected pinhole with radial-tangential or equidistant",
                  shown(camera.model), shown(camera.distortion_model));
  for (const double size : camera.size_px)
    if (!(size >= 1.0 && size <= kMaxSize_px))
      yaml.complain(where, ErrorCode::invalid, "an image size of {} px, expected 1 to {}", size, kMaxSize_px);
  if (!yaml.status()) return {};
  out.width_px = static_cast<int>(camera.size_px[0]);
  out.height_px = static_cast<int>(camera.size_px[1]);
  out.fx = camera.intrinsics[0];
  out.fy = camera.intrinsics[1];
  out.cx = camera.intrinsics[2];
  out.cy = camera.intrinsics[3];
  const std::size_t coefficients = camera.coefficients.size();
  const bool is_long = is_rational(out.kind, coefficients);
  if (coefficients != 4 && !is_long) {
    yaml.complain(where, ErrorCode::parse, "{} distortion coefficients, expected 4{}", coefficients,
                  out.kind == CameraKind::pinhole ? ", 5 or 8" : "");
    return {};
  }
  if (is_long) out.kind = CameraKind::rational;
  std::ranges::copy(camera.coefficients, out.distortion.begin());
  if (auto ok = check_camera(out); !ok) yaml.complain(where, ok.error().code, "{}", ok.error().message);
  return out;
}

Result<Pose3> pose_from_matrix(const std::vector<double>& row_major_4x4) {
  constexpr double kTolerance = 1e-3;
  TUTTI_CHECK(row_major_4x4.size() == 16, "a 4 x 4 matrix");
  const Eigen::Matrix4d m = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(row_major_4x4.data());
  if (m.row(3) != Eigen::RowVector4d(0.0, 0.0, 0.0, 1.0))
    return fail(ErrorCode::invalid, "the last row is {} {} {} {}, expected 0 0 0 1", m(3, 0), m(3, 1), m(3, 2),
                m(3, 3));
  const Eigen::Matrix3d R = m.topLeftCorner<3, 3>();
  const double error = (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(error <= kTolerance) || !(R.determinant() > 0.0))
    return fail(ErrorCode::invalid, "|R^T R - I| is {:.3g}, det R {:.3g}, expected a rotation within {}", error,
                R.determinant(), kTolerance);
  if (!((m.topRightCorner<3, 1>().array().abs() <= kMaxCoordinate_m).all()))
    return fail(ErrorCode::invalid, "a translation of more than {} m", kMaxCoordinate_m);
  return Pose3::from_matrix(m);
}

}  // namespace tutti::formats::internal
