// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/candidates.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "tutti/geometry/so3.hpp"
#include "tutti/perception/lidar/fft.hpp"

namespace tutti::lidar {
namespace {

constexpr int kN = kImageSize;
constexpr int kMask = kN - 1;
constexpr double kMinScore = 0.1;  // correlation below which a guess is not worth a registration
static_assert((kN & kMask) == 0);

/// A pose of b's view on a's, in the level frames, about the centres of the views.
struct Peak {
  double yaw = 0.0;
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();  ///< m
  float value = 0.0F;
};

/// Correlations c(s) = sum_x Re(conj(f_b(x - s)) f_a(x)) of image a with image b (real part of the result) and with b
/// turned by half (imaginary part). With A, B the spectra, C = A conj(B); the half turn gives C' = -A conj(B(-k)); the
/// spectrum of Re c is H(k) = (C(k) + conj(C(-k))) / 2; one inverse transform of H + i H' yields both.
ComplexImage correlate_both(const ComplexImage& A, const ComplexImage& A_mirrored, const ComplexImage& B) {
  constexpr std::complex<float> i(0.0F, 1.0F);
  const ComplexImage B_mirrored = mirrored(B);
  // H + i H', but for a factor 1/2
  return inverse_fft(A * (B.conjugate() - i * B_mirrored.conjugate()) + A_mirrored.conjugate() * (B_mirrored - i * B));
}

/// Adds the highest point of a correlation, and the highest one farther than `apart` cells (in either axis) from it.
void add_peaks(Eigen::ArrayXXf correlation, double direction_a, double yaw, int apart, double cell_m,
               std::vector<Peak>& peaks) {
  const auto centred = [](int i) { return i < kN / 2 ? i : i - kN; };
  for (int n = 0; n < 2; ++n) {
    int y = 0, x = 0;
    const float best = correlation.maxCoeff(&y, &x);
    const Eigen::Vector2d cells(centred(x), centred(y));
    peaks.push_back({yaw, Eigen::Rotation2Dd(direction_a) * (cell_m * cells), 0.5F * best});
    for (int dy = -apart; dy <= apart; ++dy)
      for (int dx = -apart; dx <= apart; ++dx) correlation((y + dy) & kMask, (x + dx) & kMask) = 0.0F;
  }
}

/// The best two shifts of every yaw that lays a wall direction of b on one of a.
std::vector<Peak> correlate(const SubmapFeatures& a, const SubmapFeatures& b, const CandidateConfig& config) {
  const int apart = std::min(static_cast<int>(kDistinct_m / config.cell_m), kN / 2 - 1);
  std::vector<Peak> peaks;
  for (const TurnedView& view_a : *a.turned_views) {
    const ComplexImage mirrored_a = mirrored(view_a.spectrum);
    for (const TurnedView& view_b : *b.turned_views) {
      const ComplexImage both = correlate_both(view_a.spectrum, mirrored_a, view_b.spectrum);
      const double yaw = view_a.direction - view_b.direction;
      add_peaks(both.real(), view_a.direction, yaw, apart, config.cell_m, peaks);
      add_peaks(both.imag(), view_a.direction, yaw + std::numbers::pi, apart, config.cell_m, peaks);
    }
  }
  return peaks;
}

/// The best peaks, best first, that differ enough in yaw or shift to be different alignments.
std::vector<Peak> select_distinct(std::vector<Peak> peaks, const CandidateConfig& config) {
  std::stable_sort(peaks.begin(), peaks.end(), [](const Peak& p, const Peak& q) { return p.value > q.value; });
  std::vector<Peak> chosen;
  for (const Peak& peak : peaks) {
    if (peak.value < static_cast<float>(kMinScore)) break;
    if (chosen.size() >= static_cast<std::size_t>(config.max_guesses)) break;
    const bool known = std::any_of(chosen.begin(), chosen.end(), [&](const Peak& other) {
      const double turn = std::remainder(other.yaw - peak.yaw, 2.0 * std::numbers::pi);
      return std::abs(turn) < kDistinct_deg * kRadPerDeg && (other.shift - peak.shift).norm() <= kDistinct_m;
    });
    if (!known) chosen.push_back(peak);
  }
  return chosen;
}

/// Height of b's level frame in a's: the most frequent difference between floors of both that lie above each other; 0
/// without any.
double find_height(const BirdsEyeView& a, const BirdsEyeView& b, const Peak& peak, double cell_m) {
  constexpr float kBin = 0.1F;
  constexpr int kZero = 200;  // bin of difference 0: up to 20 m in either direction
  std::array<float, 2 * kZero> votes{};
  const Eigen::Matrix2f R = Eigen::Rotation2Df(static_cast<float>(peak.yaw)).toRotationMatrix();
  const Eigen::Vector2f shift = peak.shift.cast<float>();
  for (const FloorCell& floor : b.floors) {
    const auto wanted = floor_patch(R * floor.position + shift, floor.faces_up(), cell_m);
    for (const FloorCell& other : std::ranges::equal_range(a.floors, wanted, {}, &FloorCell::patch)) {
      const float at = (other.height - floor.height) / kBin + kZero;
      const int bin = static_cast<int>(at);
      if (bin < 1 || bin + 2 >= 2 * kZero) continue;
      // The two nearest bins by distance, then smoothed with (1, 2, 1).
      const float beyond = at - static_cast<float>(bin);
      votes[bin - 1] += 1.0F - beyond;
      votes[bin] += 2.0F - beyond;
      votes[bin + 1] += 1.0F + beyond;
      votes[bin + 2] += beyond;
    }
  }
  const auto best = std::ranges::max_element(votes);
  return *best > 0.0F ? kBin * static_cast<float>(best - votes.begin() - kZero) : 0.0;
}

AlignmentGuess to_guess(const SubmapFeatures& a, const SubmapFeatures& b, const Peak& peak,
                        const CandidateConfig& config) {
  Pose3 T_level_a_level_b{Eigen::Quaterniond(Eigen::AngleAxisd(peak.yaw, Eigen::Vector3d::UnitZ()))};
  T_level_a_level_b.translation.head<2>() = a.view.centre + peak.shift - Eigen::Rotation2Dd(peak.yaw) * b.view.centre;
  T_level_a_level_b.translation.z() = find_height(a.view, b.view, peak, config.cell_m);
  return {Pose3{a.R_level_submap}.inverse() * T_level_a_level_b * Pose3{b.R_level_submap}, double{peak.value}};
}

}  // namespace

std::vector<AlignmentGuess> propose_alignments(const SubmapFeatures& a, const SubmapFeatures& b,
                                               const LidarClosureConfig& config) {
  if (!a.usable || !b.usable) return {};
  std::vector<AlignmentGuess> guesses;
  for (const Peak& peak : select_distinct(correlate(a, b, config.candidates), config.candidates))
    guesses.push_back(to_guess(a, b, peak, config.candidates));
  return guesses;
}

bool plausible_pair(const SubmapFeatures& a, const SubmapFeatures& b) {
  const auto enough = [](const SubmapFeatures& f) { return f.usable && has_enough_walls(f.view); };
  return enough(a) && enough(b);
}

}  // namespace tutti::lidar
