// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/wire/internal/cloud_codec.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "tutti/base/check.hpp"
#include "tutti/v1/messages.pb.h"
#include "tutti/wire/frame.hpp"
#include "tutti/wire/internal/payload.hpp"
#include "tutti/wire/limits.hpp"

namespace tutti::wire {
namespace {

// A cell number of 21 bits leaves a float 3 bits for the place inside the cell: rounding never changes the cell.
constexpr std::int64_t kMaxCells = 1 << 20;
constexpr double kMinVoxel_m = 0.1;
constexpr double kMaxVoxel_m = 10.0;
constexpr int kMaxOffsetBits = 6;
static_assert(kMaxCells * kMinVoxel_m / (1 << kMaxOffsetBits) > kMaxCloudRange_m);

struct Cell {
  std::uint64_t voxel = 0;  ///< Morton code
  std::array<std::uint8_t, 3> offset{};
  friend auto operator<=>(const Cell&, const Cell&) = default;
};

/// 21 bits, two zeros after each.
std::uint64_t spread_bits(std::uint64_t x) {
  x = (x | (x << 32U)) & 0x001f00000000ffffULL;
  x = (x | (x << 16U)) & 0x001f0000ff0000ffULL;
  x = (x | (x << 8U)) & 0x100f00f00f00f00fULL;
  x = (x | (x << 4U)) & 0x10c30c30c30c30c3ULL;
  x = (x | (x << 2U)) & 0x1249249249249249ULL;
  return x;
}

std::uint64_t gather_bits(std::uint64_t x) {
  x &= 0x1249249249249249ULL;
  x = (x | (x >> 2U)) & 0x10c30c30c30c30c3ULL;
  x = (x | (x >> 4U)) & 0x100f00f00f00f00fULL;
  x = (x | (x >> 8U)) & 0x001f0000ff0000ffULL;
  x = (x | (x >> 16U)) & 0x001f00000000ffffULL;
  x = (x | (x >> 32U)) & 0x00000000001fffffULL;
  return x;
}

bool is_valid(const CloudCodec& codec) {
  return codec.voxel_m >= kMinVoxel_m && codec.voxel_m <= kMaxVoxel_m && codec.offset_bits >= 0 &&
         codec.offset_bits <= kMaxOffsetBits;
}

double cell_size_m(const CloudCodec& codec) { return codec.voxel_m / static_cast<double>(1 << codec.offset_bits); }

Cell to_cell(const Eigen::Vector3f& point, const CloudCodec& codec) {
  Cell cell;
  for (unsigned axis = 0; axis < 3; ++axis) {
    const auto number = static_cast<std::int64_t>(std::floor(static_cast<double>(point(axis)) / cell_size_m(codec)));
    const auto bits = static_cast<unsigned>(codec.offset_bits);
    const std::int64_t voxel = number >> bits;
    cell.offset[axis] = static_cast<std::uint8_t>(number - (voxel << bits));
    cell.voxel |= spread_bits(static_cast<std::uint64_t>(voxel + kMaxCells)) << axis;
  }
  return cell;
}

/// Nothing beyond kMaxCloudRange_m. (A cell at the border may have its centre outside; the point then is on the
/// border.)
std::optional<Eigen::Vector3f> to_point(const Cell& cell, const CloudCodec& codec) {
  Eigen::Vector3f point;
  for (unsigned axis = 0; axis < 3; ++axis) {
    const auto voxel = static_cast<std::int64_t>(gather_bits(cell.voxel >> axis)) - kMaxCells;
    const std::int64_t number = voxel * (std::int64_t{1} << codec.offset_bits) + cell.offset[axis];
    const double centre = (static_cast<double>(number) + 0.5) * cell_size_m(codec);
    if (std::abs(centre) > kMaxCloudRange_m + cell_size_m(codec)) return std::nullopt;
    point(axis) = static_cast<float>(std::clamp(centre, -kMaxCloudRange_m, kMaxCloudRange_m));
  }
  return point;
}

}  // namespace

void encode_cloud(const PointCloud& cloud, const CloudCodec& codec, v1::Cloud& out) {
  TUTTI_CHECK(is_valid(codec), "voxel {} m, {} bits", codec.voxel_m, codec.offset_bits);
  std::vector<Cell> cells;
  cells.reserve(cloud.points.size());
  for (const Eigen::Vector3f& point : cloud.points) cells.push_back(to_cell(point, codec));
  std::ranges::sort(cells);

  out.set_voxel_m(codec.voxel_m);
  out.set_offset_bits(static_cast<std::uint32_t>(codec.offset_bits));
  out.mutable_voxel()->Reserve(static_cast<int>(cells.size()));
  std::array<std::string*, 3> offsets = {out.mutable_offset_x(), out.mutable_offset_y(), out.mutable_offset_z()};
  std::uint64_t previous = 0;
  for (const Cell& cell : cells) {
    out.add_voxel(cell.voxel - previous);
    previous = cell.voxel;
    for (std::size_t axis = 0; axis < 3; ++axis) offsets[axis]->push_back(static_cast<char>(cell.offset[axis]));
  }
}

Result<std::shared_ptr<const PointCloud>> decode_cloud(const v1::Cloud& in) {
  const auto count = static_cast<std::size_t>(in.voxel_size());
  const std::array<const std::string*, 3> offsets = {&in.offset_x(), &in.offset_y(), &in.offset_z()};
  for (const std::string* offset : offsets)
    if (offset->size() != count)
      return fail(ErrorCode::parse, "cloud: {} offsets for {} points", offset->size(), count);
  if (in.offset_bits() > static_cast<std::uint32_t>(kMaxOffsetBits))
    return fail(ErrorCode::invalid, "cloud: {} offset bits, at most {}", in.offset_bits(), kMaxOffsetBits);
  const CloudCodec codec{in.voxel_m(), static_cast<int>(in.offset_bits())};
  if (!is_valid(codec))
    return fail(ErrorCode::invalid, "cloud: voxel of {} m, expected {} to {}", in.voxel_m(), kMinVoxel_m, kMaxVoxel_m);

  auto cloud = std::make_shared<PointCloud>();
  cloud->points.reserve(count);
  Cell cell;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint64_t step = in.voxel(static_cast<int>(i));
    if (step > (std::uint64_t{1} << 63U) - 1 - cell.voxel)
      return fail(ErrorCode::invalid, "cloud: point {}: voxel code beyond 63 bits", i);
    cell.voxel += step;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      cell.offset[axis] = static_cast<std::uint8_t>((*offsets[axis])[i]);
      if (cell.offset[axis] >> in.offset_bits() != 0)
        return fail(ErrorCode::invalid, "cloud: point {}: offset {} has more than {} bits", i, cell.offset[axis],
                    in.offset_bits());
    }
    const std::optional<Eigen::Vector3f> point = to_point(cell, codec);
    if (!point) return fail(ErrorCode::invalid, "cloud: point {} is not within {} m", i, kMaxCloudRange_m);
    cloud->points.push_back(*point);
  }
  return cloud;
}

std::string encode(const PointCloud& cloud, const CloudCodec& codec) {
  expect_valid(validate(cloud));
  v1::Cloud out;
  encode_cloud(cloud, codec, out);
  return pack_frame(MessageKind::cloud, out.SerializeAsString());
}

Result<std::shared_ptr<const PointCloud>> decode_cloud(std::string_view bytes) {
  const auto parsed = parse_frame<v1::Cloud>(MessageKind::cloud, bytes);
  if (!parsed) return tl::unexpected(parsed.error());
  return decode_cloud(*parsed);
}

}  // namespace tutti::wire
