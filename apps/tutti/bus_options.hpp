// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <memory>
#include <string>

#include "tutti/base/file.hpp"
#include "tutti/bus/bus_address.hpp"

namespace tutti::app {

/// The one place where a user's credentials enter: a file, else the environment, else the URL, from which they are
/// taken out, so that nothing prints them.
inline void take_credentials(const std::string& file, std::string& url, bus::BusCredentials& credentials) {
  const auto refuse = [](const char* option, const Error& error) {
    throw CLI::ValidationError(option, error.message);  // of CLI11's errors of usage
  };
  if (!url.empty()) {
    auto parsed = bus::parse_bus_url(url);
    if (!parsed) refuse("--bus", parsed.error());
    url = std::move(parsed->plain);
    credentials = std::move(parsed->credentials);
  }
  const char* const given = std::getenv("TUTTI_CREDENTIALS");
  if (file.empty() && (given == nullptr || *given == '\0')) return;
  const auto text = file.empty() ? Result<std::string>(given) : read_file(file);
  if (!text) refuse("--credentials", text.error());
  auto parsed = bus::parse_credentials(*text);
  if (!parsed && file.empty()) refuse("TUTTI_CREDENTIALS", parsed.error());
  if (!parsed) refuse("--credentials", in_context(file, parsed.error()).value());
  credentials = std::move(*parsed);
}

/// Adds --credentials. When the command's words are all read, `url` is without credentials and these are taken.
inline void add_credentials_option(CLI::App& command, std::string& url, bus::BusCredentials& credentials) {
  const auto file = std::make_shared<std::string>();
  command
      .add_option("--credentials", *file,
                  "A file whose first line is USER:PASSWORD, or a token, for a bus that asks for them; else the "
                  "environment's TUTTI_CREDENTIALS is that line")
      ->type_name("FILE");
  command.parse_complete_callback([file, &url, &credentials] { take_credentials(*file, url, credentials); });
}

}  // namespace tutti::app
