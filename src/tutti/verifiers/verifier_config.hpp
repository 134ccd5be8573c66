// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/rows.hpp"
#include "tutti/perception/lidar/closure_config.hpp"
#include "tutti/perception/visual/closure_config.hpp"

namespace tutti::server {
class ClosureVerifier;
}
namespace tutti::verifiers {

struct VerifierConfig;

/// A loop-closure verifier that can be chosen.
struct VerifierKind {
  std::string_view name;
  std::string_view help;
  std::uint32_t version = 0;  ///< Raised with every change of what it computes.
  bool uses_scans = false;    ///< A pair of submaps can be compared when both carry this,
  bool uses_images = false;   ///< or this.
  /// All fields of VerifierConfig that its verdicts depend on, beside its name: these and no others are in its id, so
  /// that another verifier's settings do not change it.
  std::vector<std::string_view> settings;
  /// Its id does not cover its settings yet.
  std::shared_ptr<const server::ClosureVerifier> (*make)(const VerifierConfig& config) = nullptr;
};
const std::vector<VerifierKind>& verifier_kinds();

/// The loop-closure verifier that a mission with sensor data uses, and its settings.
struct VerifierConfig {
  static constexpr const char* kFormerName = "finder";  ///< The setting `verifier` in the version before.
  std::string verifier = "lidar";
  /// Submaps of one robot with a smaller difference of indices are not compared; neighbours overlap anyway.
  int min_submap_gap = 2;
  double feature_cache_mb = 1000.0;  ///< For lidar about 2,400 submaps of 5,000 points.
  lidar::LidarClosureConfig lidar;
  visual::VisualClosureConfig visual;
  /// The chosen row of verifier_kinds().
  [[nodiscard]] const VerifierKind& kind() const;
  template <class V>
  void describe(V& v) {
    v.field("verifier", verifier, formerly(kFormerName, one_of(names_of(verifier_kinds()))),
            help_of(verifier_kinds()) + ".");
    describe_sensors(v);
  }

 protected:
  /// Describes all settings but `verifier`.
  template <class V>
  void describe_sensors(V& v) {
    v.field("min_submap_gap", min_submap_gap, at_least(1.0),
            "lidar, visual: submaps of one robot nearer than this are not compared.");
    v.field(
        "feature_cache_mb", feature_cache_mb, between(16.0, 1e6),
        "lidar: memory for what was computed of the newest submaps, about 0.4 MB each; where it is full, every pair "
        "with an older one takes tens of milliseconds instead of less than one.");
    v.field("lidar", lidar);
    v.field("visual", visual);
  }
};

}  // namespace tutti::verifiers
