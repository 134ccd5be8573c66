// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/cloud_bytes.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <numeric>
#include <vector>

#include "tutti/base/random.hpp"

namespace tutti::page {
namespace {

constexpr double kFinestStep_m = 0.005;
constexpr double kSteps = 32767.0;

template <class T>
void append(std::string& out, T value) {
  char bytes[sizeof(T)];
  std::memcpy(bytes, &value, sizeof(T));
  out.append(bytes, sizeof(T));
}

std::vector<std::size_t> shuffled(std::size_t count) {
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  Rng rng(count);
  for (std::size_t i = count; i > 1; --i) std::swap(order[i - 1], order[rng.index(i)]);
  return order;
}

}  // namespace

std::string cloud_bytes(const PointCloud& cloud, std::size_t at_most) {
  std::vector<const Eigen::Vector3f*> points;
  double reach_m = 0.0;
  for (const Eigen::Vector3f& point : cloud.points) {
    if (!point.allFinite()) continue;
    points.push_back(&point);
    reach_m = std::max(reach_m, static_cast<double>(point.cwiseAbs().maxCoeff()));
  }
  const auto step_m = static_cast<float>(std::max(kFinestStep_m, 1.0001 * reach_m / kSteps));
  std::vector<std::size_t> order = shuffled(points.size());
  order.resize(std::min(order.size(), at_most));
  std::string out;
  out.reserve(8 + 6 * order.size());
  append(out, step_m);
  append(out, static_cast<std::uint32_t>(order.size()));
  for (const std::size_t i : order)
    for (int axis = 0; axis < 3; ++axis)
      append(out, static_cast<std::int16_t>(std::lround((*points[i])(axis) / step_m)));
  return out;
}

}  // namespace tutti::page
