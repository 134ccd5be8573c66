// SPDX-License-Identifier: BSD-3-Clause
// Who may use the bus of a mission.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "commands.hpp"
#include "options.hpp"
#include "tutti/pki/pki.hpp"
#include "tutti/program/robot_program.hpp"

namespace tutti::app {
namespace {

using bus::BusRole;

struct PkiOptions {
  std::filesystem::path folder = "pki";
  std::string mission = "tutti";
  std::string name;
  std::vector<std::string> names;  // of the bus's certificate
  std::optional<std::uint32_t> number;
  int days = pki::kDays;
};

int end_of(const Status& done) {
  if (done) return 0;
  return complain("pki", done.error().message, done.error().code == ErrorCode::configuration ? 2 : 1);
}

Status init(const PkiOptions& options) {
  const auto made = pki::Pki::make(options.folder, options.mission, options.days, options.names);
  if (!made) return tl::unexpected(made.error());
  fmt::print("{}: the authority of mission {}. Whoever has this folder lets in whom they like.\n",
             options.folder.string(), options.mission);
  fmt::print("next: tutti pki add-robot NAME, tutti server --pki {} --listen 0.0.0.0:4222 ..\n",
             options.folder.string());
  return {};
}

Status add(const PkiOptions& options, BusRole role) {
  auto there = pki::Pki::open(options.folder);
  if (!there) return tl::unexpected(there.error());
  auto number = options.number;
  if (role == BusRole::robot && !number) {
    const auto own = program::number_of(options.name, {}, true);
    if (!own) return tl::unexpected(own.error());
    number = own->value;
  }
  const auto file = there->add(role, options.name, number, options.days);
  if (!file) return tl::unexpected(file.error());
  fmt::print("{}\n", file->string());
  return {};
}

Status revoke(const PkiOptions& options) {
  auto there = pki::Pki::open(options.folder);
  if (!there) return tl::unexpected(there.error());
  return there->revoke(options.name);
}

Status renew(const PkiOptions& options) {
  auto there = pki::Pki::open(options.folder);
  if (!there) return tl::unexpected(there.error());
  if (Status done = there->renew(options.name, options.days, options.names); !done) return done;
  if (!options.name.empty()) fmt::print("{}\n", there->credential(options.name).string());
  return {};
}

Status list(const PkiOptions& options) {
  const auto there = pki::Pki::open(options.folder);
  if (!there) return tl::unexpected(there.error());
  const auto until = there->bus_until();
  if (!until) return tl::unexpected(until.error());
  const auto names = there->bus_names();
  if (!names) return tl::unexpected(names.error());
  fmt::print("mission {}, the bus's certificate is valid until {}, for {}\n", there->mission(), *until,
             fmt::join(*names, ", "));
  fmt::print("{:<9} {:<24} {:>10} {:<8} {}\n", "role", "name", "number", "state", "valid until");
  for (const pki::Member& member : there->members())
    fmt::print("{:<9} {:<24} {:>10} {:<8} {}\n", name(member.user.role), member.user.name, member.user.number,
               member.is_revoked ? "revoked" : "valid", member.until);
  return {};
}

/// One command of `tutti pki`, with the options that all have.
CLI::App* add_one(CLI::App& app, const char* command_name, const char* help, const std::shared_ptr<PkiOptions>& options,
                  int& exit_code, std::function<Status(const PkiOptions&)> run) {
  CLI::App* command = app.add_subcommand(command_name, help);
  command->add_option("--pki", options->folder, "The folder with the authority and all credentials")
      ->type_name("DIR")
      ->capture_default_str();
  command->callback([options, run = std::move(run), &exit_code] { exit_code = end_of(run(*options)); });
  return command;
}

void add_days(CLI::App& command, int& days) {
  command.add_option("--days", days, "How long the certificate is valid")
      ->type_name("N")
      ->check(CLI::Range(1, pki::kAuthorityDays))
      ->capture_default_str();
}

void add_names(CLI::App& command, std::vector<std::string>& names) {
  command
      .add_option(
          "--name", names,
          "A name or an address of this machine, under which browsers open its page; may be given several times")
      ->type_name("HOST");
}

void add_member(CLI::App& app, BusRole role, const char* help, int& exit_code) {
  const auto options = std::make_shared<PkiOptions>();
  const std::string command_name = std::string("add-") + name(role);
  CLI::App* command = add_one(app, command_name.c_str(), help, options, exit_code,
                              [role](const PkiOptions& given) { return add(given, role); });
  command->add_option("name", options->name, "Nobody else's: letters, digits, '-' and '_'")
      ->type_name("NAME")
      ->required();
  add_days(*command, options->days);
  if (role == BusRole::robot)
    command
        ->add_option("--number", options->number,
                     "The place of a robot in its mission file, from 0; default: that of a robot with --feed or "
                     "--ros, made from its name")
        ->type_name("N");
}

}  // namespace

void add_pki_command(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand(
      "pki",
      "Who may use the bus of a mission: a credential for each robot, worker, operator and viewer, with the rights of\n"
      "its role and no others (docs/security.md). A server that runs with --pki follows within two seconds.");
  command->require_subcommand(1);
  command->footer(
      "Example: tutti pki init --mission cave --name base.local --name 10.0.0.1; tutti pki add-robot alpha; tutti pki "
      "add-operator anna;\n"
      "         tutti server --pki pki --mission cave --listen 0.0.0.0:4222 --state /var/lib/tutti-server\n"
      "         tutti robot --name alpha --credentials alpha.cred --bus tls://BASE:4222 --mission cave ..\n");
  const auto made = std::make_shared<PkiOptions>(), revoked = std::make_shared<PkiOptions>(),
             renewed = std::make_shared<PkiOptions>(), listed = std::make_shared<PkiOptions>();
  CLI::App* one = add_one(*command, "init", "Makes the folder, the authority and the server's own credential.", made,
                          exit_code, init);
  one->add_option("--mission", made->mission, "The mission whose bus it is, as in --mission of the programs")
      ->type_name("NAME")
      ->capture_default_str();
  add_days(*one, made->days);
  add_names(*one, made->names);
  add_member(*command, BusRole::robot,
             "A robot: writes as itself, reads what is its own. Prints its credential's file.", exit_code);
  add_member(*command, BusRole::worker, "A worker: takes jobs and answers them.", exit_code);
  add_member(*command, BusRole::operates, "An operator: sees the mission's status, and decides under this name.",
             exit_code);
  add_member(*command, BusRole::views, "A viewer: sees the mission's status.", exit_code);
  one = add_one(*command, "revoke", "Cuts it off, now and for ever; its name may be given again, with another key.",
                revoked, exit_code, revoke);
  one->add_option("name", revoked->name, "As `tutti pki list` shows it")->type_name("NAME")->required();
  one = add_one(*command, "renew",
                "A new certificate, with the key that is there: the bus's, or of NAME. Nobody needs to start again.",
                renewed, exit_code, renew);
  one->add_option("member", renewed->name, "Whose; default: the bus's")->type_name("NAME");
  add_days(*one, renewed->days);
  add_names(*one, renewed->names);
  add_one(*command, "list", "Who is known, and until when.", listed, exit_code, list);
}

}  // namespace tutti::app
