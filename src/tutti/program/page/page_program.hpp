// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <filesystem>
#include <string>

#include "tutti/bus/transport.hpp"
#include "tutti/program/page/page_server.hpp"
#include "tutti/program/verifier_settings.hpp"

namespace tutti::page {

/// How the program of a page runs: a viewer or an operator of the bus, beside the server, whose map it reads.
struct PageProgramOptions {
  PageOptions page;              ///< Its mission, verifier and history are set by run_page().
  bus::BusOptions bus;           ///< No mission: the one that has a server there.
  std::filesystem::path server;  ///< The server's state folder.
  std::filesystem::path state;   ///< Its own.
  program::VerifierSettings verifiers;
  program::Level console = program::Level::warning;
};

/// Serves the page until `stop`. Errors of kind configuration are about the options.
Status run_page(PageProgramOptions options, const std::atomic<bool>& stop);

}  // namespace tutti::page
