// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <random>
#include <string_view>

#include "tutti/base/content_hash.hpp"

namespace tutti {

/// A bijection of 64-bit numbers in which every bit of the result depends on every bit of x: the finaliser of
/// splitmix64 (Steele, Lea, Flood 2014).
constexpr std::uint64_t mixed(std::uint64_t x) {
  x = (x ^ (x >> 30U)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27U)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31U);
}

/// Seeded randomness, always handed in, never global. fork("alpha/odometry") gives an independent stream that depends
/// only on the seed and the name, so adding a consumer never changes what the others draw. Draws of one Rng are a
/// sequence: one thread at a time. One that never draws costs nothing, so a long name may be forked part by part.
class Rng {
 public:
  explicit Rng(std::uint64_t seed) : seed_(mixed(seed)) {}

  [[nodiscard]] Rng fork(std::string_view name) const { return Rng(seed_ ^ content_hash(name)); }
  [[nodiscard]] Rng fork(std::uint64_t number) const { return Rng(seed_ ^ mixed(number + 0x9e3779b97f4a7c15ULL)); }

  /// Uniform in [low, high).
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine()); }
  /// Uniform in {0, ..., n - 1}; n > 0.
  std::uint64_t index(std::uint64_t n) { return std::uniform_int_distribution<std::uint64_t>(0, n - 1)(engine()); }
  double normal(double sigma = 1.0) { return sigma * std::normal_distribution<double>(0.0, 1.0)(engine()); }
  bool bernoulli(double probability) { return uniform(0.0, 1.0) < probability; }

 private:
  std::mt19937_64& engine() {
    if (!engine_) engine_.emplace(seed_);
    return *engine_;
  }
  std::uint64_t seed_;
  std::optional<std::mt19937_64> engine_;  // none before the first draw
};

}  // namespace tutti
