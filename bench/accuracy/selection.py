#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""How well robots follow the server's map by every policy: runs the missions in closed loop and writes
docs/results/selection.md.

Usage: bench/accuracy/selection.py TUTTI CALIBRATION [--data ../shared/data] [--keep out/selection] [--jobs 2] [--quick]
                                   [--missions a,b] [--write-only] [--old OLD_TUTTI]
TUTTI and CALIBRATION are the programs `tutti` and `tutti_calibration`, built with TUTTI_BUILD_BENCH=ON (CONTRIBUTING.md).
Results stay in the folder of --keep, and finished jobs are not repeated: use a new folder for a new program. --quick:
one seed, no scans, no fleets, no ablation; like --missions, it prints the document instead of writing it. --write-only
writes what is there. --old runs the default of an older program and records it in selection_old.csv.
"""
import argparse
import csv
import pathlib
import sys

from runs import write_results
from selection_document import document
from selection_jobs import OLD, Jobs, rows_of

RECORD = pathlib.Path(__file__).with_name("selection_old.csv")
COLUMNS = ["mission", "seed", "robot", "links", "most_links", "onboard_rmse_m", "server_rmse_m", "own_rmse_m",
           "onboard_rpe_m", "server_rpe_m", "own_rpe_m", "onboard_rpe_10m_m", "server_rpe_10m_m", "own_rpe_10m_m",
           "harm_m", "harm", "harm_while_wrong", "median_ms", "max_ms", "broadcast_bytes", "server_ms"]


def record_old(jobs):
    with RECORD.open("w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(COLUMNS)
        for key in jobs.jobs:
            if result := jobs.result(key):
                for row in rows_of(result, *key[1:]):
                    out.writerow([f"{v:.5g}" if isinstance(v, float) else v for v in (row[c] for c in COLUMNS)])


def recorded_old():
    """The recorded rows of the old default; none without a record."""
    def value(name, text):
        if name in ("mission", "robot"):
            return text
        return None if text == "" else float(text) if name not in ("seed", "links", "most_links") else int(text)
    if not RECORD.exists():
        return []
    with RECORD.open(newline="") as file:
        return [{"policy": OLD, **{name: value(name, text) for name, text in line.items()}}
                for line in csv.DictReader(file)]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tutti")
    parser.add_argument("calibration")
    parser.add_argument("--data")
    parser.add_argument("--keep", default="out/selection")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--missions", type=lambda text: text.split(","), help="only these")
    parser.add_argument("--write-only", action="store_true")
    parser.add_argument("--note", default="", help="how the machine was, for the document")
    parser.add_argument("--old", help="an older program, whose default policy is recorded")
    arguments = parser.parse_args()
    jobs = Jobs(arguments)
    if not arguments.write_only:
        jobs.all()
    if arguments.old:
        record_old(jobs)
    else:
        text = document(jobs, recorded_old())
        if arguments.quick or arguments.missions:
            print("\n".join(text))
        else:
            write_results("selection.md", text)
    for key, error in jobs.failed:
        print("failed:", *key, error, file=sys.stderr)
    return 1 if jobs.failed else 0


if __name__ == "__main__":
    sys.exit(main())
