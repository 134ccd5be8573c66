// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/grids/occupancy_grid.hpp"

#include <algorithm>
#include <filesystem>

#include "tutti/base/file.hpp"

namespace tutti::grids {

std::size_t OccupancyGrid::count(Cell cell) const { return static_cast<std::size_t>(std::ranges::count(cells, cell)); }

namespace {

/// `text` as a YAML string in double quotes: unquoted, ` #` begins a comment and `: ` a mapping.
std::string yaml_quoted(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7f)
      quoted += fmt::format("\\x{:02x}", byte);
    else
      quoted += c;
  }
  return quoted + "\"";
}

}  // namespace

Status write_nav2_map(const OccupancyGrid& grid, const std::string& yaml_path, const std::vector<std::string>& notes) {
  namespace fs = std::filesystem;
  const fs::path image = fs::path(yaml_path).replace_extension(".pgm");
  if (image == yaml_path) return fail(ErrorCode::invalid, "{}: expected a name that ends with .yaml", yaml_path);
  // 254, 0, 205: the last is 0.19608 occupied, which is unknown from free_thresh on, and below it free.
  constexpr char kFree = '\xfe', kOccupied = '\0', kUnknown = '\xcd';
  std::string pgm = fmt::format("P5\n{} {}\n255\n", grid.width, grid.height);
  for (std::size_t y = grid.height; y-- > 0;)  // images begin at the top
    for (std::size_t x = 0; x < grid.width; ++x) {
      const OccupancyGrid::Cell cell = grid.at(x, y);
      pgm += cell == OccupancyGrid::free ? kFree : cell == OccupancyGrid::occupied ? kOccupied : kUnknown;
    }
  if (auto ok = write_file(image.string(), pgm); !ok) return ok;
  std::string yaml;
  for (const std::string& note : notes) yaml += "# " + note + "\n";
  yaml += fmt::format(
      "image: {}\nmode: trinary\nresolution: {}\norigin: [{}, {}, 0]\nnegate: 0\noccupied_thresh: 0.65\n"
      "free_thresh: 0.196\n",
      yaml_quoted(image.filename().string()), grid.resolution_m, grid.origin.x(), grid.origin.y());
  return write_file(yaml_path, yaml);
}

}  // namespace tutti::grids
