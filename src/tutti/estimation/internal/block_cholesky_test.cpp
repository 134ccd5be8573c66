// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/block_cholesky.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tutti/base/random.hpp"

namespace tutti::estimation::internal {
namespace block_cholesky_test {

using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;

struct Case {
  std::string name;
  std::size_t nodes = 0;
  Pairs pairs;
};

Pairs chain(std::size_t first, std::size_t last) {
  Pairs out;
  for (std::size_t k = first; k < last; ++k) out.emplace_back(k, k + 1);
  return out;
}

std::vector<Case> cases() {
  std::vector<Case> out{{"one", 2, {{0, 1}}}, {"chain", 120, chain(0, 119)}};
  Pairs star, dense, forest = chain(0, 20), loops = chain(0, 99);
  for (std::size_t k = 1; k < 60; ++k) star.emplace_back(0, k);
  for (std::size_t a = 0; a < 25; ++a)
    for (std::size_t b = a + 1; b < 25; ++b) dense.emplace_back(a, b);
  for (const auto& [a, b] : chain(21, 60)) forest.emplace_back(a, b);
  forest.emplace_back(25, 50);
  Rng rng(5);
  for (int k = 0; k < 70; ++k) loops.emplace_back(rng.index(100), rng.index(100));
  std::erase_if(loops, [](const auto& pair) { return pair.first == pair.second; });
  out.push_back({"star", 60, star});
  out.push_back({"dense", 25, dense});
  out.push_back({"forest", 62, forest});  // and a node without edges
  out.push_back({"loops", 100, loops});
  return out;
}

PoseGraph graph_of(const Case& given) {
  PoseGraph graph;
  graph.poses.resize(given.nodes);
  for (const auto& [a, b] : given.pairs) graph.edges.push_back({.from = a, .to = b});
  return graph;
}

/// A matrix on the pattern of a graph, as a sparse one is filled and as a whole.
template <int B>
Eigen::MatrixXd fill(const BlockStructure& structure, BlockCholesky& matrix, Rng& rng, double scale) {
  using Block = Eigen::Matrix<double, B, B>;
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(B * structure.variables, B * structure.variables);
  matrix.set_zero();
  const auto random = [&] {
    Block out;
    for (double& value : out.reshaped()) value = scale * rng.normal();
    return out;
  };
  for (const EdgeSlot& slot : structure.edges) {
    // As an edge of a pose graph has it: J^T J of both ends.
    const Block from = random(), to = random();
    if (slot.from >= 0) matrix.add_diagonal(slot.from, Block(from.transpose() * from));
    if (slot.to >= 0) matrix.add_diagonal(slot.to, Block(to.transpose() * to));
    if (slot.from >= 0 && slot.to >= 0) matrix.add_edge(slot, Block(from.transpose() * to));
    if (slot.from >= 0) dense.block<B, B>(B * slot.from, B * slot.from) += from.transpose() * from;
    if (slot.to >= 0) dense.block<B, B>(B * slot.to, B * slot.to) += to.transpose() * to;
    if (slot.from < 0 || slot.to < 0) continue;
    dense.block<B, B>(B * slot.from, B * slot.to) += from.transpose() * to;
    dense.block<B, B>(B * slot.to, B * slot.from) += to.transpose() * from;
  }
  for (int v = 0; v < structure.variables; ++v) {
    const Block more = scale * scale * Block::Identity();
    matrix.add_diagonal(v, more);
    dense.block<B, B>(B * v, B * v) += more;
  }
  return dense;
}

/// By the rows of its supernodes.
template <int B>
Eigen::MatrixXd dense_of(const CholeskyFactor& factor) {
  const auto size = static_cast<Eigen::Index>(B * factor.block_columns());
  Eigen::MatrixXd L = Eigen::MatrixXd::Zero(size, size);
  for (std::size_t s = 0; s < factor.layout->supernodes.size(); ++s) {
    const Supernode& node = factor.layout->supernodes[s];
    const Eigen::Map<const Eigen::MatrixXd> panel(factor.panel(s), factor.layout->panels[s].rows,
                                                  factor.layout->panels[s].columns);
    for (int p = 0; p < node.rows(); ++p) {
      L.block(B * node.row_at(p), B * node.first, B, panel.cols()) = panel.middleRows(B * p, B);
    }
  }
  return L.triangularView<Eigen::Lower>();
}

template <int B>
void expect_factor(const Case& given, std::size_t workspace) {
  const BlockStructure structure = analyse_blocks(graph_of(given));
  BlockCholesky matrix(structure, B, workspace);
  Rng rng(1);
  for (const double scale : {1.0, 1e4, 1e-4}) {  // the second and third time in the place of the first
    const Eigen::MatrixXd dense = fill<B>(structure, matrix, rng, scale);
    ASSERT_TRUE(matrix.factorise()) << given.name;
    const Eigen::MatrixXd L = dense_of<B>(matrix.factor());
    ASSERT_EQ(L.rows(), dense.rows());
    EXPECT_LT((L * L.transpose() - dense).norm(), 1e-12 * dense.norm()) << given.name;
    Eigen::MatrixXd all(dense.rows(), 5);  // with room below what is solved, as in a larger matrix
    for (double& value : all.reshaped()) value = rng.normal();
    const Eigen::MatrixXd expected = dense.llt().solve(all.leftCols(3));
    matrix.solve(all.leftCols(3));
    EXPECT_LT((all.leftCols(3) - expected).norm(), 1e-9 * expected.norm()) << given.name;
    const Eigen::MatrixXd of_one = dense.llt().solve(all.rightCols(1));
    matrix.solve(all.rightCols(1));
    EXPECT_LT((all.rightCols(1) - of_one).norm(), 1e-9 * of_one.norm()) << given.name;
  }
}

TEST(BlockCholesky, IsThatOfTheDenseMatrix) {
  for (const Case& given : cases()) {
    for (const std::size_t workspace : {BlockCholesky::kWorkspace, 400UL, 0UL}) expect_factor<6>(given, workspace);
    expect_factor<3>(given, BlockCholesky::kWorkspace);
  }
}

TEST(BlockCholesky, RefusesWhatIsNotPositiveDefiniteAndGoesOnWithWhatIs) {
  const BlockStructure structure = analyse_blocks(graph_of(cases().back()));
  BlockCholesky matrix(structure, 6);
  Rng rng(2);
  fill<6>(structure, matrix, rng, 1.0);
  matrix.add_diagonal(structure.variables / 2, Matrix6d(-1e6 * Matrix6d::Identity()));
  EXPECT_FALSE(matrix.factorise());
  EXPECT_THROW(static_cast<void>(matrix.factor()), std::logic_error);
  EXPECT_THROW(static_cast<void>(matrix.take_factor()), std::logic_error);
  fill<6>(structure, matrix, rng, 1.0);
  EXPECT_TRUE(matrix.factorise());
  const Eigen::MatrixXd L = dense_of<6>(matrix.factor());
  EXPECT_EQ(dense_of<6>(matrix.take_factor()), L);
  EXPECT_THROW(static_cast<void>(matrix.factor()), std::logic_error);  // until it is factorised again
  EXPECT_TRUE(matrix.factorise());
  EXPECT_EQ(dense_of<6>(matrix.factor()), L);
  matrix.set_zero();
  EXPECT_FALSE(matrix.factorise());
}

TEST(BlockCholesky, RefusesPivotsWithoutACorrectDigit) {
  const BlockStructure structure = analyse_blocks(graph_of({"chain", 3, chain(0, 2)}));
  BlockCholesky matrix(structure, 6);
  const Matrix6d I = Matrix6d::Identity();
  for (const double share : {1e-3, 1e-15}) {
    matrix.set_zero();
    for (int v = 0; v < 2; ++v) matrix.add_diagonal(v, Matrix6d(1e8 * (1.0 + share) * I));
    const auto edge = std::ranges::find_if(structure.edges, [](const EdgeSlot& slot) { return slot.block >= 0; });
    matrix.add_edge(*edge, Matrix6d(-1e8 * I));
    EXPECT_EQ(matrix.factorise(), share > 1e-14) << share;
  }
}

// Nothing of the pattern is lost, and panels do not fill up with zeros.
TEST(Supernodes, HoldTheFactorsPatternAndFewZerosMore) {
  for (const Case& given : cases()) {
    const BlockStructure structure = analyse_blocks(graph_of(given));
    const std::vector<Supernode> nodes = find_supernodes(structure);
    int next = 0;
    for (const Supernode& node : nodes) {
      EXPECT_EQ(node.first, next);
      next = node.end();
      EXPECT_TRUE(std::ranges::is_sorted(node.below));
      std::size_t below = 0;
      for (const Supernode::Ancestor& ancestor : node.ancestors) {
        const Supernode& of = nodes[static_cast<std::size_t>(ancestor.supernode)];
        EXPECT_EQ(ancestor.begin, below);
        below = ancestor.end;
        EXPECT_TRUE(node.below[ancestor.begin] >= of.first && node.below[ancestor.end - 1] < of.end());
        for (std::size_t k = 0; k < ancestor.at.size(); ++k) {
          const int at = ancestor.at[k], row = node.below[ancestor.begin + k];
          EXPECT_EQ(row, at < of.columns ? of.first + at : of.below.at(static_cast<std::size_t>(at - of.columns)));
        }
      }
      EXPECT_EQ(below, node.below.size());
    }
    EXPECT_EQ(next, structure.variables);
  }
  const auto wide = find_supernodes(analyse_blocks(graph_of(cases()[1])));
  EXPECT_LE(wide.size(), 60U);  // 119 columns of a chain
  EXPECT_EQ(find_supernodes(analyse_blocks(graph_of(cases()[3]))).size(), 1U);
}

}  // namespace block_cholesky_test
}  // namespace tutti::estimation::internal
