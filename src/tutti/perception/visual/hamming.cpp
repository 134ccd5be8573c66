// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/hamming.hpp"

#include <algorithm>
#include <bit>
#include <cstddef>

#include "tutti/base/check.hpp"

namespace tutti::visual {
namespace {

[[gnu::always_inline]] inline std::uint32_t distance(std::span<const std::uint64_t> a,
                                                     std::span<const std::uint64_t> b) {
  int bits = 0;
  for (std::size_t w = 0; w < a.size(); ++w) bits += std::popcount(a[w] ^ b[w]);
  return static_cast<std::uint32_t>(bits);
}

/// Words is the number of words where it is known when this is compiled, otherwise 0.
template <std::uint32_t Words>
[[gnu::always_inline]] inline void near_rows(const std::uint64_t* query, const Descriptors& rows, std::uint32_t most,
                                             std::vector<NearRow>& out) {
  const std::uint32_t n = Words == 0 ? rows.words : Words;
  const std::uint64_t* row = rows.bits.data();
  const auto size = static_cast<std::uint32_t>(rows.size());
  for (std::uint32_t i = 0; i < size; ++i, row += n) {
    std::uint32_t bits = 0;
    for (std::uint32_t w = 0; w < n; ++w) bits += static_cast<std::uint32_t>(std::popcount(query[w] ^ row[w]));
    if (bits <= most) [[unlikely]]
      out.push_back({i, bits});
  }
}

[[gnu::always_inline]] inline void all_near_rows(const std::uint64_t* query, const Descriptors& rows,
                                                 std::uint32_t most, std::vector<NearRow>& out) {
  switch (rows.words) {
    case 4:
      return near_rows<4>(query, rows, most, out);
    case 6:
      return near_rows<6>(query, rows, most, out);
    case 8:
      return near_rows<8>(query, rows, most, out);
    default:
      return near_rows<0>(query, rows, most, out);
  }
}

[[gnu::always_inline]] inline std::uint32_t distance_to_nearest(std::span<const std::uint64_t> query,
                                                                const Descriptors& rows,
                                                                std::span<const std::uint32_t> which) {
  std::uint32_t least = kNoDistance;
  for (const std::uint32_t i : which) least = std::min(least, distance(query, rows.row(i)));
  return least;
}

#ifdef __x86_64__
[[gnu::target("popcnt")]] std::uint32_t with_popcnt(std::span<const std::uint64_t> a,
                                                    std::span<const std::uint64_t> b) {
  return distance(a, b);
}
[[gnu::target("popcnt")]] std::uint32_t with_popcnt(std::span<const std::uint64_t> query, const Descriptors& rows,
                                                    std::span<const std::uint32_t> which) {
  return distance_to_nearest(query, rows, which);
}
[[gnu::target("popcnt")]] void with_popcnt(const std::uint64_t* query, const Descriptors& rows, std::uint32_t most,
                                           std::vector<NearRow>& out) {
  all_near_rows(query, rows, most, out);
}
bool has_popcnt() {
  static const bool has = __builtin_cpu_supports("popcnt") != 0;
  return has;
}
#endif

}  // namespace

std::uint32_t hamming_distance(std::span<const std::uint64_t> a, std::span<const std::uint64_t> b) {
  TUTTI_CHECK(a.size() == b.size(), "descriptors of {} and {} words", a.size(), b.size());
#ifdef __x86_64__
  if (has_popcnt()) return with_popcnt(a, b);
#endif
  return distance(a, b);
}

std::uint32_t least_distance(std::span<const std::uint64_t> query, const Descriptors& rows,
                             std::span<const std::uint32_t> which) {
  TUTTI_CHECK(query.size() == rows.words, "{} words against rows of {}", query.size(), rows.words);
#ifdef __x86_64__
  if (has_popcnt()) return with_popcnt(query, rows, which);
#endif
  return distance_to_nearest(query, rows, which);
}

void rows_within(std::span<const std::uint64_t> query, const Descriptors& rows, std::uint32_t most,
                 std::vector<NearRow>& out) {
  TUTTI_CHECK(query.size() == rows.words || rows.size() == 0, "{} words against rows of {}", query.size(), rows.words);
  out.clear();
#ifdef __x86_64__
  if (has_popcnt()) return with_popcnt(query.data(), rows, most, out);
#endif
  all_near_rows(query.data(), rows, most, out);
}

}  // namespace tutti::visual
