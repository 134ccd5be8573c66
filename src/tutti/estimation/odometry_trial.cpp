// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/odometry_trial.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include "tutti/estimation/internal/consistency_cells.hpp"

namespace tutti::estimation {
namespace {

using internal::Cell;
using internal::ConsistencyCells;
using internal::Cut;
using internal::PlacedClosure;
using internal::PlacePairs;

/// Charges that explain this share of what the strongest does, less one closure, are as good.
constexpr double kSimilar = 0.9;
/// Where in a stretch the jump is at most this many times the least, and this many metres, odometry may have failed;
/// what cells say of a jump may differ by as much.
constexpr double kAboutLeast = 1.5;
constexpr double kAboutLeastM = 1.0;
/// Chi-square (6 dof, 0.999) from which a closure would notice a failure.
constexpr double kNoticed = 22.46;
/// How often convicted stretches are tried again.
constexpr int kAppeals = 2;
/// A stretch is widened by this many places at most, and an accepted closure outweighs so many rejected ones.
constexpr double kMaxWidening = 2.0;
constexpr int kAcceptedWeight = 3;

/// On which sides of a proposed cut a closure ends. Within one piece, i < j, so that it runs over the cut if `second`.
enum Side : std::size_t { neither = 0, first = 1, second = 2, both = 3 };
constexpr std::size_t kSides = 4;

/// A cell that a proposed cut would divide: one or both of its ends are on the piece to be cut.
struct Divided {
  const Cell* cell = nullptr;
  std::size_t from = 0;
  bool divides_i = false;
  bool divides_j = false;
  std::array<std::size_t, kSides> winner{};  ///< The clique that would be accepted on each side, by size.
  int gained = 0;

  [[nodiscard]] std::size_t side(const PlacedClosure& closure) const {
    return (divides_i && closure.i > from ? first : neither) + (divides_j && closure.j > from ? second : neither);
  }
  /// Closures of a piece that stays one must fit its odometry.
  [[nodiscard]] bool counts(const PlacedClosure& closure) const {
    return !cell->intact || closure.fits_odometry || side(closure) == second;
  }
};

/// What letting a stretch go would change.
struct Charge {
  std::size_t chain = 0;
  Cut cut;
  int gained = 0;  ///< Closures that would agree.
  int lost = 0;    ///< Closures that agree now and would no longer.
  Pose3 missed;    ///< What the odometry would have missed, seen at cut.to.
  double jump_m = 0.0;
  std::vector<const Cell*> supporters;  ///< Cells whose closures say so.
  [[nodiscard]] int net() const { return gained - lost; }
};

}  // namespace

class OdometryTrial::Implementation {
 public:
  Implementation(std::span<const OdometryChain> chains, std::span<const LoopClosure> closures,
                 const OdometryTrialConfig& config)
      : config_(config), chains_(chains), closures_(closures.size()), cells_(chains, closures, config) {}

  void run() {
    convict_all();
    for (int appeal = 0; appeal < kAppeals && revise(); ++appeal) convict_all();
    for (std::size_t chain = 0; chain < chains_.size(); ++chain)
      if (!cells_.cuts(chain).empty()) cells_.set_cuts(chain, widened(chain));
  }

  void assume(std::span<const OdometryStretch> failed) {
    for (std::size_t c = 0; c < chains_.size(); ++c) {
      const OdometryChain& chain = chains_[c];
      std::vector<Cut> cuts;
      for (const auto& [robot, from, to] : failed)
        if (robot == chain.robot && from >= chain.first_index && from - chain.first_index < chain.T_odom_body.size())
          cuts.push_back({from - chain.first_index, to - chain.first_index});
      std::ranges::sort(cuts);
      if (cuts != cells_.cuts(c)) cells_.set_cuts(c, std::move(cuts));
    }
  }
  [[nodiscard]] OdometryVerdict verdict() const {
    OdometryVerdict verdict{.accepted = std::vector<bool>(closures_, false), .failed = {}};
    for (const std::size_t position : accepted()) verdict.accepted[position] = true;
    for (std::size_t c = 0; c < chains_.size(); ++c)
      for (const Cut& cut : cells_.cuts(c))
        verdict.failed.push_back({chains_[c].robot, chains_[c].first_index + static_cast<std::uint32_t>(cut.from),
                                  chains_[c].first_index + static_cast<std::uint32_t>(cut.to)});
    std::ranges::sort(verdict.failed);
    return verdict;
  }

 private:
  /// Positions of the accepted closures.
  [[nodiscard]] std::vector<std::size_t> accepted() const {
    std::vector<std::size_t> out;
    for (const auto& [key, cell] : cells_.cells()) {
      const auto least = static_cast<std::size_t>(cell.intact ? 1 : config_.min_joining_closures);
      if (cell.cliques.empty() || cell.cliques.front().size() < least) continue;
      for (const int v : cell.cliques.front()) out.push_back(cell.closure(v).position);
    }
    return out;
  }
  void convict_all() {
    while (const auto charge = strongest_charge()) convict(*charge);
  }
  void convict(const Charge& charge) {
    auto cuts = cells_.cuts(charge.chain);
    cuts.insert(std::ranges::upper_bound(cuts, charge.cut), charge.cut);
    cells_.set_cuts(charge.chain, std::move(cuts));
  }
  /// Tries every convicted stretch again, knowing the others: while two failures were open, both looked like one
  /// somewhere else. True when something changed.
  bool revise() {
    bool changed = false;
    for (std::size_t chain = 0; chain < chains_.size(); ++chain) {
      const std::vector<Cut> convicted = cells_.cuts(chain);
      for (const Cut& cut : convicted) {
        auto others = cells_.cuts(chain);
        std::erase(others, cut);
        cells_.set_cuts(chain, std::move(others));
        const auto charge = strongest_charge();
        if (charge) convict(*charge);
        changed = changed || !charge || charge->chain != chain || charge->cut != cut;
      }
    }
    return changed;
  }

  /// The cells that the cut would divide.
  [[nodiscard]] std::vector<Divided> divided(const Charge& charge) const {
    Charge counted = charge;
    return divide(counted);
  }
  /// Also counts what would change.
  std::vector<Divided> divide(Charge& charge) const {
    charge.gained = charge.lost = 0;
    const std::size_t piece = cells_.piece(charge.chain, charge.cut.from);
    std::vector<Divided> out;
    for (const auto& [key, cell] : cells_.cells()) {
      Divided d{&cell, charge.cut.from, cell.graph->first == charge.chain && cell.piece_i == piece,
                cell.graph->second == charge.chain && cell.piece_j == piece};
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
        charge.lost += size[0][side];
      }
      charge.gained += d.gained;
      out.push_back(d);
    }
    return out;
  }

  /// Every stretch between neighbouring ends of closures on a piece that would make enough more of them agree. Rival
  /// cliques too small to convict do not count as ends.
  void charge_piece(std::size_t chain, std::size_t piece, std::vector<Charge>& charges) const {
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
      Charge charge{chain, {*end, *std::next(end)}};
      divide(charge);
      if (charge.gained >= config_.min_closures && charge.net() > 0) charges.push_back(charge);
    }
  }

  struct Evidence {
    std::set<std::size_t> against;  ///< Positions of the closures that would be gained.
    PlacePairs places_against;
    PlacePairs places_for;
    [[nodiscard]] bool acquits(double max_share) const {
      return places_for.count() > max_share * places_against.count();
    }
  };
  /// For a stretch speak the closures that would be lost, and those over it that fit its odometry but would not, had it
  /// failed as charged.
  [[nodiscard]] Evidence evidence(const Charge& charge) const {
    Evidence out;
    for (const Divided& d : divided(charge))
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
  [[nodiscard]] bool would_notice(const PlacedClosure& closure, const Charge& charge) const {
    const Pose3 T_to_j = odometry(charge.chain, charge.cut.to, closure.j);
    const Vector6d missed = local({}, T_to_j.inverse() * (charge.missed * T_to_j));
    return missed.dot(closure.loop_information * missed) > kNoticed;
  }

  [[nodiscard]] std::optional<Charge> strongest_charge() const {
    std::vector<Charge> charges;
    for (std::size_t chain = 0; chain < chains_.size(); ++chain)
      if (cells_.cuts(chain).size() < static_cast<std::size_t>(config_.max_failures_per_chain))
        for (std::size_t p = 0; p <= cells_.cuts(chain).size(); ++p) charge_piece(chain, p, charges);
    std::ranges::stable_sort(charges, [](const Charge& a, const Charge& b) { return a.net() > b.net(); });
    for (const Charge& strongest : charges) {
      // One accidental closure must not decide where odometry failed: the smallest jump does.
      std::vector<Charge> similar;
      for (const Charge& charge : charges)
        if (charge.chain == strongest.chain && charge.net() <= strongest.net() &&
            charge.net() >= kSimilar * strongest.net() - 1)
          similar.push_back(charge);
      for (Charge& charge : similar) measure_jump(charge);
      std::ranges::stable_sort(similar, {}, &Charge::jump_m);
      for (const Charge& charge : similar)
        if (is_convicted(charge, charges)) return charge;
    }
    return std::nullopt;
  }

  [[nodiscard]] bool is_convicted(const Charge& charge, const std::vector<Charge>& charges) const {
    if (charge.jump_m < config_.min_jump_m) return false;
    const Evidence found = evidence(charge);
    return !found.acquits(config_.max_acquittal) &&
           found.places_against.count() > config_.min_places + charge.jump_m / config_.jump_per_place_m &&
           !is_ambiguous(charge, found, charges);
  }

  /// Would another robot's failure explain most of the same closures, and too little speaks for this one alone?
  [[nodiscard]] bool is_ambiguous(const Charge& charge, const Evidence& found,
                                  const std::vector<Charge>& charges) const {
    return std::ranges::any_of(charges, [&](const Charge& other) {
      if (chains_[other.chain].robot == chains_[charge.chain].robot) return false;
      Charge measured = other;
      measure_jump(measured);
      const Evidence rival = evidence(measured);
      PlacePairs alone;
      std::size_t shared = 0;
      for (const auto& [key, cell] : cells_.cells())
        for (const auto& clique : cell.cliques)
          for (const int v : clique) {
            const std::size_t position = cell.closure(v).position;
            if (!found.against.contains(position)) continue;
            if (rival.against.contains(position))
              ++shared;
            else
              cells_.add(cell, v, alone);
          }
      return 2 * shared > found.against.size() && alone.count() <= config_.min_places &&
             !rival.acquits(config_.max_acquittal);
    });
  }

  /// T_a_b by odometry.
  [[nodiscard]] Pose3 odometry(std::size_t chain, std::size_t a, std::size_t b) const {
    return chains_[chain].T_odom_body[a].inverse() * chains_[chain].T_odom_body[b];
  }

  /// T_from_to over a stretch as the closures of one cell see it, by those with the shortest odometry between them;
  /// nothing when the cell gains nothing by cutting it.
  [[nodiscard]] std::optional<Pose3> seen_around(const Charge& charge, const Divided& d) const {
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

  /// What the odometry would have missed, as the cell says that gains most; the cells that say the same are its
  /// supporters. Its size is the least over where in the stretch it happened, and the stretch is narrowed to there.
  void measure_jump(Charge& charge) const {
    const auto [from, to] = charge.cut;
    std::vector<std::pair<const Divided*, Pose3>> said;  // and what they say was missed, seen at `to`
    const auto cells = divided(charge);
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

  /// Odometry may fail little by little: closures in the middle of it agree with neither side. The cuts of a chain,
  /// widened over the ends of closures next to them as far as rejected ones prevail.
  [[nodiscard]] std::vector<Cut> widened(std::size_t chain) const {
    std::map<std::size_t, int> rejected;  // per pose, less the accepted ones
    for (const auto& [key, cell] : cells_.cells())
      for (const int v : cell.vertices) {
        const int value = std::ranges::binary_search(cell.cliques.front(), v) ? -kAcceptedWeight : 1;
        if (cell.graph->first == chain) rejected[cell.closure(v).i] += value;
        if (cell.graph->second == chain) rejected[cell.closure(v).j] += value;
      }
    std::vector<Cut> cuts = cells_.cuts(chain);
    for (std::size_t c = 0; c < cuts.size(); ++c) {
      const Cut cut = cuts[c];
      const auto widen = [&](std::size_t& end, auto pose, auto stop, auto is_beyond) {
        int sum = 0;
        int best = 0;
        for (; pose != stop && !is_beyond(pose->first); sum += pose->second, ++pose)
          if (sum > best) std::tie(best, end) = std::pair(sum, pose->first);
      };
      const auto way_to = [&](std::size_t pose) { return cells_.way(chain, pose); };
      widen(cuts[c].from, std::make_reverse_iterator(rejected.upper_bound(cut.from)), rejected.rend(),
            [&](std::size_t pose) {
              return (c > 0 && pose < cuts[c - 1].to) || way_to(cut.from) - way_to(pose) > kMaxWidening;
            });
      widen(cuts[c].to, rejected.lower_bound(cut.to), rejected.end(), [&](std::size_t pose) {
        return (c + 1 < cuts.size() && pose > cuts[c + 1].from) || way_to(pose) - way_to(cut.to) > kMaxWidening;
      });
    }
    return cuts;
  }

  OdometryTrialConfig config_;
  std::span<const OdometryChain> chains_;
  std::size_t closures_;
  ConsistencyCells cells_;
};

OdometryTrial::OdometryTrial(std::span<const OdometryChain> chains, std::span<const LoopClosure> closures,
                             const OdometryTrialConfig& config)
    : implementation_(std::make_unique<Implementation>(chains, closures, config)) {}

OdometryTrial::~OdometryTrial() = default;

OdometryVerdict OdometryTrial::decide() {
  implementation_->assume({});
  implementation_->run();
  return implementation_->verdict();
}

OdometryVerdict OdometryTrial::assume(std::span<const OdometryStretch> failed) {
  implementation_->assume(failed);
  return implementation_->verdict();
}

OdometryVerdict try_odometry(std::span<const OdometryChain> chains, std::span<const LoopClosure> closures,
                             const OdometryTrialConfig& config) {
  return OdometryTrial(chains, closures, config).decide();
}

}  // namespace tutti::estimation
