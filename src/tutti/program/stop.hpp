// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>

namespace tutti::program {

/// True from the first SIGTERM or SIGINT on, for a program that has called stop_on_signals(). Whoever loops looks at it
/// between two steps.
const std::atomic<bool>& stop_asked();
/// A second signal ends the program at once: what is stored is whole at any moment. A file that may not grow (SIGXFSZ)
/// ends it no more.
void stop_on_signals();
/// The program gets SIGTERM when the one that started it, of this number, ends or has ended.
void end_with_parent(int parent);

/// Tells systemd, if it started this program: "READY=1", "STOPPING=1", "STATUS=...".
void tell_service_manager(const char* state);

}  // namespace tutti::program
