// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/check_map_file.hpp"

#include <fstream>
#include <string>

#include "tutti/base/file_kind.hpp"

namespace tutti::mapfile {

Status check_map_file(const std::filesystem::path& file) {
  std::error_code failure;
  if (std::filesystem::is_directory(file, failure))
    return fail(
        ErrorCode::invalid,
        "{0}: is a folder, expected a map of Tutti's (.tutti): tutti map list {0} names those in it; of the bags in "
        "it tutti run {0} --out out/mine --map out/mine.tutti makes one",
        file.string());
  if (!std::filesystem::is_regular_file(file, failure))
    return fail(ErrorCode::io, "{}: no such file, expected a map", file.string());
  std::string head(kHeadBytes, '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(in.gcount()));
  const std::string what = known_otherwise(head, file.string(), FileUse::map);
  return what.empty() ? Status() : fail(ErrorCode::unsupported, "{}: {}", file.string(), what);
}

}  // namespace tutti::mapfile
