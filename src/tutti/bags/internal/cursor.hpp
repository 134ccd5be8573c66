// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/format.h>

#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>

namespace tutti::bags::internal {

/// Takes numbers and strings from bytes of outside, one after the other, each length checked against what is left.
/// After the first thing that is not there, `error()` names it, and all that is taken is zero or empty.
class Cursor {
 public:
  enum class Order { little, big };
  /// MCAP and ROS 1 pack their numbers; CDR aligns each to its own size, counted from the first of `bytes`.
  enum class Layout { packed, aligned };

  explicit Cursor(std::string_view bytes, Order order = Order::little, Layout layout = Layout::packed)
      : bytes_(bytes), order_(order), layout_(layout) {}

  [[nodiscard]] Layout layout() const { return layout_; }
  [[nodiscard]] Order order() const { return order_; }
  [[nodiscard]] std::size_t at() const { return at_; }
  [[nodiscard]] std::size_t left() const { return bytes_.size() - at_; }
  [[nodiscard]] bool ok() const { return !error_; }
  /// "byte 12: topic wants 400 bytes, 3 are left"
  [[nodiscard]] const std::optional<std::string>& error() const { return error_; }
  void complain(std::string message) {
    if (!error_) error_ = fmt::format("byte {}: {}", at_, message);
  }

  template <class T>
  requires std::integral<T> || std::floating_point<T> T number(std::string_view what) {
    if (layout_ == Layout::aligned) take((sizeof(T) - at_ % sizeof(T)) % sizeof(T), what);
    const std::string_view raw = take(sizeof(T), what);
    T value{};
    if (raw.size() != sizeof(T)) return value;
    char bytes[sizeof(T)];
    const bool swapped = (order_ == Order::big) == (std::endian::native == std::endian::little);
    for (std::size_t i = 0; i < sizeof(T); ++i) bytes[i] = raw[swapped ? sizeof(T) - 1 - i : i];
    std::memcpy(&value, bytes, sizeof(T));
    return value;
  }

  /// A view into the bytes; empty where there are not so many.
  std::string_view take(std::uint64_t size, std::string_view what) {
    if (error_) return {};
    if (size > left()) {
      complain(fmt::format("{} wants {} bytes, {} are left", what, size, left()));
      return {};
    }
    const std::string_view out = bytes_.substr(at_, size);
    at_ += size;
    return out;
  }

  /// Bytes behind a 4-byte length.
  std::string_view counted(std::string_view what) { return take(number<std::uint32_t>(what), what); }

 private:
  std::string_view bytes_;
  std::size_t at_ = 0;
  Order order_;
  Layout layout_;
  std::optional<std::string> error_;
};

}  // namespace tutti::bags::internal
