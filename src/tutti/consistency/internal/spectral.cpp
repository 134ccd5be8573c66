// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <limits>

#include "tutti/base/check.hpp"
#include "tutti/consistency/internal/policies.hpp"
#include "tutti/consistency/links.hpp"

namespace tutti::consistency::internal {
namespace {

/// A node that a group of scales asks constraints for.
struct Label {
  std::size_t node = 0;
  double excess = 0.0;  ///< Disagreement over threshold.
};
using Labels = std::array<std::vector<Label>, 3>;  ///< Per group: large, mid, small.

constexpr std::array kKinds = {ConstraintKind::large, ConstraintKind::mid, ConstraintKind::small};

/// nodes x 3: the disagreement of each group is the sum over its scales, large [0, 1], mid [2, 3], small the rest.
Eigen::MatrixX3d group_sums(const Eigen::MatrixXd& disagreement) {
  const Eigen::Index scales = disagreement.cols();
  const Eigen::Index large_end = std::min<Eigen::Index>(2, scales), mid_end = std::min<Eigen::Index>(4, scales);
  Eigen::MatrixX3d sums(disagreement.rows(), 3);
  sums.col(0) = disagreement.leftCols(large_end).rowwise().sum();
  sums.col(1) = disagreement.middleCols(large_end, mid_end - large_end).rowwise().sum();
  sums.col(2) = disagreement.rightCols(scales - mid_end).rowwise().sum();
  return sums;
}

double ratio(double value, double threshold) {
  return threshold > 0.0 ? value / threshold : std::numeric_limits<double>::infinity();
}

void sort_by_excess(Labels& labels) {
  for (auto& group : labels)
    std::stable_sort(group.begin(), group.end(), [](const Label& a, const Label& b) { return a.excess > b.excess; });
}

/// The paper's: everything above its group's threshold.
Labels label_by_thresholds(const Eigen::MatrixX3d& sums, const PolicyConfig& config) {
  const std::array thresholds = {config.threshold_large_m, config.threshold_mid_m, config.threshold_small_m};
  Labels labels;
  for (std::size_t g = 0; g < 3; ++g)
    for (Eigen::Index n = 0; n < sums.rows(); ++n)
      if (const double value = sums(n, static_cast<Eigen::Index>(g)); value > thresholds[g])
        labels[g].push_back({static_cast<std::size_t>(n), ratio(value, thresholds[g])});
  sort_by_excess(labels);
  return labels;
}

/// The authors' code: the largest `top_count` over all groups, if above the one threshold.
Labels label_top(const Eigen::MatrixX3d& sums, const PolicyConfig& config) {
  struct Entry {
    std::size_t group;
    Label label;
  };
  std::vector<Entry> entries;
  for (Eigen::Index n = 0; n < sums.rows(); ++n)
    for (std::size_t g = 0; g < 3; ++g)
      if (const double value = sums(n, static_cast<Eigen::Index>(g)); value > config.top_threshold_m)
        entries.push_back({g, {static_cast<std::size_t>(n), ratio(value, config.top_threshold_m)}});
  std::stable_sort(entries.begin(), entries.end(),
                   [](const Entry& a, const Entry& b) { return a.label.excess > b.label.excess; });
  entries.resize(std::min(entries.size(), static_cast<std::size_t>(config.top_count)));
  Labels labels;
  for (const Entry& entry : entries) labels[entry.group].push_back(entry.label);
  return labels;
}

}  // namespace

Selection links_where(const PolicyInput& input, const Eigen::MatrixXd& disagreement, const PolicyConfig& config) {
  const auto rows = static_cast<std::size_t>(disagreement.rows());
  TUTTI_CHECK(rows == input.pairs.size(), "disagreement of {} of {} pairs", rows, input.pairs.size());
  LinkCollector collector(input, false);
  const Eigen::MatrixX3d sums = group_sums(disagreement);
  const Labels labels = config.classifier == "top" ? label_top(sums, config) : label_by_thresholds(sums, config);

  const Neighbourhood neighbourhood(input, config);
  const std::size_t ranks = std::max({labels[0].size(), labels[1].size(), labels[2].size()});
  for (std::size_t rank = 0; rank < ranks; ++rank)
    for (std::size_t g = 0; g < 3; ++g)
      if (rank < labels[g].size()) collector.add(neighbourhood.links(labels[g][rank].node, kKinds[g]), kKinds[g]);
  return std::move(collector).take();
}

Selection SpectralPolicy::choose(const PolicyInput& input) const {
  const Comparison comparison = compare(input.graph, input.chain, input.nodes, compare_);
  Selection out = links_where(input, comparison.disagreement, config_);
  out.order = comparison.order;
  return out;
}

}  // namespace tutti::consistency::internal
