// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "tutti/base/result.hpp"

namespace tutti::bags::internal {

inline constexpr std::string_view kZstdMagic = "\x28\xb5\x2f\xfd";

/// The content of a file that is packed by zstd, in a file among the system's temporary ones, which is gone with this.
class PackedFile {
 public:
  /// Unpacks piece by piece. The content of a file that is cut off is kept up to the cut. More than most_unpacked(its
  /// size, `little`) is an error.
  static Result<PackedFile> unpack(const std::string& path, std::uint64_t little = std::uint64_t{1} << 30);
  ~PackedFile();
  PackedFile(PackedFile&& other) noexcept : path_(std::exchange(other.path_, {})) {}
  PackedFile& operator=(PackedFile&&) = delete;
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  explicit PackedFile(std::string path) : path_(std::move(path)) {}
  std::string path_;
};

/// A message that rosbag2 packed by itself: one frame of zstd's that states its size.
Result<std::string> unpack_message(std::string_view packed);

}  // namespace tutti::bags::internal
