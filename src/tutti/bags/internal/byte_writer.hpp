// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "tutti/bags/internal/cursor.hpp"

namespace tutti::bags::internal {

/// The inverse of Cursor, little endian alone: puts numbers and strings one behind the other.
class ByteWriter {
 public:
  using Layout = Cursor::Layout;
  explicit ByteWriter(Layout layout = Layout::packed) : layout_(layout) {}

  template <class T>
  requires std::integral<T> || std::floating_point<T> ByteWriter& number(T value) {
    static_assert(std::endian::native == std::endian::little);
    if (layout_ == Layout::aligned) out_.append((sizeof(T) - out_.size() % sizeof(T)) % sizeof(T), '\0');
    out_.append(reinterpret_cast<const char*>(&value), sizeof value);
    return *this;
  }
  template <class T>
  ByteWriter& numbers(std::span<const T> values) {
    for (const T value : values) number(value);
    return *this;
  }
  ByteWriter& raw(std::string_view bytes) {
    out_.append(bytes);
    return *this;
  }
  /// Behind a 4-byte length.
  ByteWriter& counted(std::string_view bytes) { return number(static_cast<std::uint32_t>(bytes.size())).raw(bytes); }

  [[nodiscard]] std::size_t size() const { return out_.size(); }
  [[nodiscard]] const std::string& bytes() const { return out_; }
  [[nodiscard]] std::string take() { return std::exchange(out_, {}); }

 private:
  std::string out_;
  Layout layout_;
};

}  // namespace tutti::bags::internal
