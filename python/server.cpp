// SPDX-License-Identifier: BSD-3-Clause
#include "embedded.hpp"
#include "map_values.hpp"
#include "tutti/server/map_server.hpp"
#include "tutti/verifiers/sensor_verifier_maker.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::python {
namespace {

using server::MapServer;
using server::VerificationJob;

/// A submap as verifiers see it.
struct SeenSubmap {
  std::shared_ptr<const Submap> submap;
  std::shared_ptr<const PointCloud> cloud;  ///< Null where it was not asked for, or there is none.
};

/// A closure found by a verifier that is written in Python.
struct FoundClosure {
  std::uint32_t from_index = 0, to_index = 0;
  RelativePose measurement;
};

/// A verifier written in Python: is_candidate(first, second) and verify(first, second).
class PythonVerifier final : public server::ClosureVerifier {
 public:
  explicit PythonVerifier(py::object verifier) : verifier_(std::move(verifier)) {}
  ~PythonVerifier() override {
    const py::gil_scoped_acquire acquire;
    verifier_ = py::object();
  }
  PythonVerifier(const PythonVerifier&) = delete;
  PythonVerifier& operator=(const PythonVerifier&) = delete;
  [[nodiscard]] MethodId id() const override { return {"python", 1, 0}; }
  [[nodiscard]] bool can_compare(const PayloadSize&, const PayloadSize&) const override { return true; }
  [[nodiscard]] bool is_candidate(const Submap& first, const Submap& second) const override {
    const py::gil_scoped_acquire acquire;
    return py::bool_(verifier_.attr("is_candidate")(see(first, nullptr), see(second, nullptr)));
  }
  [[nodiscard]] Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                              const server::PayloadStore& payloads) const override {
    auto cloud_a = payloads.cloud(first.id), cloud_b = payloads.cloud(second.id);  // an error: it came without one
    ClosureVerdict verdict{.pair = {first.id, second.id}, .closures = {}, .refusal = {}, .verifier = id()};
    const py::gil_scoped_acquire acquire;
    const py::object found =
        verifier_.attr("verify")(see(first, cloud_a.value_or(nullptr)), see(second, cloud_b.value_or(nullptr)));
    if (!found.is_none())
      for (const py::handle& one : found) {
        const auto closure = one.cast<FoundClosure>();
        verdict.closures.push_back(
            {{first.id.chain, closure.from_index}, {second.id.chain, closure.to_index}, closure.measurement});
      }
    if (verdict.closures.empty()) verdict.refusal = Refusal{RefusalReason::other};
    return verdict;
  }

 private:
  static SeenSubmap see(const Submap& submap, std::shared_ptr<const PointCloud> cloud) {
    return {std::make_shared<const Submap>(without_payloads(submap)), std::move(cloud)};
  }
  py::object verifier_;
};

struct Server {
  std::shared_ptr<const server::ClosureVerifier> verifier;
  std::shared_ptr<server::MemoryPayloadStore> payloads;
  Shared<MapServer> server;
};

std::shared_ptr<const server::ClosureVerifier> make_verifier(const py::object& verifier, const py::dict& settings) {
  if (!py::isinstance<py::str>(verifier)) {
    for (const char* name : {"is_candidate", "verify"})
      if (!py::hasattr(verifier, name))
        refuse("verifier: has no {}(first, second), expected 'lidar' or an object that has", name);
    return std::make_shared<const PythonVerifier>(verifier);
  }
  if (const std::string name = py::str(verifier); name != "lidar")
    refuse("verifier: is '{}', expected 'lidar' or an object with is_candidate() and verify()", name);
  verifiers::VerifierConfig config;
  set(config, settings);
  return verifiers::make_verifier(config);
}

std::unique_ptr<Server> make_server(const std::vector<std::uint32_t>& robots, const py::object& verifier,
                                    const py::dict& settings, const py::dict& verifier_settings, std::uint64_t epoch) {
  server::ServerConfig config;
  set(config, settings);
  std::set<RobotId> ids;
  for (const std::uint32_t robot : robots) ids.insert({robot});
  auto found_by = make_verifier(verifier, verifier_settings);
  auto payloads = std::make_shared<server::MemoryPayloadStore>();
  return std::unique_ptr<Server>(
      new Server{found_by, payloads, Shared<MapServer>(ids, found_by, payloads, config, epoch)});
}

void receive_message(Server& server, const py::bytes& message) {
  const std::string bytes = message;
  constexpr std::size_t kKind = 4;  // wire/frame.hpp
  const bool is_verdict = bytes.size() > kKind && bytes[kKind] == static_cast<char>(wire::MessageKind::verdict);
  check(server.server.call([&](MapServer& s) {
    return is_verdict ? s.receive(value_of(wire::decode_verdict(bytes)))
                      : s.receive(value_of(wire::decode_submap(bytes)));
  }));
}

py::bytes verify(const Server& server, const VerificationJob& job) {
  std::string out;
  {
    const py::gil_scoped_release release;
    const ClosureVerdict verdict = value_of(server.verifier->verify(*job.first, *job.second, *server.payloads));
    check(wire::validate(verdict));
    out = wire::encode(verdict);
  }
  return out;
}

FoundClosure make_closure(std::uint32_t from_index, std::uint32_t to_index, const ArrayLike& T_from_to,
                          const ArrayLike& covariance) {
  return {from_index, to_index, {to_pose(T_from_to, "T_from_to"), to_matrix6(covariance, "covariance")}};
}

void bind_submap(py::module_& m) {
  py::class_<SeenSubmap>(m, "Submap", "What one robot saw in about 10 s, as verifiers of closures are shown it.")
      .def_property_readonly(
          "robot", [](const SeenSubmap& s) { return s.submap->id.chain.robot.value; }, "Number of its robot,")
      .def_property_readonly(
          "session", [](const SeenSubmap& s) { return s.submap->id.chain.session; }, "that robot's session,")
      .def_property_readonly(
          "index", [](const SeenSubmap& s) { return s.submap->id.index; }, "and which one it is of it.")
      .def_property_readonly(
          "keyframes",
          [](const SeenSubmap& s) {
            Trajectory out;
            for (const Keyframe& keyframe : s.submap->keyframes) out.push_back({keyframe.stamp, keyframe.T_odom_body});
            return out;
          },
          "T_odom_body of its keyframes. The submap's frame is the first one's body.")
      .def_property_readonly(
          "first_index", [](const SeenSubmap& s) { return s.submap->keyframes.front().index; },
          "Number of its first keyframe; the others follow.")
      .def_property_readonly(
          "points",
          [](const SeenSubmap& s) -> std::optional<py::array_t<float>> {
            return s.cloud ? std::optional(from_cloud(*s.cloud)) : std::nullopt;
          },
          "(n, 3) float32, metres in the submap's frame; None where it has none, and in is_candidate().")
      .def("__repr__", [](const SeenSubmap& s) { return fmt::format("<tutti.Submap {}>", to_string(s.submap->id)); });
  py::class_<FoundClosure>(m, "Closure", "A loop closure, as a verifier written in Python returns it.")
      .def(
          py::init(&make_closure), "from_index"_a, "to_index"_a, "T_from_to"_a, "covariance"_a,
          R"(Between keyframe from_index of the first submap and to_index of the second: T_from_to (4, 4), and the covariance (6, 6) of
its right perturbation [translation m; rotation rad].)");
  py::class_<VerificationJob>(m, "Job",
                              "A pair of submaps to be verified; MapServer.verify() answers it, in any thread.")
      .def_property_readonly(
          "first",
          [](const VerificationJob& j) {
            return SeenSubmap{j.first, nullptr};
          },
          "The first Submap, without points,")
      .def_property_readonly(
          "second",
          [](const VerificationJob& j) {
            return SeenSubmap{j.second, nullptr};
          },
          "and the second.");
}

}  // namespace

void bind_server(py::module_& m) {
  bind_submap(m);
  py::class_<Server>(m, "MapServer",
                     R"(The mapping server: submaps in; joins, closes loops, optimises; messages for the robots out.

No sockets, clocks or threads inside: how messages travel, and when it optimises, is yours. Several threads may share it.)")
      .def(
          py::init(&make_server), "robots"_a, "verifier"_a = "lidar", "settings"_a = py::dict(),
          "verifier_settings"_a = py::dict(), "epoch"_a = 1,
          R"(robots: their numbers. verifier: who finds closures, 'lidar' from the submaps' clouds, or an object of yours with
is_candidate(first, second), cheap, and verify(first, second), which returns Closures or None, of two Submaps, as a function of
these alone. settings: {"unchanged_every_s": 0}, those of `tutti settings --of server` below server; verifier_settings:
{"min_submap_gap": 3}, those below closures. epoch: larger than at any start before. ValueError: a setting.)")
      .def(
          "receive", &receive_message, "message"_a,
          R"(A message with a submap, of a robot's take_outgoing(), or with a verdict, of verify(). In any order, any number of times.

ValueError: it is refused, and the map is as it was.)")
      .def(
          "take_jobs", [](Server& s) { return s.server.call([](MapServer& x) { return x.take_jobs(); }); },
          "Pairs to be verified, each handed out once.")
      .def(
          "give_back",
          [](Server& s, const VerificationJob& job) { s.server.call([&](MapServer& x) { x.give_back(job); }); },
          "job"_a, "A job that could not be answered: take_jobs() hands it out again.")
      .def("verify", &verify, "job"_a, "Whether the two submaps show one place: bytes for receive(). Changes nothing.")
      .def(
          "has_news", [](Server& s) { return s.server.call([](const MapServer& x) { return x.has_news(); }); },
          "Something came since the last optimise().")
      .def(
          "optimise",
          [](Server& s) { return py::bytes(s.server.call([](MapServer& x) { return wire::encode(x.optimise()); })); },
          "Optimises the joint map: bytes for every robot's receive().")
      .def(
          "trajectories",
          [](Server& s) {
            std::map<std::uint32_t, Trajectory> out;
            for (auto& [chain, trajectory] : s.server.call([](const MapServer& x) { return trajectories_of(x.map()); }))
              out[chain.robot.value] = std::move(trajectory);  // of a robot's newest session
            return out;
          },
          "{robot: T_world_body at the keyframes of its newest session}, as of the last optimise().")
      .def(
          "graph", [](Server& s) { return s.server.call([](const MapServer& x) { return graph_of(x.map()); }); },
          "The joint pose graph: odometry and accepted closures.")
      .def_property_readonly(
          "closures",
          [](Server& s) {
            return s.server.call([](const MapServer& x) {
              return std::ranges::count_if(x.map().closures, [](const auto& closure) { return closure.accepted; });
            });
          },
          "Accepted ones, as of the last optimise().")
      .def_property_readonly(
          "components", [](Server& s) { return s.server.call([](const MapServer& x) { return x.map().components; }); },
          "Parts that nothing ties together; each has a world frame of its own.");
}

}  // namespace tutti::python
