// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/worker_program.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <future>
#include <thread>
#include <utility>

#include "tutti/bus/delivery.hpp"
#include "tutti/bus/mission_lease.hpp"
#include "tutti/node/status_envelope.hpp"
#include "tutti/program/incarnation.hpp"
#include "tutti/program/stop.hpp"
#include "tutti/verifiers/parallel.hpp"

namespace tutti::program {
namespace {

constexpr auto kStillBusy = std::chrono::seconds(5);  // the bus gives a job to another after 30 s of silence
constexpr std::size_t kCacheBytes = std::size_t{512} << 20U;

/// Thrown through the verification of a job when the program is to end.
struct Stopped {};

}  // namespace

HostedWorker::HostedWorker(bus::Endpoint self, std::string version, const Make& make, std::size_t threads,
                           bus::Port& port, const std::atomic<bool>& stop)
    : self_(self),
      version_(std::move(version)),
      port_(port),
      stop_(stop),
      threads_(threads),
      node_(make([this](std::size_t count, const std::function<void(std::size_t)>& call) { for_each(count, call); })) {
  node_.set_clock([] { return static_cast<std::int64_t>(wall_clock_ns()); });
}

/// The port is this thread's: it reports that work goes on while others do it.
void HostedWorker::for_each(std::size_t count, const std::function<void(std::size_t)>& call) {
  auto done = std::async(std::launch::async, [&] {
    verifiers::for_each_parallel(count, threads_, [&](std::size_t i) {
      if (stop_) throw Stopped();
      call(i);
    });
  });
  while (done.wait_for(kStillBusy) != std::future_status::ready)
    if (job_) port_.still_busy(*job_);
  done.get();
}

template <class F>
Answer HostedWorker::carry_on(F&& step) {
  try {
    Answer answer{step(), {}};
    if (!job_ || node_.holds_job()) return answer;
    answer.done.push_back(*std::exchange(job_, std::nullopt));
    ++jobs_;
    return answer;
  } catch (const Stopped&) {
    return {};
  }
}

Answer HostedWorker::receive(const bus::Received& message, Timestamp now) {
  if (bus::delivery_of(message.envelope.kind) == bus::Delivery::work_queue) job_ = message.ticket;
  return carry_on([&] { return node_.receive(message.envelope, now); });
}

/// Called every few seconds while submaps are awaited.
Answer HostedWorker::work(Timestamp now) {
  if (job_) port_.still_busy(*job_);
  return carry_on([&] { return node_.on_timer(now); });
}

Answer HostedWorker::report(Timestamp /*now*/) {
  NodeStatus status{.name = node::default_name(self_), .version = version_, .jobs_done = jobs_, .can = node_.can()};
  return {{.messages = {node::to_server(self_, std::move(status))}}, {}};
}

Json HostedWorker::status(Timestamp /*now*/) const {
  return {{"program", "worker"}, {"jobs", jobs_}, {"waits", node_.holds_job()}};
}

Status run_worker(const WorkerOptions& options, const std::atomic<bool>& stop) {
  const VerifierSettings& settings = options.settings.verifiers;
  const auto verifier = settings.verifier();
  const auto log = EventLog::on_console("worker", options.console);
  const auto& known = options.bus.credentials.known;
  const bus::Endpoint self = bus::Endpoint::worker(known ? known->number : any_incarnation());
  bus::BusOptions where = options.bus;
  where.mission = options.settings.mission;
  auto mission = bus::served_mission(where, bus::kLookForServer_s);
  if (!mission) return tl::unexpected(mission.error());
  where.mission = std::move(*mission);
  const auto lease = bus::MissionLease::open(where, std::nullopt);
  if (!lease) return tl::unexpected(lease.error());
  std::string alone;
  const auto tell_alone = [&] {
    const std::string why = (*lease)->why_alone();
    if (why != alone && !why.empty()) log->say(Level::warning, why);
    alone = why;
  };
  const std::size_t threads = options.threads > 0 ? static_cast<std::size_t>(options.threads)
                                                  : std::max(1U, std::thread::hardware_concurrency());
  const auto cache = std::make_shared<node::FrameCache>(kCacheBytes);
  const auto make = [&](node::WorkerNode::ForEach for_each) {
    node::WorkerNode node(self, verifier, cache, std::move(for_each));
    node.refine_with(settings.refiner());
    node.make_others_with(std::make_shared<const verifiers::SensorVerifierMaker>(settings.closures.feature_cache_mb));
    return node;
  };
  const Clock clock;
  Host host({.store = nullptr,
             .open_port = [&] { return bus::open_port(self, where); },
             .open_node = [&](bus::Port& port) -> Result<std::unique_ptr<Hosted>> {
               return std::make_unique<HostedWorker>(self, options.version, make, threads, port, stop);
             },
             .each_second = tell_alone,
             .status_file = {}},
            clock, *log);
  if (Status opened = host.open(); !opened) return opened;
  log->say(Level::info, fmt::format("worker {} runs, mission {}, bus {}, {} threads", self.number, where.mission,
                                    bus::without_credentials(where.url), threads));
  notify_service_manager("READY=1");
  host.run(stop);
  notify_service_manager("STOPPING=1");
  return {};
}

}  // namespace tutti::program
