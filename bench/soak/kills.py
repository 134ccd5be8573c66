#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The long form of tests/system: missions of which server, robots, workers and nats-server are killed (kill -9) at 20
random instants each, until there were so many kills; after each the map must be that of tutti run.

usage: kills.py TUTTI_PROGRAM [KILLS, 1000 unless told] [FIRST_SEED]
"""
import os
import pathlib
import subprocess
import sys
import time

SOURCE = pathlib.Path(__file__).resolve().parents[2]
EACH = 20


def main():
    tutti, kills = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 1000
    first = int(sys.argv[3]) if len(sys.argv) > 3 else 1
    failed, begin = [], time.monotonic()
    seeds = range(first, first + -(-kills // EACH))
    for seed in seeds:
        done = subprocess.run(
            [sys.executable, SOURCE / "tests/system/programs_test.py", tutti, SOURCE,
             "Programs.test_kills_at_random_instants_lose_nothing"],
            env={**os.environ, "TUTTI_SEED": str(seed)}, capture_output=True, text=True)
        if done.returncode:
            failed.append(seed)
            print(done.stderr, file=sys.stderr)
        print(f"{EACH * (seed - first + 1)} kills, {time.monotonic() - begin:.0f} s, missions that failed: {failed or 'none'}",
              flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
