// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/frontend/internal/spread.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

namespace tutti::visual::internal {
namespace {

/// Pixels near a place that is taken.
class Occupied {
 public:
  explicit Occupied(const SpreadRule& rule)
      : rule_(rule), pixels_(static_cast<std::size_t>(rule.width_px) * static_cast<std::size_t>(rule.height_px)) {}

  [[nodiscard]] bool at(const Eigen::Vector2f& pixel) const {
    return pixels_[index(row(pixel)) + index(column(pixel))];
  }
  void take(const Eigen::Vector2f& pixel) {
    const int reach = rule_.distance_px - 1;
    const int left = std::max(0, column(pixel) - reach), right = std::min(rule_.width_px - 1, column(pixel) + reach);
    const int top = std::max(0, row(pixel) / rule_.width_px - reach);
    const int bottom = std::min(rule_.height_px - 1, row(pixel) / rule_.width_px + reach);
    for (int y = top; y <= bottom; ++y) {
      const auto begin = pixels_.begin() + static_cast<std::ptrdiff_t>(y) * rule_.width_px;
      std::fill(begin + left, begin + right + 1, true);
    }
  }

 private:
  static std::size_t index(int i) { return static_cast<std::size_t>(i); }
  [[nodiscard]] int column(const Eigen::Vector2f& pixel) const {
    return std::clamp(static_cast<int>(pixel.x() + 0.5F), 0, rule_.width_px - 1);
  }
  [[nodiscard]] int row(const Eigen::Vector2f& pixel) const {  // where it begins
    return std::clamp(static_cast<int>(pixel.y() + 0.5F), 0, rule_.height_px - 1) * rule_.width_px;
  }
  SpreadRule rule_;
  std::vector<bool> pixels_;
};

}  // namespace

std::vector<std::size_t> spread(std::span<const Candidate> candidates, std::span<const Eigen::Vector2f> taken,
                                const SpreadRule& rule) {
  const int columns = rule.width_px / rule.cell_px + 1, rows = rule.height_px / rule.cell_px + 1;
  const auto cell_of = [&](const Eigen::Vector2f& pixel) {
    const int column = std::clamp(static_cast<int>(pixel.x()) / rule.cell_px, 0, columns - 1);
    const int row = std::clamp(static_cast<int>(pixel.y()) / rule.cell_px, 0, rows - 1);
    return static_cast<std::size_t>(row * columns + column);
  };
  Occupied occupied(rule);
  std::vector<int> in_cell(static_cast<std::size_t>(columns * rows));
  for (const Eigen::Vector2f& pixel : taken) {
    occupied.take(pixel);
    ++in_cell[cell_of(pixel)];
  }

  std::vector<std::size_t> strongest(candidates.size());
  std::iota(strongest.begin(), strongest.end(), std::size_t{0});
  std::ranges::stable_sort(strongest, std::greater{}, [&](std::size_t i) { return candidates[i].strength; });
  std::vector<std::pair<int, std::size_t>> ranked;  // its rank in its cell, candidate
  for (const std::size_t i : strongest) {
    if (occupied.at(candidates[i].pixel)) continue;
    occupied.take(candidates[i].pixel);
    ranked.emplace_back(in_cell[cell_of(candidates[i].pixel)]++, i);
  }
  std::ranges::stable_sort(ranked, {}, &std::pair<int, std::size_t>::first);

  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < ranked.size() && i < rule.most; ++i) chosen.push_back(ranked[i].second);
  return chosen;
}

}  // namespace tutti::visual::internal
