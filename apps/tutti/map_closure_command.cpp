// SPDX-License-Identifier: BSD-3-Clause
// tutti map closure: why closures are in a map or not, and the operator's decision on them.
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "bus_options.hpp"
#include "commands.hpp"
#include "map_command.hpp"
#include "options.hpp"
#include "tutti/bus/mission_lease.hpp"
#include "tutti/mapfile/closures.hpp"
#include "tutti/node/decision_sender.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::app {
namespace {

constexpr const char* kCommand = "map closure";
constexpr double kSaySoon_s = 1.5;
constexpr double kDegPerRad = 180.0 / std::numbers::pi;

struct ClosureOptions {
  std::string map, closure, by;
  bus::BusOptions bus{.url = {}, .mission = {}};
  bool rejected = false;
  double wait_s = 60.0;
};

std::string time_of(std::int64_t ns) {
  return fmt::format("{:%F %T} UTC", fmt::gmtime(static_cast<std::time_t>(ns / 1'000'000'000)));
}

Result<std::vector<mapfile::ClosureInfo>> closures_of(const std::string& file) {
  const auto map = mapfile::open(file);
  if (!map) return tl::unexpected(map.error());
  const auto content = mapfile::read(**map);
  if (!content) return tl::unexpected(content.error());
  return mapfile::closures(*content, mapfile::estimate(*content));
}

int list(const ClosureOptions& options) {
  const auto closures = closures_of(options.map);
  if (!closures) return complain(kCommand, closures.error().message);
  fmt::print("{:<32} {:<10} {}\n", "closure", "state", "why");
  for (const mapfile::ClosureInfo& info : *closures)
    if (!options.rejected || info.state == mapfile::ClosureState::rejected)
      fmt::print("{:<32} {:<10} {}\n", info.name, to_string(info.state), info.reason);
  return 0;
}

void print(const mapfile::ClosureFit& fit) {
  const RelativePose& measured = fit.closure.measurement;
  const Eigen::Vector3d& t = measured.T_a_b.translation;
  const Eigen::Quaterniond& q = measured.T_a_b.rotation;
  const Vector6d sigma = measured.covariance.diagonal().cwiseSqrt();
  fmt::print("\nkeyframes    {} and {}: {}{}{}\n", fit.closure.from.index, fit.closure.to.index, to_string(fit.state),
             fit.reason.empty() ? "" : ", ", fit.reason);
  fmt::print("measured     x y z {:.3f} {:.3f} {:.3f} m, quaternion x y z w {:.5f} {:.5f} {:.5f} {:.5f}\n", t.x(),
             t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
  fmt::print("sigma        {:.3f} {:.3f} {:.3f} m, {:.2f} {:.2f} {:.2f} deg\n", sigma(0), sigma(1), sigma(2),
             kDegPerRad * sigma(3), kDegPerRad * sigma(4), kDegPerRad * sigma(5));
  if (fit.misfit)
    fmt::print("off the map  {:.3f} m, {:.2f} deg; squared error {:.3g} (6 degrees of freedom)\n",
               fit.misfit->position_m, kDegPerRad * fit.misfit->rotation_rad, fit.misfit->chi2);
  else
    fmt::print("off the map  nothing ties its two ends\n");
}

/// Prints what each verifier and operator found of it, and what was measured.
void print_origin(const mapfile::ClosureInfo& info) {
  if (info.decision) {
    const ClosureDecision& given = *info.decision;
    fmt::print("decision     {}{} at {}{}\n", to_string(given.wish), given.by.empty() ? "" : " by " + given.by,
               time_of(given.given_ns),
               given.counts_from_ns() == given.given_ns
                   ? ""
                   : fmt::format(", by a clock that was ahead: counts from {}", time_of(given.taken_ns)));
  }
  if (info.verdict) {
    const ClosureVerdict& verdict = *info.verdict;
    fmt::print("verified     by {}{}, verifier {}\n",
               verdict.worker > 0 ? fmt::format("worker {}", verdict.worker - 1) : "an unknown worker",
               verdict.verified_ns != 0 ? " at " + time_of(verdict.verified_ns) : "", to_string(verdict.verifier));
    for (const Refusal& measured : verdict.evidence) {
      const RefusalKind& kind = kind_of(measured.reason);
      fmt::print("  {:<40} {:>8.3f} {:<4} {} {:.3f}\n", kind.words, measured.value, kind.unit,
                 kind.bound == RefusalKind::Bound::at_least ? "at least" : "at most", measured.limit);
    }
  }
}

int show(const ClosureOptions& options) {
  const auto map = mapfile::open(options.map);
  if (!map) return complain(kCommand, map.error().message);
  const auto content = mapfile::read(**map);
  if (!content) return complain(kCommand, content.error().message);
  const auto pair = content->closure_names().find(options.closure);
  if (!pair) return complain(kCommand, pair.error().message);
  const auto closures = mapfile::closures(*content, mapfile::estimate(*content));
  const auto found = std::ranges::find(closures, *pair, &mapfile::ClosureInfo::pair);
  if (found == closures.end()) return complain(kCommand, options.closure + ": no closure was found there");
  fmt::print("closure      {}\nstate        {}{}{}\n", found->name, to_string(found->state),
             found->reason.empty() ? "" : ": ", found->reason);
  print_origin(*found);
  for (const mapfile::ClosureFit& fit : found->closures) print(fit);
  return 0;
}

/// The server's answer, if it is among the messages that have come.
std::optional<std::string> heard_answer(bus::Port& port, const node::DecisionSender& sender) {
  for (const bus::Received& received : port.receive())
    if (const auto status = wire::decode_mission_status(*received.envelope.bytes))
      if (auto answer = sender.answer(*status)) return answer;
  return std::nullopt;
}

void say_waiting(const std::string& what) { fmt::print(stderr, "tutti {}: {}\n", kCommand, what); }

const std::string& why_not(const bus::LinkState& state) {
  return state.denied.empty() ? state.last_error : state.denied;
}

std::string waits_for(const bus::LinkState& state) {
  const std::string& why = why_not(state);
  if (!state.connected)
    return fmt::format("waits for a link to the bus {}{}{}", state.url, why.empty() ? "" : ": ", why);
  if (state.waiting_messages > 0)
    return fmt::format("waits for the bus {} to store the decision{}{}", state.url, why.empty() ? "" : ": ", why);
  return fmt::format("the bus {} has the decision: waits for the server to say that it is stored", state.url);
}

/// To the server that has the map open, until it has answered.
Status send(const ClosureOptions& options, const ClosureDecision& decision) {
  const auto self = bus::Endpoint::viewer(static_cast<std::uint32_t>(getpid()));
  bus::BusOptions where = options.bus;
  auto mission = bus::served_mission(where, std::min(bus::kLookForServer_s, options.wait_s), say_waiting);
  if (!mission) return tl::unexpected(mission.error());
  where.mission = std::move(*mission);
  auto port = bus::open_port(self, where);
  if (!port) return tl::unexpected(port.error());
  node::DecisionSender sender(self, decision);
  const auto begin = std::chrono::steady_clock::now();
  std::string reported;
  for (;; std::this_thread::sleep_for(std::chrono::milliseconds(20))) {
    const double now_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    if (const auto answer = heard_answer(**port, sender))
      return answer->empty() ? Status() : fail(ErrorCode::invalid, "the server does not take it: {}", *answer);
    const bus::LinkState state = (*port)->state();
    if (now_s > options.wait_s && state.waiting_messages > 0)
      return fail(ErrorCode::io, "{}: the bus has not taken the decision for mission '{}' within {} s: {}", where.url,
                  where.mission, options.wait_s, why_not(state));
    if (now_s > options.wait_s)
      return fail(ErrorCode::io,
                  "{}: the bus has the decision, but the server has not confirmed it within {} s; give it again if "
                  "`tutti map closure show` does not know it later",
                  where.url, options.wait_s);
    if (now_s > kSaySoon_s && std::exchange(reported, waits_for(state)) != waits_for(state))
      say_waiting(fmt::format("{}, at most {:g} s", reported, options.wait_s));
    if (state.waiting_messages > 0) continue;  // it has not left yet
    if (const auto envelope = sender.due(now_s))
      if (auto sent = (*port)->send(*envelope); !sent) return sent;
  }
}

int decide(const ClosureOptions& options, Wish wish) {
  if (options.map.empty() == options.bus.url.empty())
    return complain(kCommand, "expected a map's file, or --bus URL of the server that has it open", 2);
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const auto& known = options.bus.credentials.known;
  const ClosureDecision decision{options.closure, wish, known ? known->name : options.by,
                                 std::chrono::duration_cast<std::chrono::nanoseconds>(now).count()};
  if (!options.bus.url.empty() && known && known->role != bus::BusRole::operates)
    return complain(kCommand,
                    fmt::format("the credential is that of {}, and operators alone decide: --credentials with one that "
                                "`tutti pki add-operator NAME` makes",
                                to_string(*known)),
                    2);
  if (auto ok = wire::validate(decision); !ok) return complain(kCommand, ok.error().message, 2);
  if (!options.bus.url.empty()) {
    if (auto sent = send(options, decision); !sent) return complain(kCommand, sent.error().message);
    fmt::print("{} {}: stored by the server; the map follows at its next update\n", to_string(wish), options.closure);
    return 0;
  }
  const auto map = mapfile::open(options.map);
  if (!map) return complain(kCommand, map.error().message);
  if (auto stored = mapfile::put_decision(**map, decision); !stored) return complain(kCommand, stored.error().message);
  fmt::print("{} {}: stored; the server follows when it opens the map\n", to_string(wish), options.closure);
  return 0;
}

void add_decision(CLI::App& command, Wish wish, const std::string& help, int& exit_code) {
  const auto options = std::make_shared<ClosureOptions>();
  const char* user = std::getenv("USER");
  if (user != nullptr) options->by = user;
  CLI::App* decision = command.add_subcommand(to_string(wish), help);
  decision->add_option("closure", options->closure, "As `closure list` names it, e.g. alpha/12-bravo/7.")
      ->type_name("ID")
      ->required();
  decision->add_option("map", options->map, "The map's file (a server's STATE/map.tutti), when no server has it open.")
      ->type_name("MAP");
  add_bus_options(*decision, options->bus, "The bus of the server that has the map open, instead of a file");
  add_mission_name(*decision, options->bus.mission, kServedMission);
  add_number(*decision, "--wait", options->wait_s, "How long to say it again until the server has answered", "S");
  decision->add_option("--by", options->by, "Who says so, for the record.")->type_name("NAME")->capture_default_str();
  decision->callback([options, wish, &exit_code] { exit_code = decide(*options, wish); });
}

}  // namespace

void add_map_closure_command(CLI::App& map, int& exit_code) {
  CLI::App* closure =
      map.add_subcommand("closure", "Loop closures: why they are in the map or not, and your decisions on them.");
  closure->require_subcommand(1);
  closure->footer(
      "A closure's name is that of its two submaps: alpha/12-bravo/7; alpha.2/3 is of alpha's second session.\n"
      "Your decision stands above the server's judgement, survives restarts, and the map follows at its next "
      "update.\n");
  const auto listing = std::make_shared<ClosureOptions>(), showing = std::make_shared<ClosureOptions>();
  CLI::App* all = closure->add_subcommand("list", "Every pair of submaps with closures, accepted or not, and why.");
  all->add_option("map", listing->map, "The map's file.")->type_name("MAP")->required();
  all->add_flag("--rejected", listing->rejected, "Only those that are not in the map.");
  all->callback([listing, &exit_code] { exit_code = list(*listing); });
  CLI::App* one =
      closure->add_subcommand("show", "The evidence for one: what was measured, by whom, and how it fits the map.");
  one->add_option("closure", showing->closure, "As `closure list` names it.")->type_name("ID")->required();
  one->add_option("map", showing->map, "The map's file.")->type_name("MAP")->required();
  one->callback([showing, &exit_code] { exit_code = show(*showing); });
  add_decision(*closure, Wish::accept, "It is right: in the map, with its covariance, whatever contradicts it.",
               exit_code);
  add_decision(*closure, Wish::reject, "It is wrong: never in the map.", exit_code);
  add_decision(*closure, Wish::withdraw, "Take your decision back: the server judges again.", exit_code);
}

}  // namespace tutti::app
