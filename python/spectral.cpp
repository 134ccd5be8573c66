// SPDX-License-Identifier: BSD-3-Clause
#include <numeric>

#include "arrays.hpp"
#include "tutti/spectral/kron.hpp"
#include "tutti/spectral/wavelet_transform.hpp"

namespace tutti::python {
namespace {

using spectral::SparseMatrix;
constexpr int kMostDense = 20'000;       // nodes: 3.2 GB
constexpr double kLeastWeight = 1e-100;  // and its inverse the largest: products stay finite

/// By its Laplacian.
struct WeightedGraph {
  SparseMatrix laplacian;
  [[nodiscard]] int nodes() const { return static_cast<int>(laplacian.rows()); }
};

int count_of(std::size_t nodes) {
  if (nodes > 10'000'000) refuse("{} nodes, expected at most 10,000,000", nodes);
  return static_cast<int>(nodes);
}

WeightedGraph proximity_graph(const ArrayLike& positions, double radius_m, double sigma_m, int most_neighbours) {
  check_range(radius_m, 1e-9, 1e9, "radius_m");
  check_range(sigma_m, 1e-9, 1e9, "sigma_m");
  check_range(most_neighbours, 0, 1e9, "most_neighbours");
  const auto places = to_vectors(positions, "positions");
  const py::gil_scoped_release release;
  return {spectral::laplacian(spectral::proximity_adjacency(places, radius_m, sigma_m, most_neighbours))};
}

WeightedGraph graph_from_edges(std::int64_t nodes, const ArrayLike& edges, const ArrayLike& weights) {
  if (nodes < 0) refuse("nodes: is {}, expected at least 0", nodes);
  const int count = count_of(static_cast<std::size_t>(nodes));
  const Integers ends = integers(edges, "edges", {-1, 2});
  const Doubles w = finite_numbers(weights, "weights", {-1});
  if (ends.shape(0) != w.size()) refuse("{} edges and {} weights, expected as many", ends.shape(0), w.size());
  std::vector<spectral::WeightedEdge> list;
  for (py::ssize_t i = 0; i < w.size(); ++i) {
    const std::int64_t a = ends.data()[2 * i], b = ends.data()[2 * i + 1];
    if (a < 0 || b < 0 || a >= count || b >= count || a == b)
      refuse("edges[{}]: is ({}, {}), expected two different ones of {} nodes", i, a, b, count);
    if (!(w.data()[i] >= kLeastWeight && w.data()[i] <= 1.0 / kLeastWeight))
      refuse("weights[{}]: is {:g}, expected {:g} to {:g}", i, w.data()[i], kLeastWeight, 1.0 / kLeastWeight);
    list.push_back({static_cast<int>(a), static_cast<int>(b), w.data()[i]});
  }
  return {spectral::laplacian(spectral::adjacency_from_edges(count, list))};
}

py::array_t<double> dense(const WeightedGraph& graph, bool adjacency) {
  if (graph.nodes() > kMostDense)
    refuse("a dense matrix of {} nodes, expected at most {}: use edges and weights", graph.nodes(), kMostDense);
  Eigen::MatrixXd out = graph.laplacian;
  if (adjacency) {
    out = -out;
    out.diagonal().setZero();
  }
  return from_matrix(out);
}

/// Every edge once, from the smaller node to the larger one.
std::pair<py::array_t<std::int64_t>, py::array_t<double>> edges_of(const WeightedGraph& graph) {
  std::vector<std::int64_t> ends;
  std::vector<double> weights;
  for (int column = 0; column < graph.nodes(); ++column)
    for (SparseMatrix::InnerIterator it(graph.laplacian, column); it; ++it)
      if (it.row() < column && it.value() != 0.0) {
        ends.push_back(it.row());
        ends.push_back(column);
        weights.push_back(-it.value());
      }
  py::array_t<std::int64_t> edges({static_cast<py::ssize_t>(weights.size()), py::ssize_t{2}});
  std::copy(ends.begin(), ends.end(), edges.mutable_data());
  return {edges, from_numbers(weights)};
}

py::array_t<double> wavelet_transform(const WeightedGraph& graph, const ArrayLike& signals, int scales,
                                      std::optional<double> lambda_max, bool exact, double tolerance) {
  check_range(scales, 1, 64, "scales");
  check_range(tolerance, 1e-12, 1e12, "tolerance");
  const py::array any = py::array::ensure(signals);
  const bool is_one = any && any.ndim() == 1;
  const Doubles all = is_one ? finite_numbers(signals, "signals", {-1}) : finite_numbers(signals, "signals", {-1, -1});
  const py::ssize_t d = is_one || all.ndim() < 2 ? 1 : all.shape(1);
  if (all.shape(0) != graph.nodes())
    refuse("signals: are of {} nodes, expected the graph's {}", all.shape(0), graph.nodes());
  if (exact && graph.nodes() > kMostDense) refuse("exact: {} nodes, expected at most {}", graph.nodes(), kMostDense);
  const Eigen::MatrixXd f = Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
      all.data(), all.shape(0), d);
  if (lambda_max) check_range(*lambda_max, 0.0, 1e300, "lambda_max");
  Eigen::MatrixXd W;
  {
    const py::gil_scoped_release release;
    const spectral::MeyerFilterBank bank(scales,
                                         lambda_max ? *lambda_max : spectral::largest_eigenvalue(graph.laplacian));
    if (exact) {
      W = spectral::exact_transform(spectral::dense_spectrum(graph.laplacian), bank, f);
    } else {
      const auto result = spectral::chebyshev_transform(graph.laplacian, bank, f, {.tolerance = tolerance});
      if (!result.converged)
        refuse("tolerance: is {:g}, and {} products with the Laplacian only reach {:g}", tolerance, result.order,
               result.error_bound);
      W = result.coefficients;
    }
  }
  std::vector<py::ssize_t> shape{W.rows(), scales};
  if (!is_one) shape.push_back(d);
  py::array_t<double> out(shape);
  Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(out.mutable_data(), W.rows(),
                                                                                     W.cols()) = W;
  return out;
}

py::array_t<double> meyer_kernels(int scales, double lambda_max, const ArrayLike& lambdas) {
  check_range(scales, 1, 64, "scales");
  check_range(lambda_max, 0.0, 1e300, "lambda_max");
  const Doubles at = finite_numbers(lambdas, "lambdas", {-1});
  const spectral::MeyerFilterBank bank(scales, lambda_max);
  py::array_t<double> out({py::ssize_t{scales}, at.size()});
  for (int s = 0; s < scales; ++s)
    for (py::ssize_t i = 0; i < at.size(); ++i) out.mutable_data()[s * at.size() + i] = bank.kernel(s, at.data()[i]);
  return out;
}

py::array_t<std::int64_t> from_nodes(const std::vector<int>& nodes) {
  return from_values(std::vector<std::int64_t>(nodes.begin(), nodes.end()));
}

std::pair<WeightedGraph, py::array_t<std::int64_t>> kron_reduce(const WeightedGraph& graph, const ArrayLike& keep) {
  const auto nodes = to_nodes(keep, "keep", graph.nodes());
  spectral::KronReduction reduced = without_interpreter([&] { return spectral::kron_reduce(graph.laplacian, nodes); });
  return {WeightedGraph{std::move(reduced.laplacian)}, from_nodes(reduced.kept)};
}

void bind_weighted_graph(py::module_& m) {
  py::class_<WeightedGraph>(m, "WeightedGraph", R"(A weighted undirected graph, sparse inside; never changes.

Made by proximity_graph(), graph_from_edges(), kron_reduce() and sparsify(). For scipy:
scipy.sparse.coo_matrix((graph.weights, graph.edges.T), shape=(len(graph),) * 2).)")
      .def_property_readonly(
          "edges", [](const WeightedGraph& g) { return edges_of(g).first; },
          "(m, 2) int64: the two nodes of every edge, the smaller one first.")
      .def_property_readonly(
          "weights", [](const WeightedGraph& g) { return edges_of(g).second; }, "(m,) in the order of edges.")
      .def(
          "adjacency", [](const WeightedGraph& g) { return dense(g, true); },
          "(n, n), dense. ValueError: more than 20,000 nodes.")
      .def(
          "laplacian", [](const WeightedGraph& g) { return dense(g, false); },
          "(n, n), dense: D - A, eq. (2) of the paper. ValueError: more than 20,000 nodes.")
      .def(
          "components",
          [](const WeightedGraph& g) { return from_nodes(spectral::connected_components(g.laplacian).label); },
          "(n,) int64: which connected component each node is of, numbered in order of their first nodes.")
      .def(
          "largest_eigenvalue", [](const WeightedGraph& g) { return spectral::largest_eigenvalue(g.laplacian); },
          py::call_guard<py::gil_scoped_release>(),
          "Of the Laplacian, relative error at most 1e-10: the lambda_max of wavelets. To compare two graphs, take the "
          "larger.")
      .def("__len__", &WeightedGraph::nodes)
      .def("__repr__", [](const WeightedGraph& g) {
        return fmt::format("<tutti.WeightedGraph of {} nodes and {} edges>", g.nodes(), edges_of(g).second.size());
      });
}

void bind_selection(py::module_& m) {
  m.def(
      "sparsify",
      [](const WeightedGraph& graph, double relative_threshold) {
        check_range(relative_threshold, 0.0, 1.0, "relative_threshold");
        const py::gil_scoped_release release;
        return WeightedGraph{spectral::sparsify(graph.laplacian, relative_threshold)};
      },
      "graph"_a, "relative_threshold"_a,
      "Without edges whose weight is below relative_threshold times the smaller degree of their ends, but for a "
      "spanning forest: what was connected stays so.");
  m.def(
      "select_largest_eigenvector",
      [](const WeightedGraph& graph, const ArrayLike& must_keep) {
        const auto kept = to_nodes(must_keep, "must_keep", graph.nodes());
        return from_nodes(
            without_interpreter([&] { return spectral::select_largest_eigenvector(graph.laplacian, kept); }));
      },
      "graph"_a, "must_keep"_a = py::list(),
      "(k,) int64, ascending: the paper's choice of nodes to keep, eq. (3), and must_keep.");
  m.def(
      "select_budget",
      [](const WeightedGraph& graph, const ArrayLike& positions, int budget, const ArrayLike& must_keep) {
        const auto places = to_vectors(positions, "positions");
        if (places.size() != static_cast<std::size_t>(graph.nodes()))
          refuse("positions: are {}, expected the graph's {}", places.size(), graph.nodes());
        check_range(budget, 0, 1e9, "budget");
        const auto kept = to_nodes(must_keep, "must_keep", graph.nodes());
        return from_nodes(
            without_interpreter([&] { return spectral::select_budget(graph.laplacian, places, budget, kept); }));
      },
      "graph"_a, "positions"_a, "budget"_a, "must_keep"_a = py::list(),
      "(k,) int64, ascending: so many nodes, must_keep among them, spread in proportion to how dense the graph is. "
      "positions: (n, 3) metres, those that it was built from.");
}

}  // namespace

void bind_spectral(py::module_& m) {
  bind_weighted_graph(m);
  m.def(
      "proximity_graph", &proximity_graph, "positions"_a, "radius_m"_a = 7.0, "sigma_m"_a = 1.0,
      "most_neighbours"_a = 0,
      R"(The paper's graph, eq. (1): nodes at most radius_m apart are joined with weight exp(-distance / (2 sigma_m^2)).

positions: (n, 3) metres, any frame. most_neighbours > 0: only if either is among the other's so many nearest.)");
  m.def("graph_from_edges", &graph_from_edges, "nodes"_a, "edges"_a, "weights"_a,
        "A graph of so many nodes from edges (m, 2), integers, and positive weights (m,); several between two nodes "
        "add up. "
        "ValueError: a node that is not there, an edge to itself, a weight that is not within 1e-100 to 1e100.");
  m.def(
      "spectrum",
      [](const WeightedGraph& graph) {
        if (graph.nodes() > kMostDense) refuse("{} nodes, expected at most {}", graph.nodes(), kMostDense);
        const spectral::Spectrum out = without_interpreter([&] { return spectral::dense_spectrum(graph.laplacian); });
        return std::pair(from_numbers({out.eigenvalues.data(), static_cast<std::size_t>(out.eigenvalues.size())}),
                         from_matrix(out.eigenvectors));
      },
      "graph"_a,
      R"(All eigenvalues (n,), ascending, and eigenvectors (n, n), as columns, of the Laplacian: L = U diag(lambda) U^T.

The entry of largest magnitude of each vector is positive. Cubic in the nodes. ValueError: more than 20,000 nodes.)");
  m.def("wavelet_transform", &wavelet_transform, "graph"_a, "signals"_a, "scales"_a = 7, "lambda_max"_a = py::none(),
        "exact"_a = false, "tolerance"_a = 1e-3,
        R"(Meyer wavelet coefficients of signals on the nodes: rows of g_s(L) f, scale 0 the largest.

signals: (n,) or (n, d), finite; returned: (n, scales) or (n, scales, d), in the signals' unit. lambda_max: the
graph's largest eigenvalue, or of two graphs that are to be compared the larger one's. By polynomials of the Laplacian,
no coefficient off by more than tolerance; exact: by the full spectrum. The squares sum up to the signal's.
ValueError: signals of another number of nodes, or a tolerance that 4000 products do not reach.)");
  m.def("meyer_kernels", &meyer_kernels, "scales"_a, "lambda_max"_a, "lambdas"_a,
        "(scales, k): the filters g_s at graph frequencies lambdas (k,).");
  m.def("kron_reduce", &kron_reduce, "graph"_a, "keep"_a,
        R"(The Kron reduction to the nodes keep, (k,) integers: L_aa - L_ab L_bb^-1 L_ba; eq. (3) of the paper.

Returns the smaller graph and which node of the larger one each of its nodes is, (k,) int64, ascending.)");
  bind_selection(m);
}

}  // namespace tutti::python
