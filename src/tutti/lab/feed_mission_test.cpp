// SPDX-License-Identifier: BSD-3-Clause
// Robots of a simulated mission are fed through their live feeds, and what the feeds send is compared with the truth.
#include <gtest/gtest.h>

#include <deque>
#include <map>
#include <set>

#include "support/program/feed/client.hpp"
#include "support/program/feed/node_target.hpp"
#include "support/sanitized.hpp"
#include "tutti/geometry/symmetric.hpp"
#include "tutti/lab/closure_verifiers.hpp"
#include "tutti/node/server_node.hpp"
#include "tutti/node/worker_node.hpp"
#include "tutti/program/feed/feed_session.hpp"
#include "tutti/simulation/recordings.hpp"

namespace tutti::program {  // whose feeds these are
namespace feed_mission_test {

constexpr double kMission_s = 240.0;

struct Fed {
  explicit Fed(RobotId robot, const FeedSettings& settings) : target(robot), session(target, settings) {
    session.connect(0);
    session.receive(0, test::hello());
    static_cast<void>(hear());
  }
  std::vector<v1::Feed> hear() {
    std::string bytes;
    for (std::string_view part; !(part = session.output(0)).empty(); session.sent(0, part.size())) bytes += part;
    return test::messages(bytes);
  }
  test::NodeTarget target;
  FeedSession session;
  std::size_t next = 0;
};

/// The corrections of a mission, against the truth.
struct Tally {
  std::size_t samples = 0, corrected = 0, jumps = 0, outside = 0, met = 0;
  double nees = 0.0, corrected_nees = 0.0;
};

class Mission {
 public:
  explicit Mission(std::uint64_t seed) {
    simulation::SimulationConfig config;
    config.world.network = {.rows = 2, .columns = 3, .block_m = 15.0, .jitter_m = 2.0, .missing_share = 0.0};
    for (simulation::SimulatedRobotConfig& robot : config.robots) {
      robot.walk.duration_s = kMission_s;
      robot.odometry.yaw_deg_per_sqrt_m = 0.6;
    }
    auto world = simulation::simulate_recordings(config, Timestamp{0}, seed);
    EXPECT_TRUE(world.has_value());
    std::set<RobotId> robots;
    for (Recording& recording : world->recordings) {
      robots.insert(recording.robot);
      recordings_.push_back({.recording = std::move(recording)});
      fed_.emplace_back(recordings_.back().recording.robot, settings_);
    }
    lab::MissionConfig mission;
    mission.closure_changes.verifier = "reference";
    mission.closure_changes.reference.wrong_share = 0.0;
    verifier_ = lab::make_closure_verifier(mission, recordings_, 5);
    node::ServerNodeConfig of_server;
    of_server.server.update_least_s = 20.0;
    server_ = std::move(node::ServerNode::open(robots, verifier_, of_server, 1, map_).value());
    const auto submaps = std::make_shared<node::SubmapFrames>(
        [this](SubmapId id) { return Result<std::string>(**map_.read("submaps", node::key_of(id))); });
    worker_ = std::make_unique<node::WorkerNode>(bus::Endpoint::worker(0), verifier_, submaps);
    carry_out(server_->resume({}));
  }

  Tally run() {
    const Trajectory& clock = recordings_[0].recording.odometry;  // all robots walk at one rate from one time on
    for (std::size_t i = 0; i < clock.size(); ++i) {
      const Timestamp now = clock[i].stamp;
      for (std::size_t r = 0; r < fed_.size(); ++r) feed(r, now);
      if (server_->next_timer() && *server_->next_timer() <= now) carry_out(server_->on_timer(now));
    }
    return tally_;
  }

 private:
  void feed(std::size_t r, Timestamp now) {
    const Recording& recording = recordings_[r].recording;
    Fed& fed = fed_[r];
    for (; fed.next < recording.odometry.size() && recording.odometry[fed.next].stamp <= now; ++fed.next) {
      const std::size_t i = fed.next;
      const Matrix6d covariance = i == 0 ? Matrix6d(Matrix6d::Zero()) : recording.increment_covariance[i - 1];
      const Pose3 before = fed.session.has_feeder() ? shown_[r] : Pose3{};
      fed.session.receive(0, test::odometry(recording.odometry[i], covariance));
      bool announced = false;
      for (const v1::Feed& message : fed.hear()) {
        ASSERT_FALSE(message.has_refused()) << message.refused().why();
        announced = announced || message.has_jump();
        if (message.has_correction()) note(r, i, message.correction(), before, announced);
        tally_.jumps += message.has_jump() ? 1 : 0;
        if (message.has_situation()) tally_.met += message.situation().team_mate_size() > 0 ? 1 : 0;
      }
    }
    for (const bus::Envelope& message : fed.target.take_sent()) carry_out(server_->receive(message, now));
  }

  void note(std::size_t r, std::size_t i, const v1::Feed::Correction& correction, const Pose3& before, bool announced) {
    const Recording& recording = recordings_[r].recording;
    const Pose3& T_odom_body = recording.odometry[i].pose;
    const Pose3 T_map_body = test::read(correction.t_map_body()), T_map_odom = test::read(correction.t_map_odom());
    ASSERT_LT(local(T_map_body, T_map_odom * T_odom_body).norm(), 1e-9);
    if (i > 0 && !announced) {
      const double dt_s = recording.odometry[i].stamp - recording.odometry[i - 1].stamp;
      ASSERT_LE(local(before * T_odom_body, T_map_body).head<3>().norm(), settings_.blend_m_per_s * dt_s + 1e-9);
    }
    shown_[r] = T_map_odom;
    if (i == 0) return;
    Matrix6d covariance;
    for (int k = 0; k < 36; ++k) covariance(k / 6, k % 6) = correction.t_map_odom_covariance(k);
    const Matrix6d back = adjoint(T_odom_body.inverse());
    const Matrix6d of_body = back * covariance * back.transpose();
    // `map` begins where `odom` does.
    const Pose3 T_map_reference = recording.odometry[0].pose * recording.reference[0].pose.inverse();
    const Vector6d error = local(T_map_body, T_map_reference * recording.reference[i].pose);
    const double squared = squared_distance(error, of_body);
    ++tally_.samples;
    tally_.nees += squared / 6.0;
    tally_.outside += squared > 16.8 ? 1 : 0;  // 99 % of chi-square with 6 degrees of freedom
    if (fed_[r].target.node().agent().ledger().size() == 0) return;
    ++tally_.corrected;
    tally_.corrected_nees += squared / 6.0;
  }

  void carry_out(const node::Step& first) {
    std::deque<node::Step> steps{first};
    for (; !steps.empty(); steps.pop_front()) {
      ASSERT_TRUE(map_.commit(steps.front().writes).has_value());
      for (const bus::Envelope& message : steps.front().messages) {
        if (message.to.role == bus::Endpoint::Role::server) steps.push_back(server_->receive(message, {}));
        if (message.to.role == bus::Endpoint::Role::worker) steps.push_back(worker_->receive(message, {}));
        for (std::size_t r = 0; r < fed_.size(); ++r)
          if (message.to == bus::Endpoint::of(recordings_[r].recording.robot)) fed_[r].target.receive(message);
      }
    }
  }

  FeedSettings settings_;
  std::vector<mission::MissionRecording> recordings_;
  std::deque<Fed> fed_;
  std::map<std::size_t, Pose3> shown_;  ///< T_map_odom by robot.
  std::shared_ptr<const server::ClosureVerifier> verifier_;
  storage::MemoryStore map_{storage::map_schema()};
  std::unique_ptr<node::ServerNode> server_;
  std::unique_ptr<node::WorkerNode> worker_;
  Tally tally_;
};

TEST(FeedMission, TheTruthLiesWithinWhatTheFeedSays) {
  Tally all;
  const std::size_t missions = tutti::seeds(3U);
  for (std::uint64_t seed = 1; seed <= missions; ++seed) {
    const Tally one = Mission(seed).run();
    all.samples += one.samples;
    all.corrected += one.corrected;
    all.nees += one.nees;
    all.corrected_nees += one.corrected_nees;
    all.outside += one.outside;
    all.jumps += one.jumps;
    all.met += one.met;
  }
  const auto samples = static_cast<double>(all.samples), corrected = static_cast<double>(all.corrected);
  EXPECT_GT(corrected, 0.3 * samples);
  EXPECT_GT(all.met, missions);
  EXPECT_GT(all.nees / samples, 0.15);
  EXPECT_LT(all.nees / samples, 1.2);
  EXPECT_GT(all.corrected_nees / corrected, 0.15);
  EXPECT_LT(all.corrected_nees / corrected, 1.2);
  EXPECT_LT(static_cast<double>(all.outside), 0.02 * samples);
}

}  // namespace feed_mission_test
}  // namespace tutti::program
