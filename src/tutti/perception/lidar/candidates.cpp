// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/candidates.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <tuple>

#include "tutti/perception/lidar/fft.hpp"

namespace tutti::lidar {
namespace {

constexpr int kN = kImageSize;
constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr int kMask = kN - 1;
static_assert((kN & kMask) == 0);

/// Best shift at one yaw; a shift of b's turned image relative to a's, in cells.
struct Peak {
  int yaw_step = 0;
  int x = 0, y = 0;
  float value = 0.0F;
};

/// Image of the wall normals (x + i y) of a view turned by `yaw`. What lies outside the image is left out: wrapped
/// around it would stand in a wrong place.
ComplexImage draw(const BirdsEyeView& view, double yaw, double cell_m) {
  ComplexImage image;
  const auto c = static_cast<float>(std::cos(yaw)), s = static_cast<float>(std::sin(yaw));
  const auto inverse_cell = static_cast<float>(1.0 / cell_m);
  constexpr float kReach = 0.5F * kN - 1.0F;
  for (const auto& wall : view.walls) {
    const float x = inverse_cell * (c * wall.position.x() - s * wall.position.y());
    const float y = inverse_cell * (s * wall.position.x() + c * wall.position.y());
    if (x * x + y * y > kReach * kReach) continue;
    const float nx = c * wall.normal.x() - s * wall.normal.y(), ny = s * wall.normal.x() + c * wall.normal.y();
    const float x0 = std::floor(x), y0 = std::floor(y), fx = x - x0, fy = y - y0;
    const int column = static_cast<int>(x0), row = static_cast<int>(y0);
    for (int corner = 0; corner < 4; ++corner) {  // bilinear
      const int dx = corner & 1, dy = corner >> 1;
      const float w = (dx ? fx : 1.0F - fx) * (dy ? fy : 1.0F - fy);
      const int k = ((row + dy) & kMask) * kN + ((column + dx) & kMask);
      image.re[k] += w * nx;
      image.im[k] += w * ny;
    }
  }
  return image;
}

double norm(const ComplexImage& image) {
  double sum = 0.0;
  for (std::size_t k = 0; k < image.re.size(); ++k)
    sum += double{image.re[k]} * image.re[k] + double{image.im[k]} * image.im[k];
  return std::sqrt(sum);
}

/// f(-x) from f(x): of a spectrum as well as of an image.
ComplexImage mirrored(const ComplexImage& f) {
  ComplexImage out;
  for (int row = 0; row < kN; ++row)
    for (int column = 0; column < kN; ++column) {
      const int from = ((kN - row) & kMask) * kN + ((kN - column) & kMask), to = row * kN + column;
      out.re[to] = f.re[from];
      out.im[to] = f.im[from];
    }
  return out;
}

/// Spectrum of the normal image turned by a quarter: f'(x) = i f(R^-1 x), and R maps the periodic grid onto itself.
ComplexImage turned_by_quarter(const ComplexImage& f) {
  ComplexImage out;
  for (int row = 0; row < kN; ++row)
    for (int column = 0; column < kN; ++column) {
      const int from = ((kN - column) & kMask) * kN + row, to = row * kN + column;
      out.re[to] = -f.im[from];
      out.im[to] = f.re[from];
    }
  return out;
}

/// Correlations c(s) = sum_x Re(conj(f_b(x - s)) f_a(x)) of image a with image b (real part of the result) and with b
/// turned by half (imaginary part). With A, B the spectra, C = A conj(B); the half turn gives C' = -A conj(B(-k)); the
/// spectrum of Re c is H(k) = (C(k) + conj(C(-k))) / 2; one inverse transform of H + i H' yields both.
ComplexImage correlate_both(const Fft& fft, const ComplexImage& A, const ComplexImage& A_mirrored,
                            const ComplexImage& B) {
  const ComplexImage B_mirrored = mirrored(B);
  ComplexImage H;
  const float *a_re = A.re.data(), *a_im = A.im.data(), *am_re = A_mirrored.re.data(), *am_im = A_mirrored.im.data();
  const float *b_re = B.re.data(), *b_im = B.im.data(), *bm_re = B_mirrored.re.data(), *bm_im = B_mirrored.im.data();
  float *h_re = H.re.data(), *h_im = H.im.data();
  for (int k = 0; k < kN * kN; ++k) {
    // H + i H' = A (conj(B) - i conj(B-)) + conj(A-) (B- - i B), but for a factor 1/2
    const float u_re = b_re[k] - bm_im[k], u_im = -b_im[k] - bm_re[k];
    const float v_re = bm_re[k] + b_im[k], v_im = bm_im[k] - b_re[k];
    h_re[k] = a_re[k] * u_re - a_im[k] * u_im + am_re[k] * v_re + am_im[k] * v_im;
    h_im[k] = a_re[k] * u_im + a_im[k] * u_re + am_re[k] * v_im - am_im[k] * v_re;
  }
  return fft.inverse(H);
}

/// The highest point, and the highest one farther than `apart` cells (in either axis) from it.
std::array<Peak, 2> find_peaks(std::vector<float> correlation, int yaw_step, int apart, float scale) {
  std::array<Peak, 2> peaks;
  const auto centred = [](int i) { return i < kN / 2 ? i : i - kN; };
  for (Peak& peak : peaks) {
    const auto best = std::max_element(correlation.begin(), correlation.end());
    const int k = static_cast<int>(best - correlation.begin());
    peak = {.yaw_step = yaw_step, .x = centred(k & kMask), .y = centred(k / kN), .value = *best * scale};
    for (int dy = -apart; dy <= apart; ++dy)
      for (int dx = -apart; dx <= apart; ++dx) correlation[((k / kN + dy) & kMask) * kN + ((k + dx) & kMask)] = 0.0F;
  }
  return peaks;
}

/// The best two shifts of every yaw.
std::vector<Peak> correlate(const BirdsEyeView& a, const BirdsEyeView& b, const CandidateConfig& config) {
  const Fft fft;
  const ComplexImage image_a = draw(a, 0.0, config.cell_m);
  const ComplexImage A = fft.forward(image_a), A_mirrored = mirrored(A);
  const double norm_a = norm(image_a);
  const int quarter = config.yaw_steps_per_quarter;
  const int apart = std::min(static_cast<int>(config.distinct_m / config.cell_m), kN / 2 - 1);
  std::vector<Peak> peaks;
  for (int step = 0; step < quarter; ++step) {
    const ComplexImage image_b = draw(b, kTwoPi * step / (4 * quarter), config.cell_m);
    const double norm_b = norm(image_b);
    if (norm_a == 0.0 || norm_b == 0.0) return {};
    const auto scale = static_cast<float>(0.5 / (double{kN} * kN * norm_a * norm_b));
    ComplexImage B = fft.forward(image_b);
    for (int turn = 0; turn < 2; ++turn) {
      if (turn == 1) B = turned_by_quarter(B);
      const ComplexImage both = correlate_both(fft, A, A_mirrored, B);
      for (const Peak& peak : find_peaks(both.re, step + turn * quarter, apart, scale)) peaks.push_back(peak);
      for (const Peak& peak : find_peaks(both.im, step + (turn + 2) * quarter, apart, scale)) peaks.push_back(peak);
    }
  }
  return peaks;
}

/// The best peaks, best first, that differ enough in yaw or shift to be different alignments.
std::vector<Peak> select_distinct(std::vector<Peak> peaks, const CandidateConfig& config) {
  const int yaw_steps = 4 * config.yaw_steps_per_quarter;
  std::sort(peaks.begin(), peaks.end(),
            [](const Peak& p, const Peak& q) { return std::tie(q.value, p.yaw_step) < std::tie(p.value, q.yaw_step); });
  std::vector<Peak> chosen;
  for (const Peak& peak : peaks) {
    if (peak.value < static_cast<float>(config.min_score)) break;
    if (chosen.size() >= static_cast<std::size_t>(config.max_guesses)) break;
    const bool known = std::any_of(chosen.begin(), chosen.end(), [&](const Peak& other) {
      const int turn = std::abs(other.yaw_step - peak.yaw_step);
      const double shift_m = config.cell_m * std::hypot(other.x - peak.x, other.y - peak.y);
      return std::min(turn, yaw_steps - turn) * 360.0 / yaw_steps < config.distinct_deg && shift_m <= config.distinct_m;
    });
    if (!known) chosen.push_back(peak);
  }
  return chosen;
}

/// Where the smoothed histogram of the values is highest; 0 without values.
double find_mode(const std::vector<double>& values, double bin_size) {
  std::map<int, double> votes;
  for (const double value : values) {
    const double low = std::floor(value / bin_size), beyond = value / bin_size - low;
    const int bin = static_cast<int>(low);
    // The two nearest bins by distance, then smoothed with (1, 2, 1).
    votes[bin - 1] += 1.0 - beyond;
    votes[bin] += 2.0 - beyond;
    votes[bin + 1] += 1.0 + beyond;
    votes[bin + 2] += beyond;
  }
  const auto best =
      std::max_element(votes.begin(), votes.end(), [](const auto& p, const auto& q) { return p.second < q.second; });
  return best == votes.end() ? 0.0 : bin_size * best->first;
}

/// Height of b's level frame in a's: the most frequent difference between floors of both that lie above each other.
double find_height(const BirdsEyeView& a, const BirdsEyeView& b, double yaw, const Eigen::Vector2d& shift,
                   double cell_m) {
  constexpr double kHeightBin = 0.1;
  using Key = std::tuple<int, int, bool>;
  const auto key = [&](const Eigen::Vector2d& p, bool faces_up) {
    const Eigen::Vector2d cell = (p / (2.0 * cell_m)).array().floor();
    return Key(static_cast<int>(cell.x()), static_cast<int>(cell.y()), faces_up);
  };
  std::multimap<Key, double> floors;
  for (const auto& floor : a.floors) floors.emplace(key(floor.position.cast<double>(), floor.faces_up), floor.height);
  const Eigen::Matrix2d R = Eigen::Rotation2Dd(yaw).toRotationMatrix();
  std::vector<double> differences;
  for (const auto& floor : b.floors) {
    const auto [begin, end] = floors.equal_range(key(R * floor.position.cast<double>() + shift, floor.faces_up));
    for (auto it = begin; it != end; ++it) differences.push_back(it->second - double{floor.height});
  }
  return find_mode(differences, kHeightBin);
}

AlignmentGuess to_guess(const SubmapFeatures& a, const SubmapFeatures& b, const Peak& peak,
                        const CandidateConfig& config) {
  const double yaw = kTwoPi * peak.yaw_step / (4 * config.yaw_steps_per_quarter);
  const Eigen::Vector2d shift = config.cell_m * Eigen::Vector2d(peak.x, peak.y);
  Pose3 T_level_a_level_b{Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()))};
  T_level_a_level_b.translation.head<2>() = a.view.centre + shift - Eigen::Rotation2Dd(yaw) * b.view.centre;
  T_level_a_level_b.translation.z() = find_height(a.view, b.view, yaw, shift, config.cell_m);
  return {Pose3{a.R_level_submap}.inverse() * T_level_a_level_b * Pose3{b.R_level_submap}, double{peak.value}};
}

}  // namespace

std::vector<AlignmentGuess> propose_alignments(const SubmapFeatures& a, const SubmapFeatures& b,
                                               const LidarClosureConfig& config) {
  if (!a.usable || !b.usable) return {};
  std::vector<AlignmentGuess> guesses;
  for (const Peak& peak : select_distinct(correlate(a.view, b.view, config.candidates), config.candidates))
    guesses.push_back(to_guess(a, b, peak, config.candidates));
  return guesses;
}

bool plausible_pair(const SubmapFeatures& a, const SubmapFeatures& b, const LidarClosureConfig& config) {
  const auto enough = [&](const SubmapFeatures& f) {
    return f.usable && f.view.walls.size() >= static_cast<std::size_t>(config.candidates.min_wall_cells);
  };
  return enough(a) && enough(b);
}

}  // namespace tutti::lidar
