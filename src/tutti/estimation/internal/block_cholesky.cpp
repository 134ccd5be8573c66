// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/block_cholesky.hpp"

#include <cholmod.h>

#include <algorithm>

#include "tutti/base/check.hpp"
#include "tutti/base/single_thread.hpp"

namespace tutti::estimation::internal {
namespace {

/// A pivot below this share of its diagonal entry has no correct digit left.
constexpr double kSmallestPivotShare = 1e-14;

/// Supernodes are merged up to so many blocks with at most this share of explicit zeros. CHOLMOD's defaults are made
/// for scalar unknowns; these are 30 % faster on parking-garage, 10 % on torus3D.
constexpr int kRelaxedBlocks[3] = {4, 8, 20};
constexpr double kRelaxedZeros[3] = {0.8, 0.2, 0.05};

#ifdef TUTTI_SUPERNODAL
constexpr int kFactorisation = CHOLMOD_SUPERNODAL;  // GPL part of CHOLMOD
#else
constexpr int kFactorisation = CHOLMOD_SIMPLICIAL;
#endif

}  // namespace

struct BlockCholesky::Cholmod {
  cholmod_common common;
  cholmod_sparse matrix{};
  std::vector<int> column_start, row;
  cholmod_factor* factor = nullptr;
  cholmod_dense* solution = nullptr;
  cholmod_dense* work_y = nullptr;
  cholmod_dense* work_e = nullptr;

  explicit Cholmod(int block_size) {
    cholmod_start(&common);
    common.print = 0;
    common.nmethods = 1;
    common.method[0].ordering = CHOLMOD_NATURAL;  // the structure is already in (postordered) elimination order
    common.postorder = 0;
    common.supernodal = kFactorisation;
    for (int k = 0; k < 3; ++k) {
      common.nrelax[k] = static_cast<std::size_t>(kRelaxedBlocks[k]) * block_size;
      common.zrelax[k] = kRelaxedZeros[k];
    }
    common.final_ll = 1;
    common.quick_return_if_not_posdef = 1;
  }
  ~Cholmod() {
    cholmod_free_factor(&factor, &common);
    cholmod_free_dense(&solution, &common);
    cholmod_free_dense(&work_y, &common);
    cholmod_free_dense(&work_e, &common);
    cholmod_finish(&common);
  }
  Cholmod(const Cholmod&) = delete;
  Cholmod& operator=(const Cholmod&) = delete;
};

BlockCholesky::BlockCholesky(const BlockStructure& structure, int block_size)
    : structure_(structure), block_size_(block_size), cholmod_(std::make_unique<Cholmod>(block_size)) {
  const int b = block_size;
  const auto blocks = structure.block_row.size();
  values_.assign(blocks * b * b, 0.0);
  auto& c = *cholmod_;
  c.column_start.reserve(structure.variables * b + 1);
  c.row.reserve(values_.size());
  c.column_start.push_back(0);
  for (int column = 0; column < structure.variables; ++column) {
    for (int k = 0; k < b; ++k) {
      for (int entry = structure.column_start[column]; entry < structure.column_start[column + 1]; ++entry)
        for (int r = 0; r < b; ++r) c.row.push_back(structure.block_row[entry] * b + r);
      c.column_start.push_back(static_cast<int>(c.row.size()));
    }
  }
  auto& m = c.matrix;
  m.nrow = m.ncol = static_cast<std::size_t>(structure.variables) * b;
  m.nzmax = values_.size();
  m.p = c.column_start.data();
  m.i = c.row.data();
  m.x = values_.data();
  m.stype = -1;  // entries above the diagonal, in the diagonal blocks, are ignored
  m.itype = CHOLMOD_INT;
  m.xtype = CHOLMOD_REAL;
  m.dtype = CHOLMOD_DOUBLE;
  m.sorted = 1;
  m.packed = 1;
  if (m.ncol > 0) c.factor = cholmod_analyze(&m, &c.common);
}

BlockCholesky::~BlockCholesky() = default;

void BlockCholesky::set_zero() { std::fill(values_.begin(), values_.end(), 0.0); }

bool BlockCholesky::factorise() {
  auto& c = *cholmod_;
  if (structure_.variables == 0) return true;
  if (c.factor == nullptr) return false;
  const SingleThread single_thread;
  cholmod_factorize(&c.matrix, c.factor, &c.common);
  if (c.common.status != CHOLMOD_OK || c.factor->minor < c.factor->n) return false;
  return pivots_are_sound();
}

bool BlockCholesky::pivots_are_sound() const {
  const auto& c = *cholmod_;
  const auto* L = static_cast<const double*>(c.factor->x);
  const auto sound = [&](std::size_t column, double pivot) {
    const double diagonal = values_[c.column_start[column] + column % block_size_];
    return pivot * pivot > kSmallestPivotShare * diagonal;
  };
  if (c.factor->is_super == 0) {
    const auto* start = static_cast<const int*>(c.factor->p);
    for (std::size_t j = 0; j < c.factor->n; ++j)
      if (!sound(j, L[start[j]])) return false;
    return true;
  }
  const auto* super = static_cast<const int*>(c.factor->super);
  const auto* row_start = static_cast<const int*>(c.factor->pi);
  const auto* value_start = static_cast<const int*>(c.factor->px);
  for (std::size_t k = 0; k < c.factor->nsuper; ++k) {
    const int stride = row_start[k + 1] - row_start[k];
    for (int j = super[k]; j < super[k + 1]; ++j)
      if (!sound(j, L[value_start[k] + (j - super[k]) * (stride + 1)])) return false;
  }
  return true;
}

BlockCholesky::Columns BlockCholesky::factor() {
  Columns out{.start = {0}, .row = {}, .value = {}};
  const cholmod_factor* factor = cholmod_->factor;
  if (factor == nullptr || factor->xtype != CHOLMOD_REAL || factor->minor < factor->n) return out;
  const auto* value = static_cast<const double*>(factor->x);
  if (factor->is_super == 0) {
    const auto* start = static_cast<const int*>(factor->p);
    const auto* row = static_cast<const int*>(factor->i);
    const auto* count = static_cast<const int*>(factor->nz);
    for (std::size_t j = 0; j < factor->n; ++j) {
      out.row.insert(out.row.end(), row + start[j], row + start[j] + count[j]);
      out.value.insert(out.value.end(), value + start[j], value + start[j] + count[j]);
      out.start.push_back(static_cast<int>(out.row.size()));
    }
    return out;
  }
  // A supernode is a dense panel, its rows in order, of which the first are its own columns.
  const auto* super = static_cast<const int*>(factor->super);
  const auto* rows = static_cast<const int*>(factor->s);
  const auto* row_start = static_cast<const int*>(factor->pi);
  const auto* value_start = static_cast<const int*>(factor->px);
  const auto from_diagonal = [&](auto&& take) {
    for (std::size_t k = 0; k < factor->nsuper; ++k) {
      const int height = row_start[k + 1] - row_start[k];
      for (int c = 0; c < super[k + 1] - super[k]; ++c)
        take(rows + row_start[k] + c, value + value_start[k] + static_cast<std::ptrdiff_t>(c) * height + c, height - c);
    }
  };
  from_diagonal([&](const int*, const double*, int count) { out.start.push_back(out.start.back() + count); });
  out.row.reserve(static_cast<std::size_t>(out.start.back()));
  out.value.reserve(static_cast<std::size_t>(out.start.back()));
  from_diagonal([&](const int* row, const double* values, int count) {
    out.row.insert(out.row.end(), row, row + count);
    out.value.insert(out.value.end(), values, values + count);
  });
  return out;
}

void BlockCholesky::solve(Eigen::Ref<Eigen::MatrixXd> b) {
  auto& c = *cholmod_;
  if (structure_.variables == 0) return;
  TUTTI_CHECK(static_cast<std::size_t>(b.rows()) == c.matrix.nrow, "{} rows", b.rows());
  cholmod_dense rhs{};
  rhs.nrow = static_cast<std::size_t>(b.rows());
  rhs.ncol = static_cast<std::size_t>(b.cols());
  rhs.d = static_cast<std::size_t>(b.outerStride());
  rhs.nzmax = rhs.d * rhs.ncol;
  rhs.x = b.data();
  rhs.xtype = CHOLMOD_REAL;
  rhs.dtype = CHOLMOD_DOUBLE;
  const SingleThread single_thread;
  cholmod_solve2(CHOLMOD_A, c.factor, &rhs, nullptr, &c.solution, nullptr, &c.work_y, &c.work_e, &c.common);
  const auto* x = static_cast<const double*>(c.solution->x);
  b = Eigen::Map<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>(x, b.rows(), b.cols(),
                                                                 Eigen::OuterStride<>(c.solution->d));
}

}  // namespace tutti::estimation::internal
