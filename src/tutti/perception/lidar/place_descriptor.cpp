// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/place_descriptor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <numbers>
#include <utility>
#include <vector>

#include "tutti/base/check.hpp"
#include "tutti/perception/lidar/birds_eye_view.hpp"
#include "tutti/perception/lidar/fft.hpp"
#include "tutti/perception/lidar/submap_features.hpp"

namespace tutti::lidar {
namespace {

constexpr int kSize = 32;
constexpr std::uint8_t kDescriptorVersion = 1;  // raised with every change of the bytes, or of what they are made of
constexpr std::size_t kViewBytes = 2 * kSize * kSize;

/// Two parts instead of complex numbers, so that the compiler works on several rows' elements at once.
using Part = Eigen::Array<float, kSize, kSize, Eigen::RowMajor>;
struct Spectrum {
  Part re, im;
};

/// What the bytes begin with: made with other settings, descriptors cannot be compared.
constexpr std::size_t kHeadBytes = 9;
std::string head_of(const LidarClosureConfig& config) {
  const std::array<float, 2> numbers{static_cast<float>(config.candidates.cell_m), static_cast<float>(config.voxel_m)};
  std::string out(kHeadBytes, static_cast<char>(kDescriptorVersion));
  std::memcpy(out.data() + 1, numbers.data(), sizeof numbers);
  return out;
}

/// Index of the same wavelength in the spectrum of the whole view.
int in_whole(int k) { return k < kSize / 2 ? k : kImageSize - kSize + k; }

/// The longest wavelengths, each part as a number of 8 bits. The shortest of them are left out: they have no mirror
/// image.
void append(const ComplexImage& spectrum, std::string& out) {
  Eigen::Array<std::complex<float>, kSize, kSize, Eigen::RowMajor> kept;
  for (int row = 0; row < kSize; ++row)
    for (int column = 0; column < kSize; ++column)
      kept(row, column) = row == kSize / 2 || column == kSize / 2 ? 0.0F : spectrum(in_whole(row), in_whole(column));
  const float most = std::max(kept.real().abs().maxCoeff(), kept.imag().abs().maxCoeff());
  const float scale = most > 0.0F ? 127.0F / most : 0.0F;
  for (int row = 0; row < kSize; ++row)
    for (int column = 0; column < kSize; ++column)
      for (const float part : {kept(row, column).real(), kept(row, column).imag()})
        out.push_back(static_cast<char>(std::lround(scale * part)));
}

/// A view with the sum of squares 1.
Spectrum read_view(const char* bytes) {
  Spectrum out;
  for (int k = 0; k < kSize * kSize; ++k) {
    out.re.data()[k] = static_cast<float>(static_cast<signed char>(bytes[2 * k]));
    out.im.data()[k] = static_cast<float>(static_cast<signed char>(bytes[2 * k + 1]));
  }
  const float norm = std::sqrt((out.re.square() + out.im.square()).sum());
  if (norm > 0.0F) {
    out.re /= norm;
    out.im /= norm;
  }
  return out;
}

/// conj(B(k)) - i conj(B(-k)), from which highest() makes the correlation with b and with b turned by half.
Spectrum both_ways(const Spectrum& b) { return {b.re - mirrored(b.im), -b.im - mirrored(b.re)}; }

/// A view to be correlated with others: the factors of highest(), with M = conj(A(-k)).
struct View {
  Part sum_re, sum_im;                // Re A + Im M, Im A + Re M
  Part difference_re, difference_im;  // Re A - Im M, Im A - Re M
};

View prepared(const Spectrum& a) {
  const Part re = mirrored(a.re), im = mirrored(a.im);
  return {a.re - im, a.im + re, a.re + im, a.im - re};
}

struct Turn {
  float re, im;
};

/// exp(i pi k / half), k < half.
template <int half>
const std::array<Turn, half>& turns() {
  static const std::array<Turn, half> all = [] {
    std::array<Turn, half> out{};
    for (int k = 0; k < half; ++k) {
      const double angle = std::numbers::pi * k / half;
      out[static_cast<std::size_t>(k)] = {static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle))};
    }
    return out;
  }();
  return all;
}

/// One step of transform(): joins transforms of `half` rows.
template <int half>
void join_halves(Spectrum& s) {
  using Row = Eigen::Array<float, 1, kSize>;
  for (int j = 0; j < half; ++j) {
    const Turn w = turns<half>()[static_cast<std::size_t>(j)];
    for (int i = j; i < kSize; i += 2 * half) {
      const Row re = w.re * s.re.row(i + half) - w.im * s.im.row(i + half);
      const Row im = w.re * s.im.row(i + half) + w.im * s.re.row(i + half);
      s.re.row(i + half) = s.re.row(i) - re;
      s.im.row(i + half) = s.im.row(i) - im;
      s.re.row(i) += re;
      s.im.row(i) += im;
    }
  }
}

constexpr int reversed(int k) {
  int out = 0;
  for (int bit = 1; bit < kSize; bit *= 2) out = 2 * out + ((k & bit) != 0 ? 1 : 0);
  return out;
}

/// Inverse Fourier transform of every column at once, not normalised (Cooley and Tukey 1965).
void transform(Spectrum& s) {
  for (int k = 0; k < kSize; ++k)
    if (const int other = reversed(k); k < other) {
      s.re.row(k).swap(s.re.row(other));
      s.im.row(k).swap(s.im.row(other));
    }
  join_halves<1>(s);
  join_halves<2>(s);
  join_halves<4>(s);
  join_halves<8>(s);
  join_halves<16>(s);
}

/// The highest point of the correlations of a with b and with b turned by half: as correlate_both() of candidates.cpp,
/// whose spectrum is A U - i M conj(U), with U of both_ways().
float highest(const View& a, const Spectrum& u) {
  Spectrum s;
  s.re = a.sum_re * u.re - a.sum_im * u.im;
  s.im = a.difference_re * u.im + a.difference_im * u.re;
  transform(s);
  s.re.transposeInPlace();
  s.im.transposeInPlace();
  transform(s);
  return 0.5F * std::max(s.re.maxCoeff(), s.im.maxCoeff());
}

}  // namespace

std::string describe_place(const Submap& submap, const LidarClosureConfig& config) {
  const std::vector<TurnedView> views = views_from_above(submap, config);
  if (views.empty()) return {};
  std::string out = head_of(config);
  for (const TurnedView& view : views) append(view.spectrum, out);
  return out;
}

bool is_descriptor(std::string_view bytes, const LidarClosureConfig& config) {
  return bytes.size() > kHeadBytes && (bytes.size() - kHeadBytes) % kViewBytes == 0 &&
         bytes.starts_with(head_of(config));
}

struct PlaceMatcher::Place {
  std::vector<View> views;
};

PlaceMatcher::PlaceMatcher(std::string_view descriptor) {
  TUTTI_CHECK(descriptor.size() > kHeadBytes, "no descriptor of {} bytes", descriptor.size());
  auto place = std::make_unique<Place>();
  for (std::size_t at = kHeadBytes; at + kViewBytes <= descriptor.size(); at += kViewBytes)
    place->views.push_back(prepared(read_view(descriptor.data() + at)));
  place_ = std::move(place);
}

PlaceMatcher::~PlaceMatcher() = default;

double PlaceMatcher::likeness(std::string_view other) const {
  float best = 0.0F;
  for (std::size_t at = kHeadBytes; at + kViewBytes <= other.size(); at += kViewBytes) {
    const Spectrum u = both_ways(read_view(other.data() + at));
    for (const View& a : place_->views) best = std::max(best, highest(a, u));
  }
  return double{best};
}

}  // namespace tutti::lidar
