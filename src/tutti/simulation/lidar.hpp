// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

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
  std::string pattern = "spinning";  ///< A name of scan_patterns().
  int beams = 16;                    ///< A spinning one has them evenly spaced from lowest_deg to highest_deg.
  double lowest_deg = -15.0;         ///< Elevation of the lowest ray,
  double highest_deg = 15.0;         ///< and of the highest.
  double rate_hz = 10.0;             ///< Sweeps per second.
  double azimuth_step_deg = 0.4;     ///< spinning: between two firings of all beams.
  double points_per_s = 200'000.0;   ///< rosette: rays, of all beams.
  double min_range_m = 0.4;          ///< Nothing is measured nearer
  double max_range_m = 60.0;         ///< or farther than this.
  double range_sigma_m = 0.02;
  double dropout_share = 0.02;   ///< Share of the echoes lost.
  double grazing_cosine = 0.08;  ///< Below this cosine of the angle of incidence, echoes are lost in proportion.
  double mount_height_m = 0.25;  ///< Sensor above the body frame.
  double sector_deg = 360.0;     ///< It sees nothing outside of an angle as wide as this about the vertical,
  double facing_deg = 0.0;       ///< whose middle is so far to the left of ahead.

  /// T_body_lidar
  [[nodiscard]] Pose3 pose() const { return {Eigen::Quaterniond::Identity(), {0.0, 0.0, mount_height_m}}; }
};

/// A LiDAR that can be chosen.
struct LidarModel {
  std::string_view name, help;
  LidarConfig config;
};
const std::vector<LidarModel>& lidar_models();

/// Which LiDAR robots carry.
struct LidarChoice {
  std::string model = "16-beam";
  double rays_share = 1.0;
  double range_sigma_m = LidarConfig{}.range_sigma_m;
  double mount_height_m = LidarConfig{}.mount_height_m;
  template <class V>
  void describe(V& v) {
    v.field("model", model, one_of(names_of(lidar_models())), help_of(lidar_models()) + ".");
    v.field("rays_share", rays_share, between(0.01, 4.0),
            "Rays per sweep over the model's: fewer take less time and see less.");
    v.field("range_sigma_m", range_sigma_m, between(0.0, 1e4), "Noise of a range.");
    v.field("mount_height_m", mount_height_m, between(-kLargestRoom_m, kLargestRoom_m), "Sensor above the body frame.");
  }
  [[nodiscard]] LidarConfig config() const;
};

/// One sweep that begins 1 / rate_hz before `end`, of the configuration's pattern.
/// `truth` (T_reference_body, in the frame of `surface`) is interpolated at every firing; Scan::age_s has its time.
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
