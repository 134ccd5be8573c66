// SPDX-License-Identifier: BSD-3-Clause
// Against stored values: PyGSP's (../shared/golden, when it is there) and our own from 40-digit arithmetic.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "support/shared_data.hpp"
#include "tutti/spectral/kron.hpp"
#include "tutti/spectral/wavelet_transform.hpp"

namespace tutti::spectral {
namespace golden_test {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using nlohmann::json;

constexpr double kExact = 1e-9;

json load(const std::filesystem::path& path) {
  std::ifstream file(path);
  EXPECT_TRUE(file) << path;
  return json::parse(file);
}

VectorXd vector_of(const json& values) {
  const auto flat = values.get<std::vector<double>>();
  return VectorXd::Map(flat.data(), static_cast<Eigen::Index>(flat.size()));
}

MatrixXd matrix_of(const json& rows) {
  MatrixXd out(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(rows.at(0).size()));
  for (std::size_t r = 0; r < rows.size(); ++r) out.row(static_cast<Eigen::Index>(r)) = vector_of(rows[r]).transpose();
  return out;
}

std::vector<Eigen::Vector3d> positions_of(const json& rows) {
  std::vector<Eigen::Vector3d> out;
  for (const auto& row : rows) out.emplace_back(row[0], row[1], row[2]);
  return out;
}

double difference(const MatrixXd& a, const MatrixXd& b) {
  EXPECT_EQ(a.rows(), b.rows());
  EXPECT_EQ(a.cols(), b.cols());
  return (a - b).cwiseAbs().maxCoeff();
}

void expect_chebyshev(const SparseMatrix& L, const MeyerFilterBank& bank, const VectorXd& signal,
                      const MatrixXd& expected) {
  for (const double tolerance : {1e-2, 1e-4, 1e-6}) {
    SCOPED_TRACE(tolerance);
    const auto result = chebyshev_transform(L, bank, signal, {.tolerance = tolerance, .max_order = 20000});
    EXPECT_TRUE(result.converged);
    EXPECT_LE(difference(result.coefficients, expected), tolerance);
  }
}

class PyGsp : public ::testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    const std::string file = std::string("golden/") + GetParam() + ".json";
    TUTTI_REQUIRE_SHARED(file);
    golden_ = load(test::shared_path(file));
    const MatrixXd weights = matrix_of(golden_["W"]);
    std::vector<WeightedEdge> edges;
    for (int b = 0; b < static_cast<int>(weights.cols()); ++b)
      for (int a = 0; a < b; ++a)
        if (weights(a, b) > 0.0) edges.push_back({a, b, weights(a, b)});
    adjacency_ = adjacency_from_edges(static_cast<int>(weights.rows()), edges);
    L_ = laplacian(adjacency_);
  }
  json golden_;
  SparseMatrix adjacency_, L_;
};

TEST_P(PyGsp, AdjacencyAndLaplacian) {
  EXPECT_LE(difference(adjacency_, matrix_of(golden_["W"])), 0.0);
  EXPECT_LE(difference(L_, matrix_of(golden_["L"])), 1e-13);
  if (std::string(GetParam()) == "a_path12") return;  // weights not from positions
  const auto adjacency = proximity_adjacency(positions_of(golden_["coords"]), 7.0, 1.0);
  EXPECT_EQ(adjacency.nonZeros(), 2 * golden_["n_edges"].get<int>());
  EXPECT_LE(difference(adjacency, matrix_of(golden_["W"])), 1e-14);
}

TEST_P(PyGsp, Eigenvalues) {
  const double lambda_max = golden_["lmax"];
  EXPECT_LE(difference(dense_spectrum(L_).eigenvalues, vector_of(golden_["eigenvalues"])), 1e-12);
  EXPECT_NEAR(largest_eigenpair(L_).value, lambda_max, 1e-12);
  EXPECT_NEAR(largest_eigenvalue(L_), lambda_max, kExact);
}

TEST_P(PyGsp, Eigenspaces) {
  const Spectrum spectrum = dense_spectrum(L_);
  const MatrixXd expected = matrix_of(golden_["U_columns_sign_fixed"]);
  const double gap = golden_["min_eigen_gap"];
  for (Eigen::Index k = 0; k < expected.cols(); ++k) {  // projectors; all eigenvalues are simple here
    const MatrixXd ours = spectrum.eigenvectors.col(k) * spectrum.eigenvectors.col(k).transpose();
    EXPECT_LE(difference(ours, expected.col(k) * expected.col(k).transpose()), 1e-13 / gap) << "k = " << k;
  }
}

TEST_P(PyGsp, KernelsAndCoefficients) {
  const Spectrum spectrum = dense_spectrum(L_);
  const double lambda_max = golden_["lmax"];
  for (const int scales : {6, 7}) {
    SCOPED_TRACE(scales);
    const json& meyer = golden_["meyer"][std::to_string(scales)];
    const MeyerFilterBank bank(scales, lambda_max);
    const MatrixXd kernels = matrix_of(meyer["kernels_at_eigenvalues"]);
    const VectorXd eigenvalues = vector_of(golden_["eigenvalues"]);
    for (int s = 0; s < scales; ++s)
      for (Eigen::Index k = 0; k < eigenvalues.size(); ++k)
        EXPECT_NEAR(bank.kernel(s, eigenvalues[k]), kernels(s, k), 1e-12);

    const VectorXd signal = vector_of(golden_["signal_f"]);
    const VectorXd perturbed = vector_of(golden_["signal_f_perturbed"]);
    MatrixXd both(signal.size(), 2);
    both << signal, perturbed;
    const MatrixXd coefficients = exact_transform(spectrum, bank, both);
    const MatrixXd expected = matrix_of(meyer["coeffs_f"]);
    const MatrixXd expected_perturbed = matrix_of(meyer["coeffs_f_perturbed"]);
    for (int s = 0; s < scales; ++s) {
      EXPECT_LE(difference(coefficients.col(2 * s), expected.col(s)), kExact);
      EXPECT_LE(difference(coefficients.col(2 * s + 1), expected_perturbed.col(s)), kExact);
    }
    expect_chebyshev(L_, bank, signal, expected);
    expect_chebyshev(L_, bank, perturbed, expected_perturbed);
  }
}

TEST_P(PyGsp, KronReductionAndSelection) {
  EXPECT_EQ(select_largest_eigenvector(L_, {}, 0.0),
            golden_["kron"]["u_max_nonneg"]["indices"].get<std::vector<int>>());
  for (const auto& [name, kron] : golden_["kron"].items()) {
    SCOPED_TRACE(name);
    const auto reduction = kron_reduce(L_, kron["indices"].get<std::vector<int>>());
    EXPECT_LE(difference(reduction.laplacian, matrix_of(kron["L_reduced"])), kExact);
    EXPECT_LE(difference(dense_spectrum(reduction.laplacian).eigenvalues, vector_of(kron["eigenvalues"])), kExact);
  }
}

INSTANTIATE_TEST_SUITE_P(Golden, PyGsp, ::testing::Values("a_path12", "b_geo40", "c7_two_loop120_r7"),
                         [](const auto& parameter) { return std::string(parameter.param); });

TEST(OwnGolden, TwoComponentsAndAnIsolatedNode) {
  const json golden = load(test::source_path("src/tutti/spectral/testdata/two_components.json"));
  std::vector<WeightedEdge> edges;
  for (const auto& edge : golden["edges"]) edges.push_back({edge[0], edge[1], edge[2]});
  const SparseMatrix L = laplacian(adjacency_from_edges(golden["nodes"], edges));
  const Spectrum spectrum = dense_spectrum(L);
  const VectorXd eigenvalues = vector_of(golden["eigenvalues"]);
  EXPECT_LE(difference(spectrum.eigenvalues, eigenvalues), 1e-13);

  const MeyerFilterBank bank(golden["scales"], eigenvalues[eigenvalues.size() - 1]);
  const VectorXd signal = vector_of(golden["signal"]);
  const MatrixXd expected = matrix_of(golden["coefficients"]);
  EXPECT_LE(difference(exact_transform(spectrum, bank, signal), expected), 1e-12);
  expect_chebyshev(L, bank, signal, expected);

  const auto reduction = kron_reduce(L, golden["keep"].get<std::vector<int>>());
  EXPECT_LE(difference(reduction.laplacian, matrix_of(golden["reduced"])), 1e-15);
}

}  // namespace golden_test
}  // namespace tutti::spectral
