// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/front_tree.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <map>
#include <numeric>

#include "tutti/base/random.hpp"
#include "tutti/estimation/internal/dissection.hpp"

extern "C" void openblas_set_num_threads(int threads);
extern "C" int openblas_get_num_threads();

namespace tutti::estimation::internal {
namespace {

using Pair = FrontTree::Pair;

/// A matrix that changes: variables by name, in increasing order, and blocks between names (larger name first).
struct Changing {
  std::vector<int> names;
  std::map<Pair, Matrix6d> blocks;

  [[nodiscard]] int at(int name) const {
    return static_cast<int>(std::lower_bound(names.begin(), names.end(), name) - names.begin());
  }
  [[nodiscard]] std::vector<Pair> pairs() const {
    std::vector<Pair> out;
    for (const auto& [key, value] : blocks)
      if (key.first != key.second) out.emplace_back(at(key.first), at(key.second));
    return out;
  }
  [[nodiscard]] Eigen::MatrixXd dense() const {
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(6 * std::ssize(names), 6 * std::ssize(names));
    for (const auto& [key, value] : blocks) {
      A.block<6, 6>(6 * at(key.first), 6 * at(key.second)) = value;
      A.block<6, 6>(6 * at(key.second), 6 * at(key.first)) = value.transpose();
    }
    return A;
  }
  [[nodiscard]] FrontTree::Assemble assemble() const {
    return [this](int v, FrontTree::Column& column) {
      for (const auto& [key, value] : blocks) {
        const int a = at(key.first);
        const int b = at(key.second);
        if (a == v && b == v) column.add_diagonal(value);
        if (b == v && a != v && column.takes(a)) column.add(a, value);
        if (a == v && b != v && column.takes(b)) column.add(b, value.transpose());
      }
    };
  }
};

Matrix6d random_block(Rng& rng, double scale) {
  Matrix6d m;
  for (double& x : m.reshaped()) x = rng.normal(scale);
  return m;
}

Matrix6d random_diagonal(Rng& rng) {
  const Matrix6d m = random_block(rng, 0.3);
  return m * m.transpose() + 12.0 * Matrix6d::Identity();  // dominates up to a dozen neighbours
}

/// The names whose column changed in pattern.
std::vector<int> change_pattern(Rng& rng, Changing& matrix, int new_name) {
  std::vector<int> touched;
  if (matrix.names.size() > 3 && rng.bernoulli(0.3)) {
    const int gone = matrix.names[rng.index(matrix.names.size())];
    for (const auto& [key, value] : matrix.blocks)
      if (key.first == gone || key.second == gone) touched.insert(touched.end(), {key.first, key.second});
    std::erase_if(matrix.blocks, [&](const auto& e) { return e.first.first == gone || e.first.second == gone; });
    std::erase(matrix.names, gone);
  }
  matrix.names.insert(matrix.names.begin() + matrix.at(new_name), new_name);
  matrix.blocks[{new_name, new_name}] = random_diagonal(rng);
  touched.push_back(new_name);
  for (int k = 0; k < 2; ++k) {
    const int other = matrix.names[rng.index(matrix.names.size())];
    if (other == new_name) continue;
    matrix.blocks[std::minmax(other, new_name, std::greater<>())] = random_block(rng, 0.2);
    touched.push_back(other);
  }
  return touched;
}

std::vector<int> renumbering(const std::vector<int>& before, const Changing& now) {
  std::vector<int> out;
  for (const int name : before)
    out.push_back(std::binary_search(now.names.begin(), now.names.end(), name) ? now.at(name) : -1);
  return out;
}

double error_of(FrontTree& tree, const Changing& matrix, Rng& rng) {
  Eigen::VectorXd b(6 * std::ssize(matrix.names));
  for (double& x : b) x = rng.normal(1.0);
  Eigen::VectorXd x = b;
  tree.solve(x);
  return (matrix.dense() * x - b).norm() / b.norm();
}

RC_GTEST_PROP(FrontTree, SolvesAfterAnyHistoryOfChanges, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  Changing matrix;
  FrontTree tree;
  for (int update = 0; update < 40; ++update) {
    const auto before = matrix.names;
    const auto touched = change_pattern(rng, matrix, (update * 17) % 41);
    std::vector<char> changed(matrix.names.size(), 0);
    for (const int name : touched)
      if (std::binary_search(matrix.names.begin(), matrix.names.end(), name)) changed[matrix.at(name)] = 1;
    tree.restructure(static_cast<int>(matrix.names.size()), renumbering(before, matrix), changed, matrix.pairs());
    RC_ASSERT(tree.factorise(matrix.assemble()));
    RC_ASSERT(error_of(tree, matrix, rng) < 1e-12);

    const int name = matrix.names[rng.index(matrix.names.size())];  // a value, not the pattern
    matrix.blocks[{name, name}] = random_diagonal(rng);
    tree.touch(matrix.at(name));
    RC_ASSERT(tree.factorise(matrix.assemble()));
    RC_ASSERT(error_of(tree, matrix, rng) < 1e-12);
  }
}

/// A corridor driven up and down, with links across.
Changing ladder(Rng& rng, int rungs) {
  Changing m;
  m.names.resize(2 * rungs);
  std::iota(m.names.begin(), m.names.end(), 0);
  for (int v = 0; v < 2 * rungs; ++v) {
    m.blocks[{v, v}] = random_diagonal(rng);
    if (v > 0) m.blocks[{v, v - 1}] = random_block(rng, 0.2);
    if (v < rungs - 1) m.blocks[{2 * rungs - 1 - v, v}] = random_block(rng, 0.2);
  }
  return m;
}

TEST(FrontTree, ComputesLittleAfterASmallChange) {
  Rng rng(1);
  Changing m = ladder(rng, 100);
  FrontTree tree;
  tree.restructure(200, {}, std::vector<char>(200, 1), m.pairs());
  ASSERT_TRUE(tree.factorise(m.assemble()));
  EXPECT_EQ(tree.computed(), 200);
  ASSERT_TRUE(tree.factorise(m.assemble()));
  EXPECT_EQ(tree.computed(), 0);
  for (int v = 0; v < 200; ++v) {
    tree.touch(v);
    ASSERT_TRUE(tree.factorise(m.assemble()));
    EXPECT_LE(tree.computed(), 24) << v;
  }
  m.blocks[{60, 55}] = random_block(rng, 0.2);
  std::vector<char> changed(200, 0);
  changed[55] = changed[60] = 1;
  std::vector<int> same(200);
  std::iota(same.begin(), same.end(), 0);
  tree.restructure(200, same, changed, m.pairs());
  ASSERT_TRUE(tree.factorise(m.assemble()));
  EXPECT_LE(tree.computed(), 40);
  EXPECT_LT(error_of(tree, m, rng), 1e-12);
}

/// Whoever uses the library may have set BLAS to anything: its threads are slower on fronts of our size, and other
/// bits.
TEST(FrontTree, FactorisesOnOneThread) {
  Rng rng(3);
  const Changing m = ladder(rng, 20);
  FrontTree tree;
  tree.restructure(40, {}, std::vector<char>(40, 1), m.pairs());
  openblas_set_num_threads(3);
  int most = 0;
  ASSERT_TRUE(tree.factorise([&, assemble = m.assemble()](int variable, FrontTree::Column& column) {
    most = std::max(most, openblas_get_num_threads());
    assemble(variable, column);
  }));
  EXPECT_EQ(most, 1);
  EXPECT_EQ(openblas_get_num_threads(), 3);
  openblas_set_num_threads(1);
}

/// Fronts large enough for BLAS, whose size is no multiple of anything.
TEST(FrontTree, SolvesWhereAllAreNeighbours) {
  Rng rng(3);
  Changing m = ladder(rng, 20);
  for (int a = 0; a < 23; ++a)
    for (int b = 0; b < a; ++b) m.blocks[{a, b}] = random_block(rng, 0.05);
  FrontTree tree;
  tree.restructure(40, {}, std::vector<char>(40, 1), m.pairs());
  ASSERT_TRUE(tree.factorise(m.assemble()));
  EXPECT_LT(error_of(tree, m, rng), 1e-12);
  const Matrix6d good = m.blocks[{7, 7}];
  m.blocks[{7, 7}] = -good;
  tree.touch(7);
  EXPECT_FALSE(tree.factorise(m.assemble()));
  m.blocks[{7, 7}] = good;
  EXPECT_TRUE(tree.factorise(m.assemble()));
  EXPECT_LT(error_of(tree, m, rng), 1e-12);
}

TEST(FrontTree, SaysWhenNotPositiveDefinite) {
  Rng rng(2);
  Changing m = ladder(rng, 10);
  FrontTree tree;
  tree.restructure(20, {}, std::vector<char>(20, 1), m.pairs());
  const Matrix6d good = m.blocks[{7, 7}];
  m.blocks[{7, 7}] = Vector6d(1, 1, 1, 1, 1, -1).asDiagonal();
  EXPECT_FALSE(tree.factorise(m.assemble()));
  m.blocks[{7, 7}] = good;
  EXPECT_TRUE(tree.factorise(m.assemble()));
  EXPECT_LT(error_of(tree, m, rng), 1e-12);
}

RC_GTEST_PROP(Dissection, OrdersEveryVertexOnce, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  const int n = static_cast<int>(rng.index(60));
  std::vector<Pair> pairs;
  for (std::uint64_t k = n > 0 ? rng.index(120) : 0; k > 0; --k)
    pairs.emplace_back(static_cast<int>(rng.index(n)), static_cast<int>(rng.index(n)));
  auto order = dissect(make_adjacency(n, pairs));
  std::sort(order.begin(), order.end());
  std::vector<int> all(n);
  std::iota(all.begin(), all.end(), 0);
  RC_ASSERT(order == all);
}

}  // namespace
}  // namespace tutti::estimation::internal
