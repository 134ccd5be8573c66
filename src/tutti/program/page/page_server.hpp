// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "tutti/base/result.hpp"
#include "tutti/program/map_viewer.hpp"

namespace tutti::page {

/// Where the page of a running mission is served.
struct PageOptions {
  std::string listen;           ///< "PORT" or "HOST:PORT"; without a host: this machine only. Port 0: any.
  bool allow_insecure = false;  ///< Other machines reach it without credentials.
  std::string description;      ///< The mission, in a sentence.
  /// Called once with the page's address; may be empty.
  std::function<void(const std::string& url)> announce;
};

/// Serves the page (docs/page.md) while the server runs: over HTTP, or over HTTPS where the server has a folder of
/// `tutti pki`. It has threads of its own, at most as many as connections are served at a time; connections beyond that
/// wait with the kernel, so that no number of them takes anything from the mission but the page. Fails when the address
/// is malformed or taken, or is another machine's to reach with neither credentials nor allow_insecure.
Result<std::unique_ptr<program::MapViewer>> serve_page(const PageOptions& options,
                                                       const program::ViewedMission& mission);

}  // namespace tutti::page
