// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/server_program.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <thread>
#include <utility>

#include "tutti/base/file.hpp"
#include "tutti/base/freed_memory.hpp"
#include "tutti/base/own_file.hpp"
#include "tutti/base/utc_text.hpp"
#include "tutti/bus/mission_lease.hpp"
#include "tutti/bus/nats_child.hpp"
#include "tutti/mapfile/estimate_file.hpp"
#include "tutti/mapfile/hold_map.hpp"
#include "tutti/node/map_meta.hpp"
#include "tutti/node/server_node.hpp"
#include "tutti/program/bus_guard.hpp"
#include "tutti/program/host.hpp"
#include "tutti/program/hosted_server.hpp"
#include "tutti/program/incarnation.hpp"
#include "tutti/program/link_watch.hpp"
#include "tutti/program/state_folder.hpp"
#include "tutti/program/stop.hpp"
#include "tutti/program/worker_program.hpp"
#include "tutti/storage/sqlite_store.hpp"

namespace tutti::program {
namespace {

/// The server's own worker: on a thread of its own, over a port of its own, with the map's file at hand.
class OwnWorker {
 public:
  OwnWorker(const bus::BusOptions& where, std::shared_ptr<const server::ClosureVerifier> verifier,
            std::shared_ptr<const server::MapRefiner> refiner, const storage::TableStore& map,
            const std::string& version, std::size_t threads, const Clock& clock, EventLog& log)
      : host_({.store = nullptr,
               .open_port = [where] { return bus::open_port(kSelf, where); },
               .open_node = [this, verifier, refiner, version, threads,
                             &map](bus::Port& port) -> Result<std::unique_ptr<Hosted>> {
                 const auto make = [&](node::WorkerNode::ForEach for_each) {
                   node::WorkerNode node(kSelf, verifier, node::SubmapFrames::of(map), std::move(for_each));
                   node.refine_with(refiner);
                   node.rest_for(0.0);
                   return node;
                 };
                 return std::make_unique<HostedWorker>(kSelf, version, make, threads, port, stop_);
               },
               .each_second = [this] { check_whether_in_vain(); },
               .status_file = {}},
              clock, log),
        clock_(clock),
        log_(log) {}
  ~OwnWorker() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
  }
  OwnWorker(const OwnWorker&) = delete;
  OwnWorker& operator=(const OwnWorker&) = delete;
  Status start() {
    if (Status opened = host_.open(); !opened) return opened;
    thread_ = std::thread([this] { host_.run(stop_); });
    return {};
  }
  /// Whether the bus gives jobs to workers and gets no answers. Called once a second.
  void note_given_in_vain(bool is_in_vain) { is_in_vain_ = is_in_vain; }

 private:
  /// This thread is not at a job when this is called.
  void check_whether_in_vain() {
    const auto* worker = dynamic_cast<const HostedWorker*>(host_.hosted());
    if (worker == nullptr || !anew_.connects_anew(is_in_vain_, worker->holds_job(), clock_.wall_s())) return;
    log_.say(Level::error, "jobs are given to workers in vain, and its own one has none: connects that one anew");
    host_.start_anew();
  }

  static constexpr bus::Endpoint kSelf{bus::Endpoint::Role::worker, 0};
  std::atomic<bool> stop_ = false;
  std::atomic<bool> is_in_vain_ = false;
  AnewWatch anew_;
  Host host_;
  const Clock& clock_;
  EventLog& log_;
  std::thread thread_;
};

Result<bus::HostPort> address_of(const std::string& listen) {
  auto address = bus::parse_host_port(listen.empty() ? "127.0.0.1" : listen);
  if (!address) return in_context("--listen", address.error());
  return address;
}

Result<std::unique_ptr<bus::NatsChild>> start_bus(const ServerOptions& options, const bus::HostPort& address,
                                                  const std::optional<BusGuard>& guard,
                                                  const std::filesystem::path& folder) {
  bus::NatsChildOptions child{.host = address.host, .port = address.port, .allow_insecure = options.bus.allow_insecure};
  if (guard) child.rights = guard->rights();
  if (guard) child.credentials = guard->credentials();
  return bus::NatsChild::start(folder, child);
}

Status check_addresses(const ServerOptions& options, const bus::HostPort& address) {
  if (!options.bus.url.empty() && !options.listen.empty())
    return fail(ErrorCode::configuration, "--bus and --listen: either a bus that runs, or one of its own");
  if (!options.bus.url.empty() && !options.pki.empty())
    return fail(ErrorCode::configuration,
                "--bus and --pki: a bus that runs has its own rights; --credentials says who this server is there");
  if (options.bus.allow_insecure || !options.pki.empty() || bus::is_loopback(address.host)) return {};
  return fail(ErrorCode::configuration,
              "--listen {}: anybody who reaches this address could write to the map: needs --pki DIR (tutti pki init); "
              "--insecure forces it",
              options.listen);
}

constexpr double kLeaseAnswer_s = 5.0;  // of a bus that is there
constexpr bus::LeaseTimes kLease;

std::string first_line(const char* file) {
  const std::string text = read_file(file).value_or("");
  return text.substr(0, text.find('\n'));
}

/// The lease of this state folder: a restart on this machine has the same seat, a copy elsewhere another one; a copy
/// under the same path in another container of this machine has the seat, but never the mark.
bus::LeaseHolder holder_of(const StateFolder& folder) {
  std::error_code ignored;
  const auto path = std::filesystem::weakly_canonical(folder.path(), ignored);
  const std::string machine = first_line("/proc/sys/kernel/random/boot_id");
  return {.host = first_line("/proc/sys/kernel/hostname"),
          .process = static_cast<std::uint64_t>(getpid()),
          .state = path.string(),
          .since_ns = static_cast<std::int64_t>(wall_clock_ns()),
          .seat = fmt::format("{} {} {}", machine, folder.made_ns(), path.string()),
          .mark = bus::process_mark(any_incarnation())};
}

/// All that a running server has, in the order in which it is made.
class ServerProgram {
 public:
  explicit ServerProgram(const ServerOptions& options) : options_(options) {}
  Status start();
  Status run(const std::atomic<bool>& stop);

 private:
  Result<std::unique_ptr<Hosted>> open_node();
  node::MapOfTask make_map(node::MapTask task) const;
  Status take_lease();
  /// Whether another server has the mission.
  Status check_lease(const bus::MissionLease::State& seen) const;
  void tend();
  void tend_bus();
  Status admit_page();
  Status start_page();
  Status begin_with_held();
  [[nodiscard]] Status check_held() const;
  [[nodiscard]] std::string robot_command() const;
  [[nodiscard]] std::string trouble(const MissionStatus& status) const;

  const ServerOptions& options_;
  const ServerSettings& settings_ = options_.settings;
  std::optional<StateFolder> folder_;
  std::unique_ptr<EventLog> log_;
  std::optional<BusGuard> guard_;
  std::unique_ptr<bus::NatsChild> child_;
  bus::BusOptions bus_;
  std::shared_ptr<const bus::MissionLease> lease_;
  bool is_over_ = false;  // the lease is another's
  std::unique_ptr<storage::TableStore> store_;
  std::shared_ptr<const server::ClosureVerifier> verifier_;
  std::optional<Clock> clock_;
  std::optional<Host> host_;
  std::optional<OwnWorker> worker_;
  std::vector<std::unique_ptr<MapViewer>> viewers_;
  std::string page_credential_;  // the file
  std::unique_ptr<PageChild> page_;
  std::string trouble_;  // of the bus
};

Result<std::unique_ptr<Hosted>> ServerProgram::open_node() {
  node::ServerNodeConfig config{
      .server = settings_.server, .refiner = settings_.verifiers.refiner(), .accepts_others = settings_.accepts_others};
  config.incarnation = any_incarnation();
  config.names = settings_.robots;
  config.wall_ns = [] { return static_cast<std::int64_t>(wall_clock_ns()); };
  if (guard_)
    config.name_objection = [this](RobotId robot, const std::string& name) { return guard_->objection(robot, name); };
  config.job_timeout_s *= std::max(1.0, options_.rate);  // a bus waits in wall time
  std::set<RobotId> robots;
  for (std::uint32_t i = 0; i < settings_.robots.size(); ++i) robots.insert(RobotId{i});
  auto node = node::ServerNode::open(std::move(robots), verifier_, config, folder_->made_ns(), *store_);
  if (!node) return in_context((folder_->path() / kMapFile).string(), node.error());
  return std::make_unique<HostedServer>(
      std::move(*node), *store_, options_.version, [this](const MissionStatus& status) { return trouble(status); },
      is_over_, viewers_, *clock_, [this](node::MapTask task) { return make_map(std::move(task)); });
}

/// Writes what it has computed, for the page, on the thread that has computed it.
node::MapOfTask ServerProgram::make_map(node::MapTask task) const {
  node::MapOfTask out = node::make_map(std::move(task));
  const server::MadeMap& made = out.made;
  const std::string bytes = mapfile::encode_estimate({.epoch = made.job.epoch,
                                                      .revision = made.job.revision,
                                                      .time = out.pace.begun,
                                                      .map = made.map,
                                                      .broadcast = *out.broadcast.last()});
  if (const Status written = replace_file(folder_->path() / kEstimateFile, bytes, false); !written)
    log_->say(Level::warning, written.error().message);
  return out;
}

std::string ServerProgram::trouble(const MissionStatus& status) const {
  const std::string known = host_->all_trouble();
  const auto link = host_->link();
  return known.empty() && link ? untaken_trouble(*link, status) : known;
}

Status ServerProgram::check_lease(const bus::MissionLease::State& seen) const {
  const bus::LeaseHolder* other = seen.held ? nullptr : seen.server_of(bus_.mission);
  if (other == nullptr) return {};
  return fail(ErrorCode::io,
              "mission '{}' on bus {} has a server: {}. Stop that one (a killed one's place is free after {:g} s), or "
              "give this one another --mission NAME",
              bus_.mission, bus::without_credentials(bus_.url), to_string(*other), kLease.lease_s);
}

/// Before it the port does not connect.
Status ServerProgram::take_lease() {
  auto lease = bus::MissionLease::open(bus_, holder_of(*folder_));
  if (!lease) return tl::unexpected(lease.error());
  lease_ = std::move(*lease);
  bus_.may_connect = [lease = lease_] { return lease->check_held(); };
  bus::MissionLease::State seen = lease_->wait(kLeaseAnswer_s);
  if (!seen.waits.empty()) {
    log_->say(Level::warning, seen.waits);
    seen = lease_->wait(kLease.unrenewed_s + kLease.renew_s);
  }
  return check_lease(seen);
}

/// Once a second.
void ServerProgram::tend() {
  tend_bus();
  if (page_)
    if (const std::string said = page_->tend(clock_->wall_s()); !said.empty()) log_->say(Level::warning, said);
  is_over_ = !check_lease(lease_->state());
  if (const auto link = host_->link(); worker_) worker_->note_given_in_vain(link && link->given_in_vain > 0);
}

/// The bus may have ended, or its disk may be full.
void ServerProgram::tend_bus() {
  if (!child_) return;
  if (guard_) {
    for (const std::string& line : guard_->check(utc_text(static_cast<std::int64_t>(wall_clock_ns()))))
      log_->say(Level::warning, line);
    child_->set_rights(guard_->rights());
  }
  const Status runs = child_->tend();
  if (!runs && trouble_.empty()) log_->say(Level::error, "the bus does not run: " + runs.error().message);
  if (runs && !trouble_.empty()) log_->say(Level::info, "the bus runs again");
  trouble_ = runs ? "" : "the bus does not run: " + runs.error().message;
  if (!guard_) return;
  for (const std::string& line : guard_->lines(child_->take_refusals(), clock_->wall_s()))
    log_->say(Level::warning, line);
}

/// Before the first start on a state folder.
Status ServerProgram::begin_with_held() {
  if (options_.held_map.empty()) return {};
  const auto file = folder_->path() / kMapFile;
  std::error_code failure;
  if (std::filesystem::exists(file, failure)) return {};  // check_held() sees to it
  const auto held = mapfile::copy_held(options_.held_map, file, static_cast<std::int64_t>(wall_clock_ns()));
  if (!held) return in_context("--map", held.error());
  log_->say(Level::info,
            fmt::format("begins with {}, of which {} keyframes keep their poses", options_.held_map.string(), *held));
  return {};
}

Status ServerProgram::check_held() const {
  if (options_.held_map.empty()) return {};
  const auto held = node::read_held_poses(*store_);
  if (!held) return tl::unexpected(held.error());
  if (!held->empty()) return {};
  return fail(ErrorCode::configuration,
              "--map {}: {} has a map whose poses move, expected a state folder without a map, or one that began so",
              options_.held_map.string(), folder_->path().string());
}

std::string ServerProgram::robot_command() const {
  return fmt::format("tutti robot --name NAME --bus {} --mission {} --state DIR {}{}",
                     bus::without_credentials(bus_.url), bus_.mission, guard_ ? "--credentials NAME.cred " : "",
                     settings_.robot_arguments);
}

Status ServerProgram::start() {
  const auto address = address_of(options_.listen);
  if (!address) return tl::unexpected(address.error());
  if (Status ok = check_addresses(options_, *address); !ok) return ok;
  if (!options_.pki.empty()) {
    auto guard = BusGuard::open(options_.pki, settings_.mission, utc_text(static_cast<std::int64_t>(wall_clock_ns())));
    if (!guard) return tl::unexpected(guard.error());
    guard_.emplace(std::move(*guard));
  }
  if (Status ok = admit_page(); !ok) return ok;
  bus_ = options_.bus;
  bus_.mission = settings_.mission;
  auto folder = StateFolder::open(options_.state, "server", kMapFile);
  if (!folder) return tl::unexpected(folder.error());
  folder_.emplace(std::move(*folder));
  auto log = EventLog::open(folder_->path(), "server", options_.console);
  if (!log) return tl::unexpected(log.error());
  log_ = std::move(*log);
  verifier_ = settings_.verifiers.verifier();
  if (Status ok = begin_with_held(); !ok) return ok;
  auto store = storage::open_sqlite_store(folder_->path() / kMapFile, storage::map_schema(), {.has_readers = true});
  if (!store) return tl::unexpected(store.error());
  store_ = std::move(*store);
  if (Status ok = check_held(); !ok) return ok;
  if (options_.bus.url.empty()) {
    auto child = start_bus(options_, *address, guard_, folder_->path() / "bus");
    if (!child) return tl::unexpected(child.error());
    child_ = std::move(*child);
    bus_.url = child_->url();
    if (guard_) bus_.credentials = guard_->credentials();
    if (!guard_ && !bus::is_loopback(address->host))
      log_->say(Level::warning, "--insecure: whoever reaches this server's bus can write to the map and decide");
  }
  if (Status taken = take_lease(); !taken) return taken;
  clock_.emplace(options_.rate, options_.rate * folder_->age_s());
  host_.emplace(Host::Parts{.store = store_.get(),
                            .open_port = [this] { return bus::open_port(bus::Endpoint::server(), bus_); },
                            .open_node = [this](bus::Port&) { return open_node(); },
                            .each_second = [this] { tend(); },
                            .status_file = folder_->path() / kStatusFile,
                            .table_aside = map_tables::kMeta,
                            .version = options_.version,
                            .trouble = [this] { return trouble_.empty() && guard_ ? guard_->trouble() : trouble_; }},
                *clock_, *log_);
  if (Status opened = host_->open(); !opened) return opened;
  for (const auto& view : options_.views) {
    auto viewer = view(*store_);
    if (!viewer) return tl::unexpected(viewer.error());
    viewers_.push_back(std::move(*viewer));
  }
  if (Status shown = start_page(); !shown) return shown;
  if (options_.threads == 0) return {};
  worker_.emplace(bus_, verifier_, settings_.verifiers.refiner(), *store_, options_.version,
                  static_cast<std::size_t>(options_.threads), *clock_, *log_);
  return worker_->start();
}

/// The page is a member of the bus as others are, with a credential of its own.
Status ServerProgram::admit_page() {
  if (!options_.page) return {};
  if (options_.bus.credentials.known)
    return fail(ErrorCode::configuration,
                "--view: on a bus with rights that runs already the page needs a credential of its own: `tutti page "
                "--bus {} --credentials FILE --server {}` (tutti pki add-operator page)",
                bus::without_credentials(options_.bus.url), options_.state.string());
  if (!guard_) return {};
  auto credential = guard_->credential_of_page();
  if (!credential) return tl::unexpected(credential.error());
  page_credential_ = std::move(*credential);
  guard_->check(utc_text(static_cast<std::int64_t>(wall_clock_ns())));  // it is let in
  return {};
}

Status ServerProgram::start_page() {
  if (!options_.page) return {};
  std::vector<std::string> more{"--bus",     bus_.url,
                                "--mission", bus_.mission,
                                "--server",  folder_->path().string(),
                                "--state",   (folder_->path() / "page").string(),
                                "--rate",    fmt::format("{}", options_.rate)};
  if (guard_) more.insert(more.end(), {"--pki", options_.pki.string(), "--credentials", page_credential_});
  if (!guard_ && !bus_.credentials.file.empty()) more.insert(more.end(), {"--credentials", bus_.credentials.file});
  if (bus_.allow_insecure) more.emplace_back("--insecure");
  auto page = PageChild::start(folder_->path() / "page", *options_.page, std::move(more));
  if (!page) return tl::unexpected(page.error());
  page_ = std::move(*page);
  return {};
}

Status ServerProgram::run(const std::atomic<bool>& stop) {
  log_->say(Level::info,
            fmt::format("runs in {}, mission {}, bus {}, {} threads of its own verify closures",
                        folder_->path().string(), bus_.mission, bus::without_credentials(bus_.url), options_.threads));
  if (options_.announce) options_.announce(robot_command());
  notify_service_manager("READY=1");
  host_->run(stop);
  notify_service_manager("STOPPING=1");
  log_->say(Level::info, "stops; the map is stored");
  return is_over_ ? check_lease(lease_->state()) : Status();
}

}  // namespace

Status run_server(const ServerOptions& options, const std::atomic<bool>& stop) {
  keep_freed_memory();
  ServerProgram program(options);
  if (Status started = program.start(); !started) return started;
  return program.run(stop);
}

}  // namespace tutti::program
