// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/fit/odometry_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>

#include "tutti/geometry/so3.hpp"
#include "tutti/perception/fit/internal/motion_model.hpp"
#include "tutti/perception/fit/internal/readings.hpp"
#include "tutti/perception/fit/standstill.hpp"

namespace tutti::fit {
namespace {

constexpr double kGross = 10.0;      // Cost from which odometry is read in other ways.
constexpr double kGood = 8.0;        // Cost below which nothing is left to explain.
constexpr double kMostLeft = 0.4;    // Share of the cost that may be left when another reading explains it.
constexpr double kRivalRatio = 1.3;  // between two costs that are as good as each other
constexpr double kLeastShare = 0.1;  // of the contradiction, that a reported number explains
constexpr double kLeastFurtherShare =
    0.25;  // the same of a second number: scans are deskewed by the odometry that is wrong
constexpr double kSigmas = 5.0, kHalfSigmas = 2.0, kUsedSigmas = 3.0;
constexpr double kUpsideDown_deg = 135.0;  // A rotation above this, about a horizontal axis.
constexpr std::size_t kFewestStill = 12;   // Steps of scans that stand still.
constexpr double kLeastOdometry_m = 3.0;   // that odometry moves while scans stand still

/// A part of the solution that is reported as one number.
struct Block {
  MisfitKind kind;
  int first, size;  // of the parameters
  double least;     // of the norm, in the parameters' unit
};
constexpr double kLeastTurn = 1.0 * kRadPerDeg;  // the rings of a sparse LiDAR pitch by half of it
constexpr double kLeastOffset_s = 0.05;          // cameras that fly with honest odometry come to 0.034
constexpr std::array<Block, 4> kBlocks{{
    {MisfitKind::clock, 6, 1, kLeastOffset_s},
    {MisfitKind::turned, 3, 3, kLeastTurn},
    {MisfitKind::displaced, 0, 3, 0.1},
    {MisfitKind::scale, 7, 1, 0.03},
}};

Parameters as_parameters(const MotionModel& model) {
  Parameters out;
  out << model.E.translation, so3_log(model.E.rotation), model.offset_s, model.log_scale, model.turn_per_m;
  return out;
}

MotionModel as_model(const Parameters& p) {
  return {.E = {so3_exp(p.segment<3>(3)), p.head<3>()}, .offset_s = p[6], .log_scale = p[7], .turn_per_m = p.tail<3>()};
}

struct Solved {
  std::optional<MisfitKind> reading;
  Trajectory odometry;  ///< As read.
  Solution solution;
};

/// Whether a robot can be off by so much from where the solution began; else it went astray where nothing fits.
bool is_plausible(const Solution& solution, const MotionModel& begin, std::size_t known) {
  constexpr double kMostDisplaced_m = 20.0, kMostScale = 0.4, kMostTurn_deg_per_m = 3.0;
  const MotionModel& model = solution.model;
  return std::abs(model.offset_s) <= kMostOffset_s + 0.5 && model.E.translation.norm() <= kMostDisplaced_m &&
         std::abs(model.log_scale - begin.log_scale) <= kMostScale &&
         model.turn_per_m.norm() <= kMostTurn_deg_per_m * kRadPerDeg && 10 * solution.cost.known >= 8 * known;
}

Solution plausible_solution(const WeighedSteps& weighed, const Trajectory& odometry, const MotionModel& begin,
                            std::size_t known) {
  Solution out = solve(weighed, odometry, begin);
  if (!is_plausible(out, begin, known)) out.cost.mean = kMostDistance2;
  return out;
}

/// The same, begun also at neighbouring offsets of the clock: a gait that sways looks alike a period later.
Solution best_offset(const WeighedSteps& weighed, const Trajectory& odometry, Solution found, std::size_t known) {
  constexpr double kStep_s = 0.05;
  constexpr int kSteps = 10;
  if (std::abs(found.model.offset_s) < kStep_s / 2.0) return found;
  std::optional<std::pair<double, double>> best;  // cost, offset
  for (int k = -kSteps; k <= kSteps; ++k) {
    MotionModel model = found.model;
    model.offset_s += k * kStep_s;
    const Cost cost = cost_of(weighed, motions(weighed, odometry, model.offset_s), model);
    if (10 * cost.known >= 9 * known && (!best || cost.mean < best->first)) best = {cost.mean, model.offset_s};
  }
  if (!best) return found;
  MotionModel begin = found.model;
  begin.offset_s = best->second;
  const Solution other = plausible_solution(weighed, odometry, begin, known);
  return other.cost.mean < found.cost.mean ? other : found;
}

/// The solution as odometry is, unless it leaves most of a large contradiction and another way to begin does not.
Solved best_solution(const WeighedSteps& weighed, const Trajectory& odometry, const Cost& before) {
  Solved best{std::nullopt, odometry, plausible_solution(weighed, odometry, {}, before.known)};
  best.solution = best_offset(weighed, odometry, best.solution, before.known);
  if (before.mean < kGross || best.solution.cost.mean < kGood) return best;
  for (const Reading& reading : readings()) {
    Trajectory read = read_as(reading, odometry);
    const Beginning begin = best_beginning(weighed, read);
    if (begin.cost.known < kFewestSteps) continue;
    Solved other{reading.kind, std::move(read), {}};
    other.solution = plausible_solution(weighed, other.odometry, begin.model, before.known);
    const double ratio = best.solution.cost.mean / std::max(other.solution.cost.mean, 0.01);
    const bool turns_less = rotation_angle(other.solution.model.E) < rotation_angle(best.solution.model.E);
    if (ratio > kRivalRatio || (ratio > 1.0 / kRivalRatio && turns_less)) best = std::move(other);
  }
  return best;
}

/// By how many standard deviations a parameter is not as stated.
double sigmas_of(int parameter, const Solution& solution) {
  return std::abs(as_parameters(solution.model)[parameter]) / solution.sigma[parameter];
}

/// The same of the block's surest parameter.
double sigmas_of(const Block& block, const Solution& solution) {
  double out = 0.0;
  for (int p = block.first; p < block.first + block.size; ++p) out = std::max(out, sigmas_of(p, solution));
  return out;
}

/// The parameters of a block that are known; the others are zero.
Eigen::Vector3d known_part(const Block& block, const Solution& solution) {
  const Parameters value = as_parameters(solution.model);
  Eigen::Vector3d out = Eigen::Vector3d::Zero();
  for (int k = 0; k < block.size; ++k)
    if (sigmas_of(block.first + k, solution) >= kUsedSigmas) out[k] = value[block.first + k];
  return out;
}

/// A LiDAR sits at most this far from the body's origin: so far E is displaced where only the rotation is wrong.
constexpr double kLargestLever_m = 1.0;

Misfit misfit_of(const Block& block, const Eigen::Vector3d& part, const Solution& solution) {
  Misfit out{
      .kind = block.kind, .value = part.norm(), .sigma = solution.sigma.segment(block.first, block.size).minCoeff()};
  if (block.size == 1) out.value = part[0];
  if (block.kind == MisfitKind::scale) out.value = std::exp(part[0]);
  if (block.kind == MisfitKind::displaced) out.T_correction.translation = -part;
  if (block.kind == MisfitKind::turned) {
    const Eigen::Vector3d axis = part.normalized();
    out.T_correction.rotation = so3_exp(-part);
    if (out.value > kUpsideDown_deg * kRadPerDeg && std::abs(axis.z()) < 0.5) out.kind = MisfitKind::upside_down;
  }
  if (block.kind == MisfitKind::turned) {
    out.value /= kRadPerDeg;
    out.sigma /= kRadPerDeg;
  }
  return out;
}

constexpr double kLargeTurn = 45.0 * kRadPerDeg;

using Blocks = std::vector<const Block*>;

/// The solution in which these blocks are as stated, begun at another one.
Solution solve_without(const Blocks& blocks, const WeighedSteps& weighed, const Trajectory& odometry,
                       const Solution& from) {
  Parameters begin = as_parameters(from.model), fixed = Parameters::Zero();
  for (const Block* block : blocks) {
    begin.segment(block->first, block->size).setZero();
    fixed.segment(block->first, block->size).setOnes();
  }
  return solve(weighed, odometry, as_model(begin), fixed);
}

/// A solution in which only blocks that are surely not as stated are solved for.
struct Surest {
  Blocks as_stated;
  Solution solution;
  [[nodiscard]] bool has(const Block& block) const { return std::ranges::find(as_stated, &block) == as_stated.end(); }
};

/// The least sure block is left out first. On a circle a displacement, a clock's offset and a scale look alike, and
/// together none of them would be known.
Surest surest_of(const WeighedSteps& weighed, const Solved& solved) {
  Surest out{{}, solved.solution};
  while (true) {
    const Block* least = nullptr;
    for (const Block& block : kBlocks)
      if (out.has(block) && (least == nullptr || sigmas_of(block, out.solution) < sigmas_of(*least, out.solution)))
        least = &block;
    if (least == nullptr || sigmas_of(*least, out.solution) >= kSigmas) return out;
    out.as_stated.push_back(least);
    out.solution = solve_without(out.as_stated, weighed, solved.odometry, solved.solution);
  }
}

/// Whether both halves of the steps say the same of the block's largest parameter.
bool halves_agree(const Block& block, const Eigen::Vector3d& part, const WeighedSteps& weighed,
                  const Trajectory& odometry, const Surest& surest) {
  Eigen::Index largest = 0;
  part.cwiseAbs().maxCoeff(&largest);
  const auto p = block.first + static_cast<int>(largest);
  const std::span<const ScanStep> all = weighed.steps;
  const std::size_t half = all.size() / 2;
  return std::ranges::all_of(std::array{all.first(half), all.subspan(half)}, [&](std::span<const ScanStep> steps) {
    const Solution by_half = solve_without(surest.as_stated, weigh(steps), odometry, surest.solution);
    if (block.kind == MisfitKind::turned && part.norm() > kLargeTurn)  // whose axis may come out with either sign
      return rotation_angle(by_half.model.E.inverse() * surest.solution.model.E) < 0.5 * kLargeTurn;
    const double value = as_parameters(by_half.model)[p];
    return value * part[largest] > 0.0 && std::abs(value) > kHalfSigmas * by_half.sigma[p];
  });
}

Misfit misfit_of(MisfitKind reading) {
  Misfit out{.kind = reading};
  if (reading == MisfitKind::upside_down) out.T_correction.rotation = Eigen::Quaterniond(0, 1, 0, 0);
  return out;
}

/// A LiDAR that is turned and displaced is one mistake: its correction is one pose, and a displacement that follows
/// from the rotation alone is none.
std::vector<Misfit> joined(std::vector<Misfit> misfits) {
  const auto is_turned = [](const Misfit& m) {
    return m.kind == MisfitKind::turned || m.kind == MisfitKind::upside_down;
  };
  const auto turned = std::ranges::find_if(misfits, is_turned);
  const auto displaced = std::ranges::find(misfits, MisfitKind::displaced, &Misfit::kind);
  if (turned == misfits.end() || displaced == misfits.end()) return misfits;
  const double angle = rotation_angle(turned->T_correction);
  turned->T_correction.translation = turned->T_correction.rotation * displaced->T_correction.translation;
  displaced->T_correction = turned->T_correction;
  if (displaced->value < 2.0 * std::sin(0.5 * angle) * kLargestLever_m + 0.1) misfits.erase(displaced);
  return misfits;
}

/// The fewest blocks that explain the contradiction, the one without which most is left first.
std::vector<Misfit> misfits_of(const WeighedSteps& weighed, const Solved& solved, double before) {
  const double after = solved.solution.cost.mean;
  if (after > before || (before >= kGross && after > std::max(kGood, kMostLeft * before))) return {};
  const Surest surest = surest_of(weighed, solved);
  const double left = surest.solution.cost.mean;
  const auto left_without = [&](Blocks blocks) {
    blocks.insert(blocks.begin(), surest.as_stated.begin(), surest.as_stated.end());
    return solve_without(blocks, weighed, solved.odometry, solved.solution).cost.mean;
  };
  struct Candidate {
    const Block* block;
    Eigen::Vector3d part;
    double left;  ///< Without the block.
  };
  std::vector<Candidate> candidates;
  for (const Block& block : kBlocks) {
    const Eigen::Vector3d part = known_part(block, surest.solution);
    if (surest.has(block) && part.norm() >= block.least && halves_agree(block, part, weighed, solved.odometry, surest))
      candidates.push_back({&block, part, left_without({&block})});
  }
  std::ranges::sort(candidates, std::greater{}, &Candidate::left);
  Blocks rest;
  for (const Candidate& candidate : candidates) rest.push_back(candidate.block);
  std::vector<Misfit> out;
  for (const Candidate& candidate : candidates) {
    const double least = (out.empty() ? kLeastShare : kLeastFurtherShare) * std::max(before - left, 1e-6);
    if ((rest.size() == 1 ? candidate.left : left_without(rest)) - left < least) break;
    out.push_back(misfit_of(*candidate.block, candidate.part, surest.solution));
    rest.erase(rest.begin());
  }
  return joined(std::move(out));
}

/// This is left to say where most steps contradict and nothing above explains it.
std::vector<Misfit> unexplained(const WeighedSteps& weighed, const Motions& motions, double before) {
  constexpr double kMost = 30.0, kSure2 = 36.0;
  if (before < kMost) return {};
  double sure = 0.0, known = 0.0;
  for (std::size_t k = 0; k < motions.size(); ++k) {
    if (!motions[k]) continue;
    known += 1.0;
    if (residual(weighed, k, *motions[k], {}).squaredNorm() > kSure2) sure += 1.0;
  }
  return {{.kind = MisfitKind::unexplained, .value = sure / std::max(known, 1.0)}};
}

/// Says how far odometry moves while scans lie on each other as they are; nothing where they do not.
std::optional<Misfit> stands_still(const WeighedSteps& weighed, const Motions& motions, double before, double& after) {
  double distance_m = 0.0;
  Motions still(motions.size());
  for (std::size_t k = 0; k < motions.size(); ++k) {
    if (!motions[k]) continue;
    distance_m += motions[k]->translation.norm();
    still[k] = Pose3{};
  }
  const double cost = cost_of(weighed, still, {}).mean;
  if (before < kGross || cost > kMostLeft * before || distance_m < kLeastOdometry_m) return std::nullopt;
  after = cost;
  return Misfit{.kind = MisfitKind::scans_stand_still, .value = distance_m};
}

/// Segments that look like a standstill of odometry and are explained by the clock's offset are none.
void drop_explained(std::vector<Misfit>& standstills, std::span<const ScanStep> steps, const Solved& solved) {
  constexpr double kExplained = 10.0;  // of the robust squared distance
  std::erase_if(standstills, [&](const Misfit& segment) {
    std::vector<ScanStep> within;
    for (const ScanStep& step : steps)
      if (step.from >= segment.from && step.to <= segment.to) within.push_back(step);
    const WeighedSteps weighed = weigh(within);
    const Motions by_model = motions(weighed, solved.odometry, solved.solution.model.offset_s);
    return cost_of(weighed, by_model, solved.solution.model).mean < kExplained;
  });
}

}  // namespace

OdometryFit fit_odometry(std::span<const ScanStep> steps, const Trajectory& odometry) {
  OdometryFit out;
  std::vector<ScanStep> moving;
  out.misfits = find_standstills(steps, odometry, moving);
  const WeighedSteps weighed = weigh(moving);
  const Motions now = motions(weighed, odometry, 0.0);
  const Cost before = cost_of(weighed, now, {});
  out.steps = before.known;
  out.before = out.after = before.mean;
  if (before.known < kFewestStill) return out;
  std::vector<Misfit> found;
  if (const auto still = stands_still(weighed, now, before.mean, out.after)) {
    found = {*still};
  } else if (before.known >= kFewestSteps) {
    const Solved solved = best_solution(weighed, odometry, before);
    out.after = solved.solution.cost.mean;
    drop_explained(out.misfits, steps, solved);
    if (!solved.reading)
      found = misfits_of(weighed, solved, before.mean);
    else if (out.after <= kMostLeft * before.mean)
      found = {misfit_of(*solved.reading)};
    if (found.empty() && out.after > kMostLeft * before.mean) found = unexplained(weighed, now, before.mean);
  }
  for (Misfit& misfit : found) {
    misfit.from = weighed.steps.front().from;
    misfit.to = weighed.steps.back().to;
    out.misfits.push_back(misfit);
  }
  return out;
}

}  // namespace tutti::fit
