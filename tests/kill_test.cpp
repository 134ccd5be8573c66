// SPDX-License-Identifier: BSD-3-Clause
// Kill -9 in process: server, robots and workers of a small mission are dropped at random instants, also between the
// parts of a step (commit, send, tell, acknowledge), and made again from the bytes of their stores; what was not
// acknowledged comes again. The map is the undisturbed one, bit for bit, and so are the robots' corrected trajectories.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "support/sanitized.hpp"
#include "support/server/refiners.hpp"
#include "tutti/bus/simulated_network.hpp"
#include "tutti/evaluation/agreement.hpp"
#include "tutti/lab/closure_verifiers.hpp"
#include "tutti/node/robot_node.hpp"
#include "tutti/node/server_node.hpp"
#include "tutti/node/worker_node.hpp"
#include "tutti/simulation/recordings.hpp"
#include "tutti/storage/memory_store.hpp"

namespace tutti {
namespace kill_test {

using bus::Endpoint;
using Role = Endpoint::Role;

constexpr std::uint64_t kEpoch = 1'700'000'000, kSession = 1'700'000'100;
constexpr double kUpdatePeriod_s = 20.0;

struct World {
  std::vector<mission::MissionRecording> recordings;
  std::set<RobotId> robots;
  std::shared_ptr<const server::ClosureVerifier> verifier;
};

World make_world() {
  World out;
  simulation::SimulationConfig config;
  config.world.network = {.rows = 2, .columns = 3, .block_m = 15.0, .jitter_m = 2.0, .missing_share = 0.0};
  for (simulation::SimulatedRobotConfig& robot : config.robots) {
    robot.walk.duration_s = 150.0;
    robot.odometry.yaw_deg_per_sqrt_m = 1.0;
  }
  auto world = simulation::simulate_recordings(config, Timestamp{0}, 11);
  EXPECT_TRUE(world.has_value());
  for (Recording& recording : world->recordings) {
    out.robots.insert(recording.robot);
    out.recordings.push_back({.recording = std::move(recording)});
  }
  lab::MissionConfig mission;
  mission.closure_changes.verifier = "reference";
  mission.closure_changes.reference.wrong_share = 0.2;
  mission.closure_changes.reference.min_time_gap_s = 20.0;
  out.verifier = lab::make_closure_verifier(mission, out.recordings, 5);
  return out;
}

/// The front end of each robot begins anew at its origin at half of the mission.
World begun_anew(World world) {
  for (auto& recording : world.recordings) {
    Trajectory& odometry = recording.recording.odometry;
    const std::size_t half = odometry.size() / 2;
    const Pose3 anew = odometry.front().pose * odometry[half].pose.inverse();
    for (std::size_t i = half; i < odometry.size(); ++i) odometry[i].pose = anew * odometry[i].pose;
  }
  return world;
}

/// Before which part of a step a node is dropped, or after all.
enum class Part { commit, send, half_sent, tell, acknowledge, end };
constexpr std::size_t kParts = 6;
/// Which node, at which input.
using Instant = std::tuple<Role, std::string, Part>;

/// Which of the instants of each kind end a node.
struct Killer {
  std::map<Instant, std::set<std::size_t>> plan;
  std::map<Instant, std::size_t> seen;
  std::map<Instant, std::size_t> killed;
  bool strikes(Instant instant) {
    const bool now = plan[instant].contains(seen[instant]++);
    if (now) ++killed[instant];
    return now;
  }
};

/// Stands for a program of its own: a node, its port, and its store, which outlives both.
template <class Node>
struct Program {
  Endpoint self;
  storage::MemoryStore::Tables saved;  ///< Its disk while nobody runs.
  std::unique_ptr<storage::MemoryStore> store;
  std::unique_ptr<bus::Port> port;
  std::unique_ptr<Node> node;
};

class Mission {
 public:
  /// `refiner`: null for a map that is its pose graph's. `unchanged_every_s`: the server's setting. A server that
  /// starts again sends at once what it keeps back, so robots get other maps meanwhile than without a kill.
  Mission(const World& world, const bus::LinkConfig& link, Killer& killer,
          std::shared_ptr<const server::MapRefiner> refiner = nullptr, double unchanged_every_s = 0.0)
      : world_(world),
        refiner_(std::move(refiner)),
        unchanged_every_s_(unchanged_every_s),
        network_(bus::SimulatedRadio(Timestamp{}, link, 1), Timestamp{}),
        killer_(killer) {
    server_.self = Endpoint::server();
    start(server_);
    for (const auto& recording : world.recordings) {
      robots_.push_back({});
      robots_.back().self = Endpoint::of(recording.recording.robot);
    }
    next_.resize(robots_.size(), 0);
    for (auto& robot : robots_) start(robot);
    for (std::size_t i = 0; i < workers_.size(); ++i) {
      workers_[i].self = Endpoint::worker(static_cast<std::uint32_t>(i));
      start(workers_[i]);
    }
  }

  void run() {
    while (true) {
      std::optional<Timestamp> next = network_.next_delivery();
      const auto consider = [&](std::optional<Timestamp> t) {
        if (t && (!next || *t < *next)) next = t;
      };
      bool ended = true;
      for (std::size_t r = 0; r < robots_.size(); ++r) {
        const Trajectory& odometry = world_.recordings[r].recording.odometry;
        if (next_[r] < odometry.size()) consider(odometry[next_[r]].stamp);
        ended = ended && next_[r] >= odometry.size();
      }
      consider(server_.node->next_timer());
      for (const auto& robot : robots_) consider(robot.node->next_timer());
      if (!next) break;
      now_ = std::max(now_, *next);
      pump();
      for (std::size_t r = 0; r < robots_.size(); ++r) feed(r);
      for (auto& robot : robots_)
        if (robot.node->next_timer() && *robot.node->next_timer() <= now_)
          static_cast<void>(carry_out(robot, "timer", robot.node->on_timer(now_)));
      pump();
      if (server_.node->next_timer() && *server_.node->next_timer() <= now_) {
        static_cast<void>(carry_out(server_, "timer", server_.node->on_timer(now_)));
        pump();
      }
    }
  }

  /// As a program does: a server that starts again takes what has come before it computes the map that was there.
  void compute_later() { computes_at_once_ = false; }
  /// From now on, and how many of how many; such a job is done for the bus, and nobody has answered it.
  void lose_jobs(double share) { lost_share_ = share; }
  [[nodiscard]] std::pair<std::size_t, std::size_t> lost_jobs() const { return {lost_, jobs_}; }

  [[nodiscard]] const server::MapServer& server() const { return server_.node->map_server(); }
  [[nodiscard]] const robot::RobotAgent& agent(std::size_t r) const { return robots_[r].node->agent(); }
  [[nodiscard]] std::size_t robots() const { return robots_.size(); }
  [[nodiscard]] int jumps() const { return jumps_; }  ///< Odometry's, as they were reported.
  [[nodiscard]] const std::vector<std::string>& refusals() const { return refusals_; }
  /// Nothing is kept back anywhere.
  void expect_settled() const {
    for (const auto& robot : robots_) EXPECT_TRUE(robot.node->backlog().empty());
    for (const auto& robot : robots_) EXPECT_TRUE(robot.port->receive().empty());
    EXPECT_TRUE(server_.port->receive().empty());
  }

 private:
  std::unique_ptr<node::ServerNode> open(Program<node::ServerNode>& program) {
    program.store = std::make_unique<storage::MemoryStore>(storage::map_schema(), std::move(program.saved));
    node::ServerNodeConfig config{.pairs_per_job = 3, .job_timeout_s = 30.0};
    config.server.update_least_s = kUpdatePeriod_s;
    config.server.unchanged_every_s = unchanged_every_s_;
    config.refiner = refiner_;
    return std::move(node::ServerNode::open(world_.robots, world_.verifier, config, kEpoch, *program.store).value());
  }
  std::unique_ptr<node::RobotNode> open(Program<node::RobotNode>& program) {
    program.store = std::make_unique<storage::MemoryStore>(storage::robot_schema(), std::move(program.saved));
    auto node = node::RobotNode::open(*program.self.robot(), kSession, {}, *program.store);
    EXPECT_TRUE(node.has_value()) << node.error().message;
    return std::move(*node);
  }
  std::unique_ptr<node::WorkerNode> open(Program<node::WorkerNode>& program) {
    const auto submaps = std::make_shared<node::SubmapFrames>(
        [this](SubmapId id) { return Result<std::string>(**server_.store->read("submaps", node::key_of(id))); });
    auto node = std::make_unique<node::WorkerNode>(program.self, world_.verifier, submaps);
    node->refine_with(refiner_);
    return node;
  }

  /// From the bytes of its store; also when it is dropped in its very first step.
  template <class Node>
  void start(Program<Node>& program) {
    program.port = network_.connect(program.self);
    program.node = open(program);
    if constexpr (!std::is_same_v<Node, node::WorkerNode>)
      static_cast<void>(carry_out(program, "start", program.node->resume(now_)));
    if constexpr (std::is_same_v<Node, node::ServerNode>) compute();
  }
  /// The map of before goes out again before anything new comes: robots hear what they would have heard.
  void compute() {
    const auto is_due = [&] { return server_.node->next_timer() && *server_.node->next_timer() <= now_; };
    while (computes_at_once_ && !server_.node->has_map() && !server_.node->map_server().has_news() && is_due())
      static_cast<void>(carry_out(server_, "timer", server_.node->on_timer(now_)));
  }

  /// False when the node was dropped meanwhile; it runs again then.
  template <class Node>
  bool carry_out(Program<Node>& program, const std::string& input, const node::Step& step,
                 std::optional<std::uint64_t> ticket = {}) {
    const auto dies = [&](Part part) { return killer_.strikes({program.self.role, input, part}); };
    const auto dropped = [&] {
      program.node.reset();
      program.port.reset();
      if (program.store) program.saved = program.store->tables();
      program.store.reset();
      start(program);
      if constexpr (std::is_same_v<Node, node::RobotNode>)
        feed_again(static_cast<std::size_t>(&program - robots_.data()));
      return false;
    };
    if (dies(Part::commit)) return dropped();
    if (program.store) {
      EXPECT_TRUE(program.store->commit(step.writes).has_value());
    }
    if (dies(Part::send)) return dropped();
    for (std::size_t i = 0; i < step.messages.size(); ++i) {
      if (i == 1 && dies(Part::half_sent)) return dropped();
      EXPECT_TRUE(program.port->send(step.messages[i]).has_value());
    }
    if (dies(Part::tell)) return dropped();
    for (const node::Event& event : step.events) jumps_ += std::holds_alternative<node::OdometryJumped>(event.what);
    for (const node::Event& event : step.events)
      if (const auto* refused = std::get_if<node::MessageRefused>(&event.what))
        // Who was killed hears answers to what it had asked before; they count no more.
        if (refused->why.find("none of this server's since it started") == std::string::npos)
          refusals_.push_back(refused->why);
    if (dies(Part::acknowledge)) return dropped();
    if (ticket) program.port->acknowledge(*ticket);
    if (dies(Part::end)) return dropped();
    return true;
  }

  /// Everything that is there to be received at this instant, and what that makes others send.
  void pump() {
    for (bool moved = true; moved;) {
      network_.advance(now_);
      moved = hear(server_);
      for (auto& worker : workers_) moved = hear(worker) || moved;
      for (auto& robot : robots_) moved = hear(robot) || moved;
    }
  }
  template <class Node>
  bool hear(Program<Node>& program) {
    const auto received = program.port->receive();
    for (const bus::Received& message : received) {
      const bus::MessageKind kind =
          message.envelope.kind;  // in full or not is up to a server that has no base at first
      const bool is_graph = kind == bus::MessageKind::proxy_graph_delta;
      if (kind == bus::MessageKind::job && ++jobs_ > 0 && luck_.bernoulli(lost_share_)) {
        ++lost_;
        program.port->acknowledge(message.ticket);
        continue;
      }
      if (!carry_out(program, wire::name(is_graph ? bus::MessageKind::proxy_graph : kind),
                     program.node->receive(message.envelope, now_), message.ticket))
        break;  // the rest comes again
    }
    return !received.empty();
  }

  /// All samples by now.
  void feed(std::size_t r) {
    const Trajectory& odometry = world_.recordings[r].recording.odometry;
    while (next_[r] < odometry.size() && odometry[next_[r]].stamp <= now_) feed_until(r, next_[r] + 1);
  }
  /// Feeds what the robot had taken and not stored, before it hears anything.
  void feed_again(std::size_t r) {
    const Trajectory& odometry = world_.recordings[r].recording.odometry;
    const auto newest = robots_[r].node->agent().newest_sample();
    const std::size_t until = next_[r];
    for (next_[r] = 0; newest && next_[r] < until && odometry[next_[r]].stamp < *newest;) ++next_[r];
    feed_until(r, until);
  }
  /// When it is dropped meanwhile, it is fed again up to next_ before this goes on.
  void feed_until(std::size_t r, std::size_t until) {
    while (next_[r] < until)
      if (feed_sample(r, next_[r])) ++next_[r];
  }
  /// Feeds what belongs to a sample that it may know already. False: it was dropped.
  bool feed_sample(std::size_t r, std::size_t i) {
    Program<node::RobotNode>& robot = robots_[r];
    const Recording& recording = world_.recordings[r].recording;
    const StampedPose& at = recording.odometry[i];
    const Matrix6d covariance = i == 0 ? Matrix6d(Matrix6d::Zero()) : recording.increment_covariance[i - 1];
    const auto take = [&](const char* input, const node::Step& step) {
      return carry_out(robot, step.messages.empty() ? input : "end of a submap", step);
    };
    if (robot.node->agent().newest_sample() != at.stamp &&
        !take("sample", robot.node->add(OdometrySample{at.stamp, at.pose, covariance}, now_)))
      return false;
    if (robot.node->agent().wants_scan() && !take("scan", robot.node->add(scan(r, at.stamp), now_))) return false;
    return i + 1 < recording.odometry.size() || take("sample", robot.node->finish(now_));
  }

  static Scan scan(std::size_t r, Timestamp stamp) {
    Rng rng = Rng(r).fork(static_cast<std::uint64_t>(stamp.ns));
    PointCloud cloud;
    for (int i = 0; i < 30; ++i) cloud.points.emplace_back(rng.normal(10.0), rng.normal(10.0), rng.normal(2.0));
    return {stamp, std::make_shared<const PointCloud>(std::move(cloud)), {}};
  }

  const World& world_;
  const std::shared_ptr<const server::MapRefiner> refiner_;
  double unchanged_every_s_;
  bus::SimulatedNetwork network_;
  Killer& killer_;
  Timestamp now_;
  Program<node::ServerNode> server_;
  std::vector<Program<node::RobotNode>> robots_;
  std::array<Program<node::WorkerNode>, 2> workers_;
  std::vector<std::size_t> next_;  // of each robot: sample to be fed
  std::vector<std::string> refusals_;
  int jumps_ = 0;
  Rng luck_{3};
  double lost_share_ = 0.0;
  bool computes_at_once_ = true;
  std::size_t lost_ = 0, jobs_ = 0;
};

void expect_same_map(const server::MapServer& a, const server::MapServer& b) {
  ASSERT_EQ(a.map().nodes.size(), b.map().nodes.size());
  for (std::size_t i = 0; i < a.map().nodes.size(); ++i) {
    ASSERT_EQ(a.map().nodes[i].id, b.map().nodes[i].id);
    ASSERT_EQ(a.map().nodes[i].T_world_body, b.map().nodes[i].T_world_body) << "node " << i;
  }
  ASSERT_EQ(a.map().closures.size(), b.map().closures.size());
  for (std::size_t i = 0; i < a.map().closures.size(); ++i) {
    ASSERT_EQ(a.map().closures[i].closure, b.map().closures[i].closure);
    ASSERT_EQ(a.map().closures[i].accepted, b.map().closures[i].accepted);
  }
  EXPECT_EQ(a.state().verdicts, b.state().verdicts);
  EXPECT_EQ(a.state().payload_sizes, b.state().payload_sizes);
  ASSERT_EQ(a.refusals().size(), b.refusals().size());
  for (const auto& [reason, count] : a.refusals()) {
    EXPECT_EQ(b.refusals().at(reason).intra, count.intra);
    EXPECT_EQ(b.refusals().at(reason).inter, count.inter);
  }
  for (const auto& [id, size] : a.state().payload_sizes)
    ASSERT_EQ((*a.payloads().cloud(id))->points, (*b.payloads().cloud(id))->points);
}

class Kill : public testing::Test {
 protected:
  /// Some instants of every kind, among as many as an undisturbed mission has.
  static Killer planned(const Killer& undisturbed, Rng rng, std::size_t of_each) {
    Killer killer;
    for (const auto& [instant, count] : undisturbed.seen)
      for (std::size_t i = 0; i < of_each; ++i) killer.plan[instant].insert(rng.index(count));
    return killer;
  }
  static std::size_t count(const Killer& killer) {
    std::size_t all = 0;
    for (const auto& [instant, kills] : killer.killed) all += kills;
    return all;
  }

  const World world_ = make_world();
};

TEST_F(Kill, TwoHundredKillsLeaveTheSameMapAndTheSameTrajectories) {
  const bus::LinkConfig at_once{.latency_s = 0.0};
  const auto refiner = std::make_shared<const server::test::Shrinker>();
  Killer nobody;
  Mission undisturbed(world_, at_once, nobody, refiner);
  undisturbed.run();
  undisturbed.expect_settled();
  ASSERT_GT(undisturbed.server().state().revision, 5U);
  ASSERT_GT(undisturbed.agent(0).ledger().size() + undisturbed.agent(1).ledger().size(), 0U);
  ASSERT_GT(undisturbed.server().state().verdicts.size(), 5U);
  ASSERT_FALSE(undisturbed.server().state().refinements.all().empty());
  ASSERT_GE(nobody.seen.size(), 11 * (kParts - 1));  // kinds of inputs, of all nodes

  std::map<Instant, std::size_t> killed;
  std::size_t kills = 0;
  for (std::uint64_t seed = 0; seed < tutti::seeds(4U); ++seed) {
    Killer killer = planned(nobody, Rng(seed), 1);
    Mission mission(world_, at_once, killer, refiner);
    mission.run();
    mission.expect_settled();
    EXPECT_TRUE(mission.refusals().empty()) << mission.refusals().front();
    expect_same_map(undisturbed.server(), mission.server());
    EXPECT_EQ(mission.server().state().revision, undisturbed.server().state().revision);
    for (std::size_t r = 0; r < mission.robots(); ++r) {
      EXPECT_EQ(mission.agent(r).corrected(), undisturbed.agent(r).corrected()) << "robot " << r << ", seed " << seed;
      EXPECT_EQ(mission.agent(r).ledger(), undisturbed.agent(r).ledger());
      EXPECT_EQ(mission.agent(r).T_map_body(), undisturbed.agent(r).T_map_body());
    }
    for (const auto& [instant, n] : killer.killed) killed[instant] += n;
    kills += count(killer);
  }
  RecordProperty("kills", static_cast<int>(kills));
  EXPECT_GE(kills, tutti::seeds(4U) * 50);
  EXPECT_EQ(killed.size(), nobody.seen.size());  // every node, at every input, before every part of a step
}

// Meanwhile robots get other maps than without kills: they end in the same place, by another history.
TEST_F(Kill, WhereMapsWaitTrajectoriesEndTheSame) {
  TUTTI_SAME_CODE();
  const bus::LinkConfig at_once{.latency_s = 0.0};
  const auto refiner = std::make_shared<const server::test::Shrinker>();
  Killer nobody;
  Mission undisturbed(world_, at_once, nobody, refiner, 20.0);
  undisturbed.run();
  Killer killer = planned(nobody, Rng(100), 1);
  Mission mission(world_, at_once, killer, refiner, 20.0);
  mission.run();
  mission.expect_settled();
  EXPECT_GT(count(killer), 50U);
  expect_same_map(undisturbed.server(), mission.server());
  for (std::size_t r = 0; r < mission.robots(); ++r) {
    const Trajectory mine = mission.agent(r).corrected(), other = undisturbed.agent(r).corrected();
    ASSERT_EQ(mine.size(), other.size());
    for (std::size_t k = 0; k < mine.size(); ++k)
      ASSERT_LT(local(mine[k].pose, other[k].pose).norm(), 1e-4) << "robot " << r << ", keyframe " << k;
  }
}

// A jump of the front end is reported, the joint map is as good as without (closures decide where the robots are), and
// so are the robots' own; whoever is killed meanwhile.
TEST_F(Kill, FrontEndsThatBeginAnewCostNoMap) {
  const World anew = begun_anew(world_);
  const bus::LinkConfig at_once{.latency_s = 0.0};
  Killer nobody;
  Mission smooth(world_, at_once, nobody);
  smooth.run();
  EXPECT_EQ(smooth.jumps(), 0);
  nobody = {};
  Mission undisturbed(anew, at_once, nobody);
  undisturbed.run();
  undisturbed.expect_settled();
  EXPECT_EQ(undisturbed.jumps(), 2);
  EXPECT_EQ(undisturbed.server().map().components, smooth.server().map().components);
  const auto robot_rmse_m = [&](const Mission& mission, std::size_t r) {
    return evaluation::agreement(mission.agent(r).corrected(), world_.recordings[r].recording.reference)->rmse_m;
  };
  const auto map_rmse_m = [&](const Mission& mission, std::size_t r) {
    Trajectory map;
    for (const MapNode& node : mission.server().map().nodes)
      if (node.id.chain.robot == mission.agent(r).robot() && (map.empty() || map.back().stamp < node.stamp))
        map.push_back({node.stamp, node.T_world_body});
    return evaluation::agreement(map, world_.recordings[r].recording.reference)->rmse_m;
  };
  for (std::size_t r = 0; r < smooth.robots(); ++r) {
    EXPECT_LT(map_rmse_m(undisturbed, r), 1.2 * map_rmse_m(smooth, r) + 0.02) << "robot " << r;
    EXPECT_LT(robot_rmse_m(undisturbed, r), 1.2 * robot_rmse_m(smooth, r) + 0.02) << "robot " << r;
  }
  for (std::uint64_t seed = 200; seed < 200 + tutti::seeds(2U); ++seed) {
    Killer killer = planned(nobody, Rng(seed), 1);
    Mission mission(anew, at_once, killer);
    mission.run();
    mission.expect_settled();
    EXPECT_GT(count(killer), 20U);
    EXPECT_GE(mission.jumps(), 1);  // one that is killed before it has reported a step never does
    expect_same_map(undisturbed.server(), mission.server());
    for (std::size_t r = 0; r < mission.robots(); ++r) {
      EXPECT_EQ(mission.agent(r).corrected(), undisturbed.agent(r).corrected()) << "robot " << r << ", seed " << seed;
      EXPECT_EQ(mission.agent(r).T_odom_fed(), undisturbed.agent(r).T_odom_fed());
    }
  }
}

TEST_F(Kill, OnABadRadioTooTheMapIsTheSame) {
  TUTTI_SAME_CODE();
  const bus::LinkConfig bad{
      .latency_s = 0.3, .jitter_s = 8.0, .loss = 0.2, .duplicate = 0.2, .outages = {{40.0, 70.0}, {100.0, 110.0}}};
  Killer nobody;
  Mission undisturbed(world_, bus::LinkConfig{.latency_s = 0.0}, nobody);
  undisturbed.run();
  for (std::uint64_t seed = 100; seed < 100 + tutti::seeds(3U); ++seed) {
    Killer killer = planned(nobody, Rng(seed), 1);
    Mission mission(world_, bad, killer);
    mission.compute_later();
    mission.run();
    mission.expect_settled();
    EXPECT_GT(count(killer), 20U);
    EXPECT_TRUE(mission.refusals().empty()) << mission.refusals().front();
    expect_same_map(undisturbed.server(), mission.server());
  }
}

TEST_F(Kill, JobsThatTheBusGivesUpAreAskedAgain) {
  const bus::LinkConfig at_once{.latency_s = 0.0};
  Killer nobody;
  Mission undisturbed(world_, at_once, nobody);
  undisturbed.run();
  Killer killer = planned(nobody, Rng(7), 1);
  Mission mission(world_, at_once, killer);
  mission.lose_jobs(0.5);
  mission.run();
  mission.expect_settled();
  const auto [lost, jobs] = mission.lost_jobs();
  EXPECT_GT(lost, 10U);
  EXPECT_LT(lost, jobs);
  expect_same_map(undisturbed.server(), mission.server());
}

}  // namespace kill_test
}  // namespace tutti
