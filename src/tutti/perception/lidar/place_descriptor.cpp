// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/place_descriptor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <cstring>
#include <vector>

#include "tutti/base/check.hpp"
#include "tutti/perception/lidar/birds_eye_view.hpp"
#include "tutti/perception/lidar/fft.hpp"
#include "tutti/perception/lidar/submap_features.hpp"

namespace tutti::lidar {
namespace {

constexpr int kSize = PlaceViews::kSize;
constexpr std::uint8_t kDescriptorVersion = 1;  // raised with every change of the bytes, or of what they are made of

/// The head of the bytes: descriptors made with other settings cannot be compared.
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

std::string_view views_of(std::string_view descriptor) {
  TUTTI_CHECK(descriptor.size() > kHeadBytes, "no descriptor of {} bytes", descriptor.size());
  return descriptor.substr(kHeadBytes);
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
  return bytes.size() > kHeadBytes && (bytes.size() - kHeadBytes) % PlaceViews::kViewBytes == 0 &&
         bytes.starts_with(head_of(config));
}

PlaceMatcher::PlaceMatcher(std::string_view descriptor) : views_(views_of(descriptor)) {}

double PlaceMatcher::likeness(std::string_view other) const { return double{views_.highest(views_of(other))}; }

}  // namespace tutti::lidar
