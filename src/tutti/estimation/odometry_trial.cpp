// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/odometry_trial.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <optional>
#include <tuple>
#include <utility>

#include "tutti/estimation/internal/consistency_cells.hpp"
#include "tutti/estimation/internal/prosecution.hpp"

namespace tutti::estimation {
namespace {

using internal::Charge;
using internal::ConsistencyCells;
using internal::Cut;
using internal::Evidence;
using internal::PlacePairs;

/// Charges that explain this share of what the strongest does, less one closure, are as good.
constexpr double kSimilar = 0.9;
/// How often convicted stretches are tried again.
constexpr int kAppeals = 2;
/// A stretch is widened by this many places at most, and an accepted closure outweighs so many rejected ones.
constexpr double kMaxWidening = 2.0;
constexpr int kAcceptedWeight = 3;

}  // namespace

class OdometryTrial::Implementation {
 public:
  Implementation(std::span<const OdometryChain> chains, std::span<const LoopClosure> closures,
                 const OdometryTrialConfig& config)
      : config_(config),
        chains_(chains),
        closures_(closures.size()),
        cells_(chains, closures, config),
        prosecution_(chains, cells_, config_) {}

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
      for (const auto& [id, from, to] : failed)
        if (id == chain.id && from >= chain.first_index && from - chain.first_index < chain.T_odom_body.size())
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
        verdict.failed.push_back({chains_[c].id, chains_[c].first_index + static_cast<std::uint32_t>(cut.from),
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

  [[nodiscard]] std::optional<Charge> strongest_charge() const {
    std::vector<Charge> charges;
    for (std::size_t chain = 0; chain < chains_.size(); ++chain)
      if (cells_.cuts(chain).size() < static_cast<std::size_t>(config_.max_failures_per_chain))
        for (std::size_t p = 0; p <= cells_.cuts(chain).size(); ++p)
          std::ranges::move(prosecution_.charges(chain, p), std::back_inserter(charges));
    std::ranges::stable_sort(charges, [](const Charge& a, const Charge& b) { return a.net() > b.net(); });
    for (const Charge& strongest : charges) {
      // One accidental closure must not decide where odometry failed: the smallest jump does.
      std::vector<Charge> similar;
      for (const Charge& charge : charges)
        if (charge.chain == strongest.chain && charge.net() <= strongest.net() &&
            charge.net() >= kSimilar * strongest.net() - 1)
          similar.push_back(charge);
      for (Charge& charge : similar) prosecution_.measure_jump(charge);
      std::ranges::stable_sort(similar, {}, &Charge::jump_m);
      for (const Charge& charge : similar)
        if (is_convicted(charge, charges)) return charge;
    }
    return std::nullopt;
  }

  [[nodiscard]] bool is_convicted(const Charge& charge, const std::vector<Charge>& charges) const {
    if (charge.jump_m < config_.min_jump_m) return false;
    const Evidence found = prosecution_.evidence(charge);
    return !found.acquits(config_.max_acquittal) &&
           found.places_against.count() > config_.min_places + charge.jump_m / config_.jump_per_place_m &&
           !is_ambiguous(charge, found, charges);
  }

  /// Would another robot's failure explain most of the same closures, and too little speaks for this one alone?
  [[nodiscard]] bool is_ambiguous(const Charge& charge, const Evidence& found,
                                  const std::vector<Charge>& charges) const {
    return std::ranges::any_of(charges, [&](const Charge& other) {
      if (chains_[other.chain].id == chains_[charge.chain].id) return false;
      Charge measured = other;
      prosecution_.measure_jump(measured);
      const Evidence rival = prosecution_.evidence(measured);
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
  internal::Prosecution prosecution_;
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
