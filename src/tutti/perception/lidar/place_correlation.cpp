// SPDX-License-Identifier: BSD-3-Clause
// A server compares each new submap with all others, so this is written for what the compiler makes of it: plain arrays
// in place of Eigen, and the same code for processors with and without AVX2. Both round alike, because no product is
// fused with a sum.
#include "tutti/perception/lidar/place_correlation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numbers>

namespace tutti::lidar {
namespace {

constexpr int kSide = PlaceViews::kSize, kCells = kSide * kSide;
using Part = std::array<float, kCells>;
struct alignas(64) Spectrum {
  Part re, im;
};

template <int lanes>
struct LaneOf;
template <>
struct LaneOf<4> {
  using Type = float __attribute__((vector_size(16)));
  using InMemory = float __attribute__((vector_size(16), aligned(4), may_alias));
};
template <>
struct LaneOf<8> {
  using Type = float __attribute__((vector_size(32)));
  using InMemory = float __attribute__((vector_size(32), aligned(4), may_alias));
};
/// So many numbers at once.
template <int lanes>
using Lane = typename LaneOf<lanes>::Type;

/// Not returned: vectors of another processor's are not passed between functions.
template <int lanes>
[[gnu::always_inline]] inline void load(const float* from, Lane<lanes>& lane) {
  lane = *reinterpret_cast<const typename LaneOf<lanes>::InMemory*>(from);
}

template <int lanes>
[[gnu::always_inline]] inline void store(const Lane<lanes>& lane, float* to) {
  *reinterpret_cast<typename LaneOf<lanes>::InMemory*>(to) = lane;
}

/// Scaled to the sum of squares 1.
[[gnu::always_inline]] inline void read_view(const char* bytes, Spectrum& out) {
  int sum = 0;
  for (std::size_t k = 0; k < kCells; ++k) {
    const int re = static_cast<signed char>(bytes[2 * k]), im = static_cast<signed char>(bytes[2 * k + 1]);
    out.re[k] = static_cast<float>(re);
    out.im[k] = static_cast<float>(im);
    sum += re * re + im * im;
  }
  const float scale = sum > 0 ? 1.0F / std::sqrt(static_cast<float>(sum)) : 0.0F;
  for (std::size_t k = 0; k < kCells; ++k) {
    out.re[k] *= scale;
    out.im[k] *= scale;
  }
}

/// X(-k) of X(k).
[[gnu::always_inline]] inline void mirror(const Part& in, Part& out) {
  for (int row = 0; row < kSide; ++row) {
    const float* from = in.data() + kSide * ((kSide - row) % kSide);
    float* to = out.data() + kSide * row;
    to[0] = from[0];
    for (int column = 1; column < kSide; ++column) to[column] = from[kSide - column];
  }
}

/// conj(B(k)) - i conj(B(-k)), from which highest() makes the correlation with b and with b turned by half.
[[gnu::always_inline]] inline void both_directions(const char* bytes, Spectrum& out) {
  Spectrum b, mirrored;
  read_view(bytes, b);
  mirror(b.re, mirrored.re);
  mirror(b.im, mirrored.im);
  for (std::size_t k = 0; k < kCells; ++k) {
    out.re[k] = b.re[k] - mirrored.im[k];
    out.im[k] = -b.im[k] - mirrored.re[k];
  }
}

struct Turn {
  float re, im;
};

/// exp(i pi k / half) at half - 1 + k, for half = 1, 2, 4, 8 and 16.
const std::array<Turn, kSide - 1>& turns() {
  static const std::array<Turn, kSide - 1> all = [] {
    std::array<Turn, kSide - 1> out{};
    for (int half = 1; half < kSide; half *= 2)
      for (int k = 0; k < half; ++k) {
        const double angle = std::numbers::pi * k / half;
        out[static_cast<std::size_t>(half - 1 + k)] = {static_cast<float>(std::cos(angle)),
                                                       static_cast<float>(std::sin(angle))};
      }
    return out;
  }();
  return all;
}

constexpr int reversed(int k) {
  int out = 0;
  for (int bit = 1; bit < kSide; bit *= 2) out = 2 * out + ((k & bit) != 0 ? 1 : 0);
  return out;
}

/// The first two steps of transform() on four rows that follow each other, whose turns are 1 and i.
template <int lanes>
[[gnu::always_inline]] inline void join_four(float* re, float* im) {
  for (int k = 0; k < kSide; k += lanes, re += lanes, im += lanes) {
    Lane<lanes> x0, x1, x2, x3, y0, y1, y2, y3;
    load<lanes>(re, x0);
    load<lanes>(re + kSide, x1);
    load<lanes>(re + 2 * kSide, x2);
    load<lanes>(re + 3 * kSide, x3);
    load<lanes>(im, y0);
    load<lanes>(im + kSide, y1);
    load<lanes>(im + 2 * kSide, y2);
    load<lanes>(im + 3 * kSide, y3);
    const Lane<lanes> a_re = x0 + x1, a_im = y0 + y1, b_re = x0 - x1, b_im = y0 - y1;
    const Lane<lanes> c_re = x2 + x3, c_im = y2 + y3, d_re = x2 - x3, d_im = y2 - y3;
    store<lanes>(a_re + c_re, re);
    store<lanes>(b_re - d_im, re + kSide);
    store<lanes>(a_re - c_re, re + 2 * kSide);
    store<lanes>(b_re + d_im, re + 3 * kSide);
    store<lanes>(a_im + c_im, im);
    store<lanes>(b_im + d_re, im + kSide);
    store<lanes>(a_im - c_im, im + 2 * kSide);
    store<lanes>(b_im - d_re, im + 3 * kSide);
  }
}

/// One step of transform() on two rows.
template <int lanes>
[[gnu::always_inline]] inline void join_two(float* re, float* im, int half, const Turn& turn) {
  for (int k = 0; k < kSide; k += lanes) {
    float *first_re = re + k, *first_im = im + k, *second_re = first_re + kSide * half,
          *second_im = first_im + kSide * half;
    Lane<lanes> a_re, a_im, b_re, b_im;
    load<lanes>(first_re, a_re);
    load<lanes>(first_im, a_im);
    load<lanes>(second_re, b_re);
    load<lanes>(second_im, b_im);
    const Lane<lanes> turned_re = turn.re * b_re - turn.im * b_im, turned_im = turn.re * b_im + turn.im * b_re;
    store<lanes>(a_re + turned_re, first_re);
    store<lanes>(a_im + turned_im, first_im);
    store<lanes>(a_re - turned_re, second_re);
    store<lanes>(a_im - turned_im, second_im);
  }
}

/// Inverse Fourier transform of every column at once, not normalised, of rows in reversed() order (Cooley and Tukey
/// 1965).
template <int lanes>
[[gnu::always_inline]] inline void transform(Spectrum& s) {
  for (int row = 0; row < kSide; row += 4) join_four<lanes>(s.re.data() + kSide * row, s.im.data() + kSide * row);
  for (int half = 4; half < kSide; half *= 2)
    for (int j = 0; j < half; ++j)
      for (int row = j; row < kSide; row += 2 * half)
        join_two<lanes>(s.re.data() + kSide * row, s.im.data() + kSide * row, half,
                        turns()[static_cast<std::size_t>(half - 1 + j)]);
}

/// A block of lanes x lanes, which lies at `in` with rows of kSide, to the rows `out`.
template <int lanes>
[[gnu::always_inline]] inline void transpose_block(const float* in, const std::array<float*, lanes>& out) {
  std::array<Lane<lanes>, lanes> r, t;
  for (int i = 0; i < lanes; ++i) load<lanes>(in + kSide * i, r[i]);
  if constexpr (lanes == 8) {
    for (int i = 0; i < 8; i += 2) {
      t[i] = __builtin_shufflevector(r[i], r[i + 1], 0, 8, 2, 10, 4, 12, 6, 14);
      t[i + 1] = __builtin_shufflevector(r[i], r[i + 1], 1, 9, 3, 11, 5, 13, 7, 15);
    }
    for (const int i : {0, 1, 4, 5}) {
      r[i] = __builtin_shufflevector(t[i], t[i + 2], 0, 1, 8, 9, 4, 5, 12, 13);
      r[i + 2] = __builtin_shufflevector(t[i], t[i + 2], 2, 3, 10, 11, 6, 7, 14, 15);
    }
    for (int i = 0; i < 4; ++i) {
      t[i] = __builtin_shufflevector(r[i], r[i + 4], 0, 1, 2, 3, 8, 9, 10, 11);
      t[i + 4] = __builtin_shufflevector(r[i], r[i + 4], 4, 5, 6, 7, 12, 13, 14, 15);
    }
  } else {
    static_assert(lanes == 4);
    for (const int i : {0, 2}) {
      t[i] = __builtin_shufflevector(r[i], r[i + 1], 0, 4, 2, 6);
      t[i + 1] = __builtin_shufflevector(r[i], r[i + 1], 1, 5, 3, 7);
    }
    for (const int i : {0, 1}) {
      r[i] = __builtin_shufflevector(t[i], t[i + 2], 0, 1, 4, 5);
      r[i + 2] = __builtin_shufflevector(t[i], t[i + 2], 2, 3, 6, 7);
    }
    t = r;
  }
  for (int i = 0; i < lanes; ++i) store<lanes>(t[i], out[i]);
}

/// With its rows in reversed() order, as transform() wants them.
template <int lanes>
[[gnu::always_inline]] inline void transpose(const Part& in, Part& out) {
  for (int row = 0; row < kSide; row += lanes)
    for (int column = 0; column < kSide; column += lanes) {
      std::array<float*, lanes> rows;
      for (int i = 0; i < lanes; ++i) rows[i] = out.data() + kSide * reversed(column + i) + row;
      transpose_block<lanes>(in.data() + kSide * row + column, rows);
    }
}

template <int lanes>
[[gnu::always_inline]] inline float largest(const Spectrum& s) {
  Lane<lanes> best, next;
  load<lanes>(s.re.data(), best);
  for (const Part* part : {&s.re, &s.im})
    for (int k = 0; k < kCells; k += lanes) {
      load<lanes>(part->data() + k, next);
      best = best > next ? best : next;
    }
  float out = best[0];
  for (int i = 1; i < lanes; ++i) out = std::max(out, best[i]);
  return out;
}

}  // namespace

/// The factors of highest(), with M = conj(A(-k)).
struct alignas(64) PlaceViews::View {
  Part sum_re, sum_im;                // Re A + Im M, Im A + Re M
  Part difference_re, difference_im;  // Re A - Im M, Im A - Re M

  /// The correlation with the view of both_directions(), as correlate_both() of candidates.cpp: its spectrum is
  /// A U - i M conj(U).
  template <int lanes>
  [[gnu::always_inline]] inline float highest(const Spectrum& u) const {
    Spectrum s, t;
    for (int row = 0; row < kSide; ++row) {
      float *re = s.re.data() + kSide * reversed(row), *im = s.im.data() + kSide * reversed(row);
      for (int k = kSide * row; k < kSide * (row + 1); k += lanes, re += lanes, im += lanes) {
        Lane<lanes> a, b, u_re, u_im;
        load<lanes>(u.re.data() + k, u_re);
        load<lanes>(u.im.data() + k, u_im);
        load<lanes>(sum_re.data() + k, a);
        load<lanes>(sum_im.data() + k, b);
        store<lanes>(a * u_re - b * u_im, re);
        load<lanes>(difference_re.data() + k, a);
        load<lanes>(difference_im.data() + k, b);
        store<lanes>(a * u_im + b * u_re, im);
      }
    }
    transform<lanes>(s);
    transpose<lanes>(s.re, t.re);
    transpose<lanes>(s.im, t.im);
    transform<lanes>(t);
    return 0.5F * largest<lanes>(t);
  }

  template <int lanes>
  [[gnu::always_inline]] static inline float highest_of(std::span<const View> views, std::span<const char> others) {
    float best = 0.0F;
    for (std::size_t at = 0; at + kViewBytes <= others.size(); at += kViewBytes) {
      Spectrum u;
      both_directions(others.data() + at, u);
      for (const View& view : views) best = std::max(best, view.highest<lanes>(u));
    }
    return best;
  }

#ifdef __x86_64__
  [[gnu::target("avx2")]] static float highest_avx2(std::span<const View> views, std::span<const char> others) {
    return highest_of<8>(views, others);
  }
#endif
};

PlaceViews::PlaceViews(std::span<const char> bytes)
    : views_(std::make_unique<View[]>(bytes.size() / kViewBytes)), count_(bytes.size() / kViewBytes) {
  for (std::size_t i = 0; i < count_; ++i) {
    Spectrum a, mirrored;
    read_view(bytes.data() + i * kViewBytes, a);
    mirror(a.re, mirrored.re);
    mirror(a.im, mirrored.im);
    for (std::size_t k = 0; k < kCells; ++k) {
      views_[i].sum_re[k] = a.re[k] - mirrored.im[k];
      views_[i].sum_im[k] = a.im[k] + mirrored.re[k];
      views_[i].difference_re[k] = a.re[k] + mirrored.im[k];
      views_[i].difference_im[k] = a.im[k] - mirrored.re[k];
    }
  }
}

PlaceViews::~PlaceViews() = default;

float PlaceViews::highest(std::span<const char> others) const {
#ifdef __x86_64__
  static const bool has_avx2 = __builtin_cpu_supports("avx2") != 0;
  if (has_avx2) return View::highest_avx2({views_.get(), count_}, others);
#endif
  return highest_anywhere(others);
}

float PlaceViews::highest_anywhere(std::span<const char> others) const {
  return View::highest_of<4>({views_.get(), count_}, others);
}

}  // namespace tutti::lidar
