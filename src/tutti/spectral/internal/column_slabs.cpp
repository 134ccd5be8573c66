// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/spectral/internal/column_slabs.hpp"

#include <array>
#include <cstring>

#include "tutti/base/check.hpp"
#include "tutti/spectral/internal/bandwidth.hpp"

namespace tutti::spectral::internal {
namespace {

/// Compiled to what the machine has: one register with AVX-512, two with AVX, four with SSE.
using Lanes [[gnu::vector_size(ColumnSlabs::kLanes * sizeof(float))]] = float;

[[gnu::always_inline]] inline void load(const float* from, Lanes& to) { std::memcpy(&to, from, sizeof to); }
[[gnu::always_inline]] inline void store(const Lanes& from, float* to) { std::memcpy(to, &from, sizeof from); }

constexpr std::size_t kMostSums = 16;

struct Step {
  std::span<const int> start;
  const ColumnSlabs::Entry* entry;
  float scale, shift;
  const float* x;
  float* y;
  std::size_t sums;
  std::array<float, kMostSums> weight;
  std::array<float*, kMostSums> sum;
};

/// `kChains` sums of a row run side by side, because one would wait for itself.
template <int kChains>
[[gnu::always_inline]] inline void take(const Step& step) {
  Lanes x, y, sum;
  for (std::size_t row = 0; row + 1 < step.start.size(); ++row) {
    Lanes part[kChains] = {};
    const ColumnSlabs::Entry* e = step.entry + step.start[row];
    const ColumnSlabs::Entry* const end = step.entry + step.start[row + 1];
    for (; e + kChains <= end; e += kChains)
      for (int c = 0; c < kChains; ++c) {
        load(step.x + e[c].first, x);
        part[c] += e[c].coefficient * x;
      }
    for (; e < end; ++e) {
      load(step.x + e->first, x);
      part[0] += e->coefficient * x;
    }
    for (int c = 1; c < kChains; ++c) part[0] += part[c];
    const std::size_t first = row * ColumnSlabs::kLanes;
    load(step.x + first, x);
    load(step.y + first, y);
    y = step.scale * part[0] + (step.shift * x - y);
    store(y, step.y + first);
    for (std::size_t s = 0; s < step.sums; ++s) {
      load(step.sum[s] + first, sum);
      sum += step.weight[s] * y;
      store(sum, step.sum[s] + first);
    }
  }
}

#ifdef __x86_64__
[[gnu::target("avx512f")]] void take_avx512(const Step& step) { take<4>(step); }
[[gnu::target("avx2,fma")]] void take_avx2(const Step& step) { take<4>(step); }
#endif

void take_with_what_there_is(const Step& step) {
#ifdef __x86_64__
  static const bool has_avx512 = __builtin_cpu_supports("avx512f") != 0;
  static const bool has_avx2 = __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0;
  if (has_avx512) return take_avx512(step);
  if (has_avx2) return take_avx2(step);
#endif
  take<2>(step);
}

}  // namespace

ColumnSlabs::ColumnSlabs(const SparseMatrix& matrix) : node_(bandwidth_reducing_order(matrix)), start_{0} {
  std::vector<int> first(node_.size());
  for (std::size_t place = 0; place < node_.size(); ++place)
    first[static_cast<std::size_t>(node_[place])] = static_cast<int>(place * kLanes);
  entry_.reserve(static_cast<std::size_t>(matrix.nonZeros()));
  for (const int node : node_) {
    for (SparseMatrix::InnerIterator it(matrix, node); it; ++it)
      entry_.push_back({static_cast<float>(it.value()), first[static_cast<std::size_t>(it.row())]});
    start_.push_back(static_cast<int>(entry_.size()));
  }
}

void ColumnSlabs::step(float scale, float shift, const Slab& x, Slab& y, std::span<const double> weights,
                       std::vector<Slab>& sums) const {
  TUTTI_CHECK(weights.size() <= kMostSums && weights.size() <= sums.size(), "{} sums", weights.size());
  Step step{.start = start_,
            .entry = entry_.data(),
            .scale = scale,
            .shift = shift,
            .x = x.data(),
            .y = y.data(),
            .sums = weights.size(),
            .weight = {},
            .sum = {}};
  for (std::size_t s = 0; s < weights.size(); ++s) {
    step.weight[s] = static_cast<float>(weights[s]);
    step.sum[s] = sums[s].data();
  }
  take_with_what_there_is(step);
}

}  // namespace tutti::spectral::internal
