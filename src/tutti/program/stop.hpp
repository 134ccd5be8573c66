// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <string>

namespace tutti::program {

/// True after the first SIGTERM or SIGINT, in a program that has called stop_on_signals(). Loops check it between
/// steps.
const std::atomic<bool>& stop_asked();
/// Makes SIGTERM and SIGINT set stop_asked(), and `said_at_once` appear on stderr. A second signal, whichever of the
/// two, ends the program at once, which is safe because what is stored is whole at any time. SIGXFSZ (a file may not
/// grow) no longer ends the program.
void stop_on_signals(std::string said_at_once = {});
/// This program gets SIGTERM when its parent, the process with this number, ends or has ended.
void end_with_parent(int parent);

/// Notifies systemd, if it started this program, "READY=1", "STOPPING=1" or "STATUS=...".
void notify_service_manager(const char* state);

}  // namespace tutti::program
