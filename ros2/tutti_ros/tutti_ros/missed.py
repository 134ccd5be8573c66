# SPDX-License-Identifier: BSD-3-Clause
"""How many messages were published and never heard."""
import collections

PAUSE_NS = 10**9  # a longer interval is a pause
LEAST = 8         # intervals from which on there is a period


class MissedCount:
    """Estimated from the stamps of those that were heard, because DDS reports neither what a full reader has dropped nor what a
    best-effort publisher has lost. The period is the lower quartile of the last intervals, so that up to half may be missing
    (as tutti robot --ros does: intake/missed_count.hpp)."""

    def __init__(self):
        self.last_ns, self.intervals, self.count = None, collections.deque(maxlen=32), 0

    def note(self, stamp_ns):
        before, self.last_ns = self.last_ns, stamp_ns
        if before is None or not 0 < stamp_ns - before <= PAUSE_NS:
            return
        interval = stamp_ns - before
        if len(self.intervals) >= LEAST:
            period = sorted(self.intervals)[len(self.intervals) // 4]
            self.count += max(0, int(interval / period + 0.5) - 1)
        self.intervals.append(interval)
