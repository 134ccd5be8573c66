// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

/// Sequences of integers as differences, and rows of K integers as K columns of differences.
namespace tutti::wire {

/// Wraps around instead of overflowing; undone by the wrap-around of `add`.
inline std::int64_t difference(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b));
}
inline std::int64_t sum(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) + static_cast<std::uint64_t>(b));
}

/// `out` is a protobuf repeated field.
template <std::size_t K, class RepeatedField>
void write_columns(const std::vector<std::array<std::int64_t, K>>& rows, RepeatedField& out) {
  out.Reserve(static_cast<int>(K * rows.size()));
  for (std::size_t column = 0; column < K; ++column) {
    std::int64_t previous = 0;
    for (const auto& row : rows) {
      out.Add(difference(row[column], previous));
      previous = row[column];
    }
  }
}

/// Nothing unless there are exactly K columns of `count`.
template <std::size_t K, class RepeatedField>
std::optional<std::vector<std::array<std::int64_t, K>>> read_columns(const RepeatedField& in, std::size_t count) {
  if (static_cast<std::size_t>(in.size()) != K * count) return std::nullopt;
  std::vector<std::array<std::int64_t, K>> rows(count);
  int at = 0;
  for (std::size_t column = 0; column < K; ++column) {
    std::int64_t value = 0;
    for (auto& row : rows) row[column] = value = sum(value, in.Get(at++));
  }
  return rows;
}

}  // namespace tutti::wire
