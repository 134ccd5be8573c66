// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <iterator>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/base/config_io.hpp"
#include "tutti/lab/break_recording.hpp"
#include "tutti/lab/spoiled_closures.hpp"
#include "tutti/mission/mission_config.hpp"
#include "tutti/simulation/degrade.hpp"
#include "tutti/simulation/hall_recordings.hpp"
#include "tutti/simulation/ranging.hpp"
#include "tutti/simulation/receiver.hpp"
#include "tutti/simulation/recordings.hpp"
#include "tutti/simulation/reference_closures.hpp"

namespace tutti::mission {
struct MissionRecording;
}
namespace tutti::lab {

/// How recorded odometry is changed before it is replayed.
struct RobotChanges {
  bool random_frame = false;  ///< Any yaw, tilt and shift, drawn from the seed.
  simulation::DegradeConfig degrade;
  template <class V>
  void describe(V& v) {
    v.field("random_frame", random_frame, any(), "Draw the odometry frame from the seed.");
    v.field("degrade", degrade);
  }
};

struct MissionConfig;
/// A verifier whose closures are made of the mission's recordings, not of what sensors saw.
struct LabVerifier {
  std::string_view name;
  std::string_view help;
  std::string_view needs;                          ///< The setting that every replayed robot must have,
  bool (*has)(const mission::RobotConfig& robot);  ///< and whether this one has it.
  std::shared_ptr<const server::ClosureVerifier> (*make)(const MissionConfig& config,
                                                         const std::vector<mission::MissionRecording>& recordings,
                                                         std::uint64_t seed);
};
const std::vector<LabVerifier>& lab_verifiers();

/// Closures that come with the mission, and ways to make found closures wrong.
struct ClosureChanges {
  std::string verifier = mission::MissionConfig().closures.verifier;
  simulation::ReferenceClosureConfig reference;
  double wrong_share = 0.0;
  std::vector<PlantedClosureConfig> planted;
  template <class V>
  void describe(V& v) {
    v.field("verifier", verifier, formerly(verifiers::VerifierConfig::kFormerName, one_of(all_verifiers())),
            help_of(verifiers::verifier_kinds()) + "; " + help_of(lab_verifiers()) + ".");
    v.field("reference", reference);
    v.field("wrong_share", wrong_share, between(0.0, 0.9),
            "Share of the closures found that are made wrong on purpose.");
    v.field("planted", planted, any(), "reference: wrong closures at given places and times.");
  }
  /// The chosen row of lab_verifiers(); null: sensors' closures are found.
  [[nodiscard]] const LabVerifier* lab_verifier() const { return row_of(lab_verifiers(), verifier); }
  [[nodiscard]] bool come_with_mission() const { return lab_verifier() != nullptr; }

 private:
  static std::vector<std::string> all_verifiers() {
    std::vector<std::string> names = names_of(verifiers::verifier_kinds());
    std::ranges::move(names_of(lab_verifiers()), std::back_inserter(names));
    return names;
  }
};

/// A mission file: robots with recordings, or a simulation, and what the laboratory does to either.
struct MissionConfig : mission::MissionConfig {
  std::string source = "recordings";  ///< "recordings" (of `robots`), "simulation" or "hall"
  simulation::SimulationConfig simulation;
  simulation::HallMissionConfig hall;
  std::vector<RobotChanges> robot_changes;  ///< For `robots`, by position; those beyond its end are not changed.
  ClosureChanges closure_changes;           ///< If these are not made up, `closures` says how closures are found.
  std::vector<simulation::ReceiverConfig> receivers;
  simulation::RangingConfig ranging;
  std::vector<MistakeConfig> mistakes;
  std::vector<std::string> compare_policies;  ///< In addition to the one that the robots follow.

  /// Describes the fields that are not in mission::MissionConfig.
  template <class V>
  void describe(V& v) {
    v.field("source", source, one_of({"recordings", "simulation", "hall"}),
            "Replay `robots`, or simulate: walks through a network of corridors, or flights with cameras in a hall.");
    v.field("simulation", simulation);
    v.field("hall", hall);
    v.field("robots", robot_changes, any(), "The robots whose recordings are replayed.");
    v.field("closures", closure_changes);
    v.field("receivers", receivers, any(), "Simulated receivers of robots whose true poses are known.");
    v.field("ranging", ranging);
    v.field("mistakes", mistakes, any(),
            "Robots that are set up wrongly, or whose odometry fails, to see what is said.");
    v.field("compare_policies", compare_policies, any(),
            "Further policies, run beside the robots' own on the same broadcasts.");
  }
};

/// Reads a mission from a document; `name` is the document's. Checks single fields only.
Result<MissionConfig> read_mission(const ConfigNode& root, const std::string& name);
/// Loads a mission file, applies --set assignments, and checks what concerns several fields (unique names, files
/// given). "demo" is the built-in mission, unless a file is called so.
Result<MissionConfig> load_mission(const std::filesystem::path& file, const std::vector<std::string>& assignments);
/// The same for a mission's text; `name` is used in errors.
Result<MissionConfig> parse_mission(const std::string& text, const std::string& name,
                                    const std::vector<std::string>& assignments);
/// The sensors in `tutti demo`: two robots with LiDAR in a tunnel (missions/demo.yaml); three with cameras in a hall
/// (hall.yaml); or three in the hall with a LiDAR, a camera and both (hall_mixed.yaml).
enum class DemoSensors { lidar, visual, both };
/// The built-in mission of `tutti demo`, which needs no files.
Result<MissionConfig> demo_mission(const std::vector<std::string>& assignments,
                                   DemoSensors sensors = DemoSensors::lidar);

/// The text of a mission file with every setting in it.
std::string to_yaml(const MissionConfig& config);
/// The documentation of every setting of a mission file.
struct MissionDocs {
  std::vector<config_internal::FieldDoc> product;     ///< For recordings and live robots, too.
  std::vector<config_internal::FieldDoc> laboratory;  ///< To simulate robots, and to spoil what is recorded or found.
};
MissionDocs document_mission();

}  // namespace tutti::lab
