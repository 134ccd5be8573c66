// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>

#include "tutti/base/result.hpp"
#include "tutti/formats/ply.hpp"

/// Point clouds of other programs, in whichever format.
namespace tutti::formats {

enum class CloudFormat { ply, pcd };

/// A PLY or PCD file, told by how it begins. LAS and LAZ, which are not read, are ErrorCode::unsupported with the
/// command that makes a PLY file of them (docs/decisions/no-las.md).
Result<PlacedCloud> read_placed_cloud(const std::string& path);

/// `comments`: lines of the header.
Status write_cloud(const std::string& path, CloudFormat format, std::span<const Eigen::Vector3f> points,
                   std::span<const std::string> comments = {});

}  // namespace tutti::formats
