// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/bus/child_process.hpp"

namespace tutti::program {

/// The page of a server as its child: `tutti page`.
struct PageChildOptions {
  std::string listen;                                  ///< "[HOST:]PORT"; port 0: any, and then always that one.
  std::vector<std::string> arguments;                  ///< The mission; the server adds bus and folders.
  std::uint64_t most_bytes = std::uint64_t{4} << 30U;  ///< Memory that it may take.
};

/// In a page's state folder: its address, and the number of its process.
inline constexpr const char* kPageStatusFile = "status.json";

/// A page that runs beside its server, and is started again when it ends, however it ends. It takes nothing from the
/// server but the processor: its memory is bounded, and on a machine without memory the kernel ends it first.
class PageChild {
 public:
  /// Starts it, with `more` arguments, and waits until it listens. `folder`: the page's. Errors: it ended first, which
  /// its own messages on this program's stderr explain.
  static Result<std::unique_ptr<PageChild>> start(std::filesystem::path folder, PageChildOptions options,
                                                  std::vector<std::string> more);
  /// To be called about once a second: starts it again. Returns what the operator should know; empty: nothing.
  std::string tend(double wall_s);

  static constexpr double kStart_s = 60.0;                    ///< By then it listens.
  static constexpr double kSilent_s = 30.0;                   ///< One that has written no status for so long is ended.
  static constexpr double kFirst_s = 1.0, kLongest_s = 60.0;  ///< Pauses before it is started again.

 private:
  PageChild(std::filesystem::path folder, PageChildOptions options, std::vector<std::string> more);
  void launch();
  /// The address of the child that runs now; empty: it does not listen yet.
  [[nodiscard]] std::string listens_at() const;
  [[nodiscard]] bool is_silent();

  std::filesystem::path folder_;
  PageChildOptions options_;
  std::vector<std::string> command_;
  std::unique_ptr<bus::ChildProcess> process_;
  double pause_s_ = kFirst_s, again_s_ = 0.0, begun_s_ = 0.0;
  int silent_ = 0;  // how often in a row
};

}  // namespace tutti::program
