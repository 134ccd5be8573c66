// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "tutti/base/plain_text.hpp"

/// Limits of what the decoders accept, checked before memory is allocated.
namespace tutti::wire {

inline constexpr std::size_t kMaxMessageBytes = 16U << 20U;  ///< The protobuf message, before compression.
inline constexpr std::size_t kMaxStateBytes = 256U << 20U;   ///< An agent's state, which only its robot reads.
inline constexpr std::size_t kMaxKeyframes = 10'000;         ///< Per submap.
inline constexpr std::size_t kMaxCloudPoints = 1'000'000;
inline constexpr std::size_t kMaxFixes = 1'000;   ///< Per submap.
inline constexpr std::size_t kMaxRanges = 1'000;  ///< Per submap.
inline constexpr std::size_t kMaxCameras = 8;
inline constexpr std::size_t kMaxImageSide_px = 65'535;
inline constexpr std::size_t kMaxImages = 20'000;  ///< This and the next four: per submap.
inline constexpr std::size_t kMaxObservations = 200'000;
inline constexpr std::size_t kMaxLandmarks = 50'000;
inline constexpr std::size_t kMaxDescriptorWords = 8;
inline constexpr std::size_t kMaxDescriptorBytes = 4U << 20U;
inline constexpr std::size_t kMaxProxyNodes = 200'000;  ///< And as many eliminated nodes.
inline constexpr std::size_t kMaxProxyEdges = 1'000'000;
inline constexpr std::size_t kMaxRefinedSubmaps = 10'000;    ///< This and the next: per refinement.
inline constexpr std::size_t kMaxRefinedKeyframes = 40'000;  ///< As many as one message has room for.
inline constexpr std::size_t kMaxReasonBytes = kPlainTextBytes;
inline constexpr std::size_t kMaxNameBytes = 64;       ///< A robot's or a worker's.
inline constexpr std::size_t kMaxIntervals = 100'000;  ///< Per receipt.

inline constexpr double kMaxCloudRange_m = 1500.0;  ///< From a submap's origin to a point, per axis.
inline constexpr double kMaxLandmarkRange_m = 10'000.0;
inline constexpr double kMaxSigma_px = 1'000.0;
inline constexpr double kMaxVariance = 1e20;

}  // namespace tutti::wire
