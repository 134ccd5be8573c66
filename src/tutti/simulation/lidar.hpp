// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include "tutti/base/config.hpp"
#include "tutti/base/random.hpp"
#include "tutti/base/result.hpp"
#include "tutti/base/rows.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/model/point_cloud.hpp"
#include "tutti/model/recording.hpp"
#include "tutti/model/trajectory.hpp"
#include "tutti/simulation/bounds.hpp"
#include "tutti/simulation/bvh.hpp"
#include "tutti/simulation/scan_pattern.hpp"

namespace tutti::simulation {

/// A multi-beam LiDAR whose axis is along the body's z.
struct LidarConfig {
  std::string pattern = "spinning";
  int beams = 16;
  double lowest_deg = -15.0;
  double highest_deg = 15.0;
  double rate_hz = 10.0;
  double azimuth_step_deg = 0.4;
  double points_per_s = 200'000.0;
  double min_range_m = 0.4;
  double max_range_m = 60.0;
  double range_sigma_m = 0.02;
  double dropout_share = 0.02;
  double grazing_cosine = 0.08;
  double mount_height_m = 0.25;
  template <class V>
  void describe(V& v) {
    v.field("pattern", pattern, one_of(names_of(scan_patterns())), help_of(scan_patterns()) + ".");
    v.field("beams", beams, between(1, 128), "Beams; of a spinning one evenly spaced from lowest_deg to highest_deg.");
    v.field("lowest_deg", lowest_deg, between(-90.0, 90.0), "Elevation of the lowest ray.");
    v.field("highest_deg", highest_deg, between(-90.0, 90.0), "Elevation of the highest ray.");
    v.field("rate_hz", rate_hz, between(0.5, 100.0), "Sweeps per second.");
    v.field("azimuth_step_deg", azimuth_step_deg, between(0.05, 30.0), "spinning: between two firings of all beams.");
    v.field("points_per_s", points_per_s, between(1.0, 1e7), "rosette: rays per second, of all beams.");
    v.field("min_range_m", min_range_m, between(0.0, 1e4), "Nothing is measured nearer than this.");
    v.field("max_range_m", max_range_m, above_zero_to(1e4), "Nothing is measured farther than this.");
    v.field("range_sigma_m", range_sigma_m, between(0.0, 1e4), "Noise of a range.");
    v.field("dropout_share", dropout_share, between(0.0, 1.0), "Share of the echoes lost.");
    v.field("grazing_cosine", grazing_cosine, between(0.0, 1.0),
            "Below this cosine of the angle of incidence, echoes are lost in proportion; at 0 all of them.");
    v.field("mount_height_m", mount_height_m, between(-kLargestRoom_m, kLargestRoom_m), "Sensor above the body frame.");
  }
  /// T_body_lidar
  [[nodiscard]] Pose3 pose() const { return {Eigen::Quaterniond::Identity(), {0.0, 0.0, mount_height_m}}; }
};

/// One sweep that begins 1 / rate_hz before `end`, of the configuration's pattern.
/// `truth` (T_reference_body, in the frame of `surface`) is interpolated at every firing; Scan::age_s tells its time.
/// Nothing when `truth` does not cover the sweep.
std::optional<Scan> simulate_sweep(const Bvh& surface, const Trajectory& truth, Timestamp end,
                                   const LidarConfig& config, Rng rng);

/// The scans of one robot, computed on demand: scan(k) is the sweep that ends at truth[k], and depends on nothing else.
class SimulatedLidar : public ScanSource {
 public:
  SimulatedLidar(std::shared_ptr<const Bvh> surface, Trajectory truth, LidarConfig config, Rng rng);
  [[nodiscard]] Result<std::optional<Scan>> scan(std::size_t sample) const override;

 private:
  std::shared_ptr<const Bvh> surface_;
  Trajectory truth_;
  LidarConfig config_;
  Rng rng_;
};

}  // namespace tutti::simulation
