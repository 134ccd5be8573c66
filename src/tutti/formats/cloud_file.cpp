// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/cloud_file.hpp"

#include <algorithm>
#include <string_view>

#include "tutti/base/file.hpp"
#include "tutti/formats/internal/placed_pcd.hpp"
#include "tutti/formats/pcd.hpp"

namespace tutti::formats {
namespace {

/// A header's first word in letters, whether it is a comment or a keyword: ".PCD", "VERSION", "FIELDS".
bool is_pcd(std::string_view bytes) {
  const std::size_t word = bytes.find_first_not_of("# \t\r\n");
  const std::string_view begin = bytes.substr(std::min(word, bytes.size()));
  return begin.starts_with(".PCD") || begin.starts_with("VERSION") || begin.starts_with("FIELDS");
}

}  // namespace

Result<PlacedCloud> read_placed_cloud(const std::string& path) {
  return read_file(path).and_then([&](const std::string& bytes) -> Result<PlacedCloud> {
    if (is_pcd(bytes)) return internal::parse_placed_pcd(bytes, path);
    if (bytes.starts_with("LASF"))
      return fail(ErrorCode::unsupported,
                  "{0}: is a LAS or LAZ file, expected PLY or PCD: pdal translate {0} survey.ply (of conda-forge or "
                  "Ubuntu), or save "
                  "it as PLY in CloudCompare",
                  path);
    if (!bytes.starts_with("ply"))
      return fail(ErrorCode::parse, "{}: begins neither with \"ply\" nor as PCD, expected a PLY or PCD file", path);
    return parse_placed_ply(bytes, path);
  });
}

Status write_cloud(const std::string& path, CloudFormat format, std::span<const Eigen::Vector3f> points,
                   std::span<const std::string> comments) {
  if (format == CloudFormat::ply) return write_ply(path, points, {}, {}, comments);
  std::string lines;
  for (const std::string& comment : comments) lines += "# " + comment + "\n";
  std::string pcd = to_pcd(points);
  return write_file(path, pcd.insert(pcd.find('\n') + 1, lines));
}

}  // namespace tutti::formats
