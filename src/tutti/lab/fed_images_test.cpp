// SPDX-License-Identifier: BSD-3-Clause
// A robot that is fed what its cameras, LiDAR, receiver and IMU saw makes the submaps that it makes of a recording of
// them.
#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "support/program/feed/client.hpp"
#include "support/program/hosting.hpp"
#include "tutti/drive/replay.hpp"
#include "tutti/formats/image_file.hpp"
#include "tutti/mission/resample.hpp"
#include "tutti/perception/visual/frontend/tracking_source.hpp"
#include "tutti/program/feed/feed_session.hpp"
#include "tutti/simulation/hall_recordings.hpp"
#include "tutti/simulation/receiver.hpp"
#include "tutti/storage/memory_store.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::lab {
namespace fed_images_test {

using namespace program;  // NOLINT: whose robot this is

robot::AgentConfig agent() {
  robot::AgentConfig out;
  out.submap.duration_s = 1.2;
  out.submap.visual.send_imu = true;
  return out;
}

simulation::HallMissionConfig hall(const std::string& sensors, int cameras, bool depth) {
  simulation::HallMissionConfig out;
  out.cameras = cameras;
  out.depth = depth;
  out.robots.resize(1);
  out.robots[0].name = "alpha";
  out.robots[0].sensors = sensors;
  out.robots[0].flight.duration_s = 2.7;
  return out;
}

using Submaps = std::vector<std::string>;
void keep_submaps(const std::vector<bus::Envelope>& sent, Submaps& out) {
  for (const bus::Envelope& envelope : sent)
    if (envelope.kind == bus::MessageKind::submap) out.push_back(*envelope.bytes);
}

/// Each image is drawn once.
simulation::FlownRecording simulate(const simulation::HallMissionConfig& config) {
  auto out = std::move(simulation::simulate_hall(config, Timestamp{0}, 1)->robots.at(0));
  out.images.load = [load = out.images.load,
                     known = std::make_shared<std::map<std::pair<std::size_t, std::size_t>, Image>>()](
                        std::size_t instant, std::size_t camera) -> Result<Image> {
    Image& image = (*known)[{instant, camera}];
    if (image.empty()) image = load(instant, camera).value();
    return image;
  };
  return out;
}

Submaps replayed(simulation::FlownRecording flown) {
  Recording recording = std::move(flown.recording);
  if (!flown.images.stamps.empty()) {
    Trajectory stamps;  // of images
    for (const Timestamp stamp : flown.images.stamps) stamps.push_back({stamp, {}});
    recording.visual = visual::TrackingSource::open(std::move(flown.images), stamps, {}).value();
  }
  const storage::MemoryStore store{storage::robot_schema()};
  const node::RobotNodeConfig config{.agent = drive::with_sensors(agent(), recording)};
  drive::Driver robot(node::RobotNode::open(recording.robot, 7, config, store).value());
  drive::Replay replay(recording, 0.0, robot);
  Submaps out;
  for (replay.resume({}); replay.next_time() < 1e9;) {
    replay.feed_next({});
    const node::Step step = robot.take_step();
    EXPECT_TRUE(taken(step));
    keep_submaps(step.messages, out);
  }
  EXPECT_TRUE(robot.sight().notes().empty());
  return out;
}

/// A robot with a feed, and its client.
class Fed {
 public:
  explicit Fed(const Sensors& sensors) {
    const auto open = [this] {
      return std::make_unique<drive::Driver>(
          std::move(node::RobotNode::open(RobotId{0}, 7, {.agent = agent()}, store_).value()));
    };
    front_ = std::make_unique<FeedFront>(RobotView("alpha").state(open()->node()), FeedFront::Limits{});
    session_ = std::make_unique<FeedSession>(*front_, FeedSettings{.max_queue_kb = 100'000});
    Host::Parts parts;
    parts.store = &store_;
    parts.open_port = [this]() -> Result<std::unique_ptr<bus::Port>> {
      return std::make_unique<test::SentPort>(&sent_);
    };
    parts.open_node = [this, open](bus::Port&) -> Result<std::unique_ptr<Hosted>> {
      return std::make_unique<test::Hosting>(open(), *front_, *host_, clock_);
    };
    host_ = std::make_unique<Host>(std::move(parts), clock_, *log_);
    EXPECT_TRUE(host_->open());
    session_->connect(0);
    send(test::hello(test::sensors(sensors)));
  }
  void send(const std::string& bytes) { session_->receive(0, bytes); }
  void work() {
    for (int i = 0; i < 2; ++i, wall_s_ += 0.02) {
      host_->turn();
      host_->wait(0.0);
    }
    session_->refresh();
    std::string bytes;
    for (std::string_view part; !(part = session_->output(0)).empty(); session_->sent(0, part.size())) bytes += part;
    for (const v1::Feed& message : test::messages(bytes)) {
      EXPECT_FALSE(message.has_closed()) << message.closed().why();
      if (message.has_refused()) refused_.push_back(message.refused().why());
    }
  }
  Submaps submaps() {
    for (int i = 0; i < 100; ++i) work();
    Submaps out;
    keep_submaps(sent_, out);
    return out;
  }
  [[nodiscard]] const std::vector<std::string>& refused() const { return refused_; }
  [[nodiscard]] FeedFront& front() { return *front_; }

 private:
  double wall_s_ = 0.0;
  Clock clock_{1.0, 0.0, [this] { return wall_s_; }};
  std::unique_ptr<EventLog> log_ = EventLog::on_console("test", Level::error);
  storage::MemoryStore store_{storage::robot_schema()};
  std::vector<bus::Envelope> sent_;
  std::unique_ptr<FeedFront> front_;
  std::unique_ptr<FeedSession> session_;
  std::unique_ptr<Host> host_;
  std::vector<std::string> refused_;
};

Sensors sensors_of(const simulation::FlownRecording& flown) {
  Sensors out{.scans = flown.recording.scans != nullptr, .cameras = flown.images.cameras, .depth = {}, .imu = {}};
  if (flown.images.load_depth) out.depth = flown.images.depth;
  if (!flown.recording.imu.empty()) out.imu = flown.recording.imu_noise;
  return out;
}

EncodedImages images_of(const ImageStream& stream, std::size_t instant, bool as_files) {
  EncodedImages out{stream.stamps[instant], {}, {}};
  for (std::uint32_t camera = 0; camera < stream.cameras.size(); ++camera) {
    const Image image = stream.load(instant, camera).value();
    out.images.push_back(
        {camera, !as_files, as_files ? formats::encode_png(image) : std::string(image.grey.begin(), image.grey.end())});
  }
  if (stream.load_depth) out.depth = EncodedImage{0, false, formats::encode_depth(stream.load_depth(instant).value())};
  return out;
}

/// Feeds the messages of a driver of a robot with these sensors, in the order in which they happen.
Submaps fed(const simulation::FlownRecording& flown, bool as_files) {
  const Recording& recording = flown.recording;
  Fed robot(sensors_of(flown));
  std::size_t imu = 0, scan = 0, images = 0, fix = 0;
  const auto fixes = measured<PositionFix>(recording);
  for (std::size_t i = 0; i < recording.odometry.size(); ++i) {
    const Timestamp now = recording.odometry[i].stamp;
    robot.send(
        test::odometry(recording.odometry[i], i == 0 ? Matrix6d::Zero() : recording.increment_covariance[i - 1]));
    std::vector<ImuSample> samples;
    while (imu < recording.imu.size() && (imu == 0 || recording.imu[imu - 1].stamp < now))
      samples.push_back(recording.imu[imu++]);
    if (!samples.empty()) robot.send(test::imu(samples));
    for (; fix < fixes.size() && fixes[fix].stamp <= now; ++fix) robot.send(test::fix(fixes[fix]));
    const auto scan_is_due = [&] {
      return stamp_at(recording, recording.scan_stamps, scan).value_or(kLastTimestamp) <= now;
    };
    for (; recording.scans && scan_is_due(); ++scan)
      if (const auto seen = *recording.scans->scan(scan)) robot.send(test::scan(*seen));
    for (; images < flown.images.stamps.size() && flown.images.stamps[images] <= now; ++images)
      if (flown.images.stamps[images] >= recording.odometry.front().stamp)
        robot.send(test::images(images_of(flown.images, images, as_files)));
    robot.work();
  }
  robot.send(test::end_of_recording());
  const Submaps out = robot.submaps();
  EXPECT_TRUE(robot.refused().empty()) << robot.refused().front();
  return out;
}

void expect_same(const simulation::FlownRecording& flown, bool as_files) {
  const Submaps there = replayed(flown), here = fed(flown, as_files);
  ASSERT_EQ(here.size(), there.size());
  EXPECT_GE(here.size(), 2U);
  for (std::size_t i = 0; i < here.size(); ++i) EXPECT_TRUE(here[i] == there[i]) << i;
}

TEST(FedImages, OfTwoCamerasAndAnImuMakeTheSubmapsOfTheRecording) {
  expect_same(simulate(hall("visual", 2, false)), false);
}

TEST(FedImages, WithDepthMakeTheSubmapsOfTheRecording) { expect_same(simulate(hall("visual", 1, true)), true); }

/// An IMU without a camera is heard, and nobody uses it.
TEST(FedImages, OfALidarAndAnImuMakeTheSubmapsOfTheRecording) {
  simulation::FlownRecording flown = simulate(hall("lidar", 1, false));
  for (std::int64_t i = 0; i < 700; ++i)
    flown.recording.imu.push_back({{i * 5000000}, {0.0, 0.0, 0.0}, {0.0, 0.0, 9.81}});
  expect_same(flown, false);
}

/// Twenty fixes a second, of which two are used.
TEST(FedImages, OfALidarAndAReceiverMakeTheSubmapsOfTheRecording) {
  simulation::FlownRecording flown = simulate(hall("lidar", 1, false));
  simulation::ReceiverConfig receiver;
  receiver.rate_hz = 20.0;
  receiver.antenna_m = {0.1, 0.0, 0.3};
  set_measured(flown.recording, simulation::simulate_fixes(flown.recording.reference, receiver, {}, Rng(1)));
  expect_same(flown, false);
  std::size_t fixes = 0;
  for (const std::string& bytes : fed(flown, false)) fixes += wire::decode_submap(bytes)->submap.fixes.size();
  EXPECT_GE(fixes, 5U);
  EXPECT_LE(fixes, 7U);
}

class SlowScans final : public ScanSource {
 public:
  SlowScans(std::shared_ptr<const ScanSource> all, std::size_t every) : all_(std::move(all)), every_(every) {}
  [[nodiscard]] Result<std::optional<Scan>> scan(std::size_t sample) const override {
    return sample % every_ == 0 ? all_->scan(sample) : std::optional<Scan>();
  }

 private:
  std::shared_ptr<const ScanSource> all_;
  std::size_t every_;
};

/// Images at 60 Hz, odometry at 25, an IMU at 200 and scans at 1 meet at no stamp.
TEST(FedImages, OfOtherRatesMakeTheSubmapsOfTheRecording) {
  simulation::HallMissionConfig config = hall("both", 1, false);
  config.robots[0].flight.rate_hz = 60.0;
  simulation::FlownRecording flown = simulate(config);
  flown.recording.scans = std::make_shared<SlowScans>(flown.recording.scans, 60);
  ASSERT_TRUE(mission::resample(flown.recording, 25.0, 0.013));
  ASSERT_FALSE(flown.recording.scan_stamps.empty());
  expect_same(flown, false);
}

}  // namespace fed_images_test
}  // namespace tutti::lab
