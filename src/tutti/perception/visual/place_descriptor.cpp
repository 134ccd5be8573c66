// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/place_descriptor.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <functional>
#include <vector>

#include "tutti/base/check.hpp"
#include "tutti/perception/visual/descriptor_tables.hpp"
#include "tutti/perception/visual/hamming.hpp"

namespace tutti::visual {
namespace {

constexpr std::size_t kMostLandmarks = 512;
constexpr std::uint8_t kDescriptorVersion = 0x81;  // raised with every change of the bytes; a LiDAR place's are smaller
constexpr std::size_t kHeadBytes = 3;              // version, kind, words
constexpr std::size_t kMostWords = 8;
/// Largest Hamming distance, as a share of the bits: farther ones are matches where a place is known, and chance where
/// it is not.
constexpr double kAlike = 0.16;

/// A landmark with descriptors: rows of its first view that has one and of the last, between which its appearance
/// changes most.
struct SeenLandmark {
  std::uint32_t first_row = kNoIndex, last_row = kNoIndex;
  std::uint32_t keyframes = 0, newest = kNoIndex;  ///< How many saw it, and the last of them.
};

std::vector<SeenLandmark> landmarks_of(const VisualPayload& payload) {
  std::vector<SeenLandmark> out(payload.landmarks.size());
  for (const VisualFrame& frame : payload.frames)
    for (const Observation& o : frame.observations) {
      if (o.landmark == kNoIndex) continue;
      SeenLandmark& landmark = out[o.landmark];
      if (landmark.first_row == kNoIndex) landmark.first_row = o.descriptor;
      if (o.descriptor != kNoIndex) landmark.last_row = o.descriptor;
      if (landmark.newest != frame.keyframe) ++landmark.keyframes;
      landmark.newest = frame.keyframe;
    }
  std::erase_if(out, [](const SeenLandmark& landmark) { return landmark.first_row == kNoIndex; });
  return out;
}

Descriptors read_rows(std::string_view bytes) {
  TUTTI_CHECK(is_descriptor(bytes), "{} bytes, which are no place's", bytes.size());
  Descriptors out{.kind = static_cast<DescriptorKind>(bytes[1]), .words = static_cast<std::uint8_t>(bytes[2])};
  out.bits.resize((bytes.size() - kHeadBytes) / sizeof(std::uint64_t));
  std::memcpy(out.bits.data(), bytes.data() + kHeadBytes, out.bits.size() * sizeof(std::uint64_t));
  return out;
}

}  // namespace

std::string describe_place(const Submap& submap, const VisualClosureConfig& config) {
  if (submap.visual == nullptr) return {};
  const Descriptors& rows = submap.visual->descriptors;
  std::vector<SeenLandmark> landmarks = landmarks_of(*submap.visual);
  if (landmarks.size() < static_cast<std::size_t>(config.min_landmarks) || rows.words > kMostWords) return {};
  std::ranges::stable_sort(landmarks, std::greater(), &SeenLandmark::keyframes);
  landmarks.resize(std::min(landmarks.size(), kMostLandmarks));
  std::string out{static_cast<char>(kDescriptorVersion), static_cast<char>(rows.kind), static_cast<char>(rows.words)};
  const auto append = [&](std::uint32_t row) {
    const auto words = rows.row(row);
    out.append(reinterpret_cast<const char*>(words.data()), words.size_bytes());
  };
  for (const SeenLandmark& landmark : landmarks) {
    append(landmark.first_row);
    if (landmark.last_row != landmark.first_row) append(landmark.last_row);
  }
  return out;
}

bool is_descriptor(std::string_view bytes) {
  if (bytes.size() <= kHeadBytes || static_cast<std::uint8_t>(bytes[0]) != kDescriptorVersion) return false;
  const auto words = static_cast<std::uint8_t>(bytes[2]);
  const std::size_t rows = words == 0 ? 0 : (bytes.size() - kHeadBytes) / (words * sizeof(std::uint64_t));
  return rows > 0 && rows <= 2 * kMostLandmarks && words <= kMostWords &&
         bytes.size() == kHeadBytes + rows * words * sizeof(std::uint64_t);
}

struct PlaceMatcher::Place {
  Place(std::string_view bytes, double max_hamming)
      : rows(read_rows(bytes)), tables(table_keys(rows)), most(distance_of_share(max_hamming, rows)) {}
  Descriptors rows;
  DescriptorTables tables;
  std::uint32_t most;  ///< Bits in which near ones differ.
};

PlaceMatcher::PlaceMatcher(std::string_view descriptor, const VisualClosureConfig& config)
    : place_(std::make_unique<Place>(descriptor, std::min(config.max_hamming, kAlike))) {}
PlaceMatcher::~PlaceMatcher() = default;

double PlaceMatcher::likeness(std::string_view other) const {
  const Descriptors& own = place_->rows;
  const Descriptors rows = read_rows(other);
  if (rows.kind != own.kind || rows.words != own.words) return 0.0;
  const std::vector<TableKeys> keys = table_keys(rows);
  std::vector<bool> marked(own.size(), false);
  std::ptrdiff_t near = 0;
  for (std::size_t i = 0; i < rows.size(); ++i)
    near += place_->tables.mark_near(rows.row(i), keys[i], own, place_->most, marked) ? 1 : 0;
  near += std::ranges::count(marked, true);
  return static_cast<double>(near);
}

}  // namespace tutti::visual
