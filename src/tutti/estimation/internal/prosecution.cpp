// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/prosecution.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <limits>
#include <optional>
#include <tuple>
#include <utility>

namespace tutti::estimation::internal {
namespace {

/// Where in a stretch the jump is at most this many times the least, and this many metres, odometry may have failed;
/// what cells say of a jump may differ by as much.
constexpr double kAboutLeast = 1.5;
constexpr double kAboutLeastM = 1.0;
/// Chi-square (6 dof, 0.999) from which a closure would notice a failure.
constexpr double kNoticed = 22.46;

/// On which sides of a proposed cut a closure ends. Within one piece, i < j, so that it runs over the cut if `second`.
enum Side : std::size_t { neither = 0, first = 1, second = 2, both = 3 };
constexpr std::size_t kSides = 4;

}  // namespace

/// A cell that a proposed cut would divide: one or both of its ends are on the piece to be cut.
struct Prosecution::Divided {
  const Cell* cell = nullptr;
  std::size_t from = 0;
  bool divides_i = false;
  bool divides_j = false;
  std::array<std::size_t, kSides> winner{};  ///< The clique that would be accepted on each side, by size.
  int gained = 0;                            ///< Closures that would agree.
  int lost = 0;                              ///< Closures that agree now and would no longer.

  [[nodiscard]] std::size_t side(const PlacedClosure& closure) const {
    return (divides_i && closure.i > from ? first : neither) + (divides_j && closure.j > from ? second : neither);
  }
  /// Closures of a piece that stays one must fit its odometry.
  [[nodiscard]] bool counts(const PlacedClosure& closure) const {
    return !cell->intact || closure.fits_odometry || side(closure) == second;
  }
};

std::vector<Prosecution::Divided> Prosecution::divided(std::size_t chain, const Cut& cut) const {
  const std::size_t piece = cells_.piece(chain, cut.from);
  std::vector<Divided> out;
  for (const auto& [key, cell] : cells_.cells()) {
    Divided d{.cell = &cell,
              .from = cut.from,
              .divides_i = cell.graph->first == chain && cell.piece_i == piece,
              .divides_j = cell.graph->second == chain && cell.piece_j == piece};
    if (!d.divides_i && !d.divides_j) continue;
    std::vector<std::array<int, kSides>> size(cell.cliques.size());
    for (std::size_t c = 0; c < cell.cliques.size(); ++c)
      for (const int v : cell.cliques[c])
        if (d.counts(cell.closure(v))) ++size[c][d.side(cell.closure(v))];
    for (std::size_t side = 0; side < kSides; ++side) {
      for (std::size_t c = 1; c < size.size(); ++c)
        if (size[c][side] > size[d.winner[side]][side]) d.winner[side] = c;
      if (d.winner[side] == 0) continue;
      d.gained += size[d.winner[side]][side];
      d.lost += size[0][side];
    }
    out.push_back(d);
  }
  return out;
}

std::vector<Charge> Prosecution::charges(std::size_t chain, std::size_t piece) const {
  std::vector<Charge> out;
  std::set<std::size_t> ends;
  for (const auto& [key, cell] : cells_.cells())
    for (const auto& clique : cell.cliques) {
      if (&clique != &cell.cliques.front() && static_cast<int>(clique.size()) < config_.min_closures) continue;
      for (const int v : clique) {
        if (cell.graph->first == chain && cell.piece_i == piece) ends.insert(cell.closure(v).i);
        if (cell.graph->second == chain && cell.piece_j == piece) ends.insert(cell.closure(v).j);
      }
    }
  for (auto end = ends.begin(); end != ends.end() && std::next(end) != ends.end(); ++end) {
    Charge charge{.chain = chain, .cut = {*end, *std::next(end)}};
    for (const Divided& d : divided(chain, charge.cut)) {
      charge.gained += d.gained;
      charge.lost += d.lost;
    }
    if (charge.gained >= config_.min_closures && charge.net() > 0) out.push_back(charge);
  }
  return out;
}

Evidence Prosecution::evidence(const Charge& charge) const {
  Evidence out;
  for (const Divided& d : divided(charge.chain, charge.cut))
    for (std::size_t c = 0; c < d.cell->cliques.size(); ++c)
      for (const int v : d.cell->cliques[c]) {
        const PlacedClosure& closure = d.cell->closure(v);
        const std::size_t side = d.side(closure);
        if (!d.counts(closure)) continue;
        if (c == 0 && (d.winner[side] != 0 || (d.cell->intact && side == second && would_notice(closure, charge))))
          cells_.add(*d.cell, v, out.places_for);
        if (c == 0 || d.winner[side] != c || std::ranges::count(charge.supporters, d.cell) == 0) continue;
        cells_.add(*d.cell, v, out.places_against);
        out.against.insert(closure.position);
      }
  return out;
}

bool Prosecution::would_notice(const PlacedClosure& closure, const Charge& charge) const {
  const Pose3 T_to_j = odometry(charge.chain, charge.cut.to, closure.j);
  const Vector6d missed = local({}, T_to_j.inverse() * (charge.missed * T_to_j));
  return missed.dot(closure.loop_information * missed) > kNoticed;
}

Pose3 Prosecution::odometry(std::size_t chain, std::size_t a, std::size_t b) const {
  return chains_[chain].T_odom_body[a].inverse() * chains_[chain].T_odom_body[b];
}

std::optional<Pose3> Prosecution::seen_around(const Charge& charge, const Divided& d) const {
  const auto [from, to] = charge.cut;
  std::array<std::vector<PlacedClosure>, kSides> would_agree;  // seen from the charged chain
  for (std::size_t c = 0; c < d.cell->cliques.size(); ++c)
    for (const int v : d.cell->cliques[c]) {
      PlacedClosure closure = d.cell->closure(v);
      const std::size_t side = d.side(closure);
      if (d.winner[side] != c || !d.counts(closure)) continue;
      if (!d.divides_i) closure = {closure.position, closure.j, closure.i, closure.T_i_j.inverse()};
      would_agree[side].push_back(closure);
    }
  const auto steps = [](std::size_t a, std::size_t b) { return std::max(a, b) - std::min(a, b); };
  if (d.divides_i && d.divides_j) {
    const auto a = std::ranges::min_element(would_agree[second], {},
                                            [](const PlacedClosure& closure) { return closure.j - closure.i; });
    if (d.winner[second] == 0 || a == would_agree[second].end()) return std::nullopt;
    return odometry(charge.chain, from, a->i) * a->T_i_j * odometry(charge.chain, a->j, to);
  }
  const std::size_t after = d.divides_i ? first : second;
  const std::size_t other = d.divides_i ? d.cell->graph->second : d.cell->graph->first;
  if (d.winner[neither] == d.winner[after]) return std::nullopt;
  std::size_t shortest = std::numeric_limits<std::size_t>::max();
  std::pair<const PlacedClosure*, const PlacedClosure*> best{};
  for (const PlacedClosure& a : would_agree[neither])
    for (const PlacedClosure& b : would_agree[after])
      if (steps(a.i, b.i) + steps(a.j, b.j) < shortest)
        std::tie(shortest, best) = std::tuple(steps(a.i, b.i) + steps(a.j, b.j), std::pair(&a, &b));
  if (best.first == nullptr) return std::nullopt;
  const auto& [a, b] = best;
  return odometry(charge.chain, from, a->i) * a->T_i_j * odometry(other, a->j, b->j) * b->T_i_j.inverse() *
         odometry(charge.chain, b->i, to);
}

void Prosecution::measure_jump(Charge& charge) const {
  const auto [from, to] = charge.cut;
  std::vector<std::pair<const Divided*, Pose3>> said;  // and what they say was missed, seen at `to`
  const auto cells = divided(charge.chain, charge.cut);
  for (const Divided& d : cells)
    if (const auto T_from_to = seen_around(charge, d))
      said.emplace_back(&d, odometry(charge.chain, to, from) * *T_from_to);
  if (said.empty()) return;
  charge.missed = std::ranges::max_element(said, {}, [](const auto& s) { return s.first->gained; })->second;

  const auto size_at = [&](const Pose3& missed, std::size_t k) {
    const Pose3 T_to_k = odometry(charge.chain, to, k);
    const Pose3 seen = T_to_k.inverse() * (missed * T_to_k);
    return failure_size(seen.translation.norm(), rotation_angle(seen));
  };
  std::vector<double> sizes;
  for (std::size_t k = from; k <= to; ++k) sizes.push_back(size_at(charge.missed, k));
  const auto least = std::ranges::min_element(sizes);
  charge.jump_m = *least;
  const std::size_t at = from + static_cast<std::size_t>(least - sizes.begin());
  const double about = kAboutLeast * charge.jump_m + kAboutLeastM;
  for (const auto& [d, missed] : said)
    if (size_at(charge.missed.inverse() * missed, at) <= about - charge.jump_m) charge.supporters.push_back(d->cell);
  // Far from where odometry turned wrongly, the jump would have to be larger: it failed about here.
  const auto is_larger = [&](double size) { return size > about; };
  const auto begin = std::find_if(std::make_reverse_iterator(least), sizes.rend(), is_larger).base();
  const auto end = std::find_if(least, sizes.end(), is_larger);
  charge.cut.to = std::max(from + static_cast<std::size_t>(end - sizes.begin()) - 1, from + 1);
  charge.cut.from = std::min(from + static_cast<std::size_t>(begin - sizes.begin()), charge.cut.to - 1);
  const Pose3 T_to_end = odometry(charge.chain, to, charge.cut.to);
  charge.missed = T_to_end.inverse() * (charge.missed * T_to_end);
}

}  // namespace tutti::estimation::internal
