// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/format.h>
#include <sys/stat.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>

#include "tutti/bus/transport.hpp"

/// The options of all commands that join a bus.
namespace tutti::app {

/// The one place where a user's credentials enter: a file, else the environment, else the URL, from which they are
/// taken out, so that nothing prints them.
inline void take_credentials(const std::string& file, bus::BusOptions& options) {
  const auto refuse = [](const char* option, const Error& error) {
    throw CLI::ValidationError(option, error.message);  // of CLI11's errors of usage
  };
  if (!options.url.empty()) {
    auto parsed = bus::parse_bus_url(options.url);
    if (!parsed) refuse("--bus", parsed.error());
    options.url = std::move(parsed->plain);
    options.credentials = std::move(parsed->credentials);
  }
  const char* const given = std::getenv("TUTTI_CREDENTIALS");
  if (file.empty() && (given == nullptr || *given == '\0')) return;
  auto taken = file.empty() ? bus::parse_credentials(given) : bus::read_credentials(file);
  if (!taken) refuse(file.empty() ? "TUTTI_CREDENTIALS" : "--credentials", taken.error());
  options.credentials = std::move(*taken);
  struct stat status {};
  if (!file.empty() && stat(file.c_str(), &status) == 0 && (status.st_mode & (S_IRWXO | S_IWGRP)) != 0)
    fmt::print(stderr, "tutti: warning: {}: others of this machine may read or change it (mode {:04o}): chmod 600 {}\n",
               file, status.st_mode & 07777U, file);
}

inline constexpr const char* kBusHelp = "The bus, as the server prints it";
inline constexpr const char* kBusInsecureHelp = "Use a bus on another machine without TLS";

/// Adds --bus, which is returned, --insecure and --credentials. When the command line is all read, the URL is
/// without credentials and these are taken.
inline CLI::Option* add_bus_options(CLI::App& command, bus::BusOptions& options, const std::string& help = kBusHelp,
                                    const std::string& insecure_help = kBusInsecureHelp) {
  const auto file = std::make_shared<std::string>();
  CLI::Option* const bus =
      command.add_option("--bus", options.url, help + "; " + bus::transports_help())->type_name("URL");
  command.add_flag("--insecure", options.allow_insecure, insecure_help);
  command
      .add_option("--credentials", *file,
                  "A file that `tutti pki` has made, for a bus with rights (docs/security.md); or whose first line is "
                  "USER:PASSWORD, or a token. Else the environment's TUTTI_CREDENTIALS is that text")
      ->type_name("FILE");
  command.parse_complete_callback([file, &options] { take_credentials(*file, options); });
  return bus;
}

/// Adds --mission.
inline void add_mission_name(CLI::App& command, std::string& name, const std::string& otherwise) {
  command
      .add_option("--mission", name,
                  "What the mission is called on the bus: programs of other missions are not heard. Letters, digits, "
                  "'-' and '_'; default: " +
                      otherwise)
      ->type_name("NAME");
}
inline constexpr const char* kServedMission = "the one that has a server on this bus";

}  // namespace tutti::app
