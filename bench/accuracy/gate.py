#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The gate of figures: runs what the pages quote, and says what is worse or better than what is committed in gate.json.

Usage: bench/accuracy/gate.py TUTTI_PROGRAM --shared FOLDER [--quick] [--only WORD] [--write] [--readme] [--jobs 2] [--out FOLDER]
FOLDER holds data/ (docs/data.md) and cases/. Ends with 1 when a figure is worse by more than it may move. --quick is what
tells most in three minutes of CPU; the whole takes 20 minutes on two cores. --write takes the figures as those to compare with,
--readme writes README's table from the missions that were run. Runs are thrown away, or kept in --out, where those of the same
program that are finished are not made again. A recording that is not there gives rows "skipped", and its figures in gate.json stay.
"""
import argparse
import concurrent.futures
import dataclasses
import hashlib
import json
import pathlib
import subprocess
import sys
import tempfile

import gate_readme
from gate_runs import JOBS, Places
from runs import SOURCE, row

COMMITTED = pathlib.Path(__file__).with_name("gate.json")


@dataclasses.dataclass
class Kind:
    """How a figure is compared. It may move by the larger of both."""
    absolute: float
    relative: float
    worse: int  # 1: when it is larger, -1: when it is smaller, 0: when it is another


KINDS = {
    "error_m": Kind(0.003, 0.05, 1),
    "ratio": Kind(0.02, 0.02, 1),
    "form": Kind(0.1, 0.05, 1),  # of one in 52: a closure whose price is at the limit comes or goes with another BLAS
    "some": Kind(2, 0.10, 1),
    "harm_m": Kind(0.03, 0.10, 1),
    "cost": Kind(1e-6, 1e-4, 1),
    "share": Kind(0.001, 0.0, 1),
    "latency_s": Kind(0.3, 0.05, 1),
    "cpu_s": Kind(float("inf"), 0, 1),  # shown, never judged: machines differ, and work is counted
    "wrong": Kind(0, 0, 1),
    "refused": Kind(1, 0.10, 1),
    "updates": Kind(1, 0, 1),
    "work": Kind(0, 0.10, 1),
    "accepted": Kind(1, 0.02, -1),
    "same": Kind(0, 0, 0),
}


@dataclasses.dataclass
class Line:
    figure: str
    page: str
    now: float
    committed: float
    may_move: float
    verdict: str


def verdict_of(kind, now, committed):
    if now is None:
        return "WORSE: gone"
    if committed is None:
        return "new"
    moved, allowed = now - committed, allowed_of(kind, committed)
    if abs(moved) <= allowed:
        return "as committed"
    return "better" if kind.worse * moved < 0 else "WORSE"


def allowed_of(kind, committed):
    return max(kind.absolute, kind.relative * abs(committed))


def rounded(value):
    return value if value is None or isinstance(value, int) else float(f"{value:.6g}")


def lines_of(job, figures, committed):
    """`figures` is None where a recording is missing, and empty where a run failed."""
    lines = []
    for name in {**committed, **(figures or {})}:
        kind, before = committed.get(name, (None, None))
        kind, now = figures[name] if figures and name in figures else (kind, None)
        allowed = "-" if before is None else allowed_of(KINDS[kind], before)
        verdict = "skipped" if figures is None else verdict_of(KINDS[kind], now, before)
        lines.append(Line(f"{job.name}: {name}", job.page, rounded(now), before, allowed, verdict))
    if not lines:
        lines.append(Line(job.name, job.page, None, None, "-", "skipped" if figures is None else "WORSE: failed"))
    return lines


def shown(value):
    return "-" if value is None else value if isinstance(value, (str, int)) else f"{value:.4g}"


def print_table(lines):
    print(row("figure", "page", "now", "committed", "may move by", "verdict"))
    print(row(*["---"] * 6))
    for line in lines:
        print(row(line.figure, line.page, shown(line.now), shown(line.committed), shown(line.may_move), line.verdict))


def last_lines(lines, name, version, figures):
    """The figures that are worse or better, and then the line for a commit."""
    count = lambda verdict: sum(line.verdict.startswith(verdict) for line in lines)
    out = [f"{line.verdict}: {line.figure}: {shown(line.committed)} -> {shown(line.now)}"
           for verdict in ("better", "WORSE") for line in lines if line.verdict.startswith(verdict)]
    skipped = count("skipped")
    forms = figures.get("forms") or {}
    over = [f"{what} {forms[what][1]:.3f}" for what in ("median", "p95", "worst") if what in forms]
    over = f" Forms over the perfect judge: {', '.join(over)}." if over else ""
    return out + [f"Gate ({name}, {version}): {len(lines)} figures, {count('as committed')} as committed, {count('better')} better, "
                  f"{count('WORSE')} worse, {count('new')} new, {skipped} skipped.{over}"]


def read_committed():
    if not COMMITTED.exists():
        return {}
    return {job: {name: tuple(entry) for name, entry in figures.items()} for job, figures in json.loads(COMMITTED.read_text()).items()}


def write_committed(committed, figures):
    """Jobs that were not run keep theirs; those that there are no longer go."""
    kept = {job.name: committed[job.name] for job in JOBS if job.name in committed}
    for job, own in figures.items():
        if own:
            kept[job] = {name: (kind, rounded(value)) for name, (kind, value) in own.items()}
    text = ",\n".join(f" {json.dumps(job)}: {{\n" + ",\n".join(f"  {json.dumps(name)}: {json.dumps(entry)}" for name, entry in own.items()) +
                      "\n }" for job, own in kept.items())
    COMMITTED.write_text("{\n" + text + "\n}\n")


def run_all(jobs, places, threads):
    def run(job):
        missing = job.missing(places)
        if missing is not None:
            print(f"skipped: {job.name}: {missing} is not in the shared folder", file=sys.stderr)
            return None
        try:
            return {name: (kind, value) for name, (kind, value) in job.run(places).items() if value is not None}
        except subprocess.CalledProcessError as failure:
            print(f"failed: {job.name}: {failure}\n{failure.stderr}", file=sys.stderr)
            return {}

    with concurrent.futures.ThreadPoolExecutor(threads) as pool:
        return dict(zip([job.name for job in jobs], pool.map(run, jobs)))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tutti", type=pathlib.Path)
    parser.add_argument("--shared", type=pathlib.Path, required=True)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", type=pathlib.Path)
    parser.add_argument("--only", metavar="WORD", default="", help="what has this in its name (f355, terrace, kth ..)")
    for flag in ("--quick", "--write", "--readme"):
        parser.add_argument(flag, action="store_true")
    arguments = parser.parse_args()
    if not (arguments.shared / "data").exists():
        print(f"skipped: {arguments.shared} has no data/\nTUTTI_ALL_SKIPPED")
        return 0
    with tempfile.TemporaryDirectory() as thrown_away:
        program = hashlib.sha256(arguments.tutti.read_bytes()).hexdigest()[:12]
        out = arguments.out.resolve() / program if arguments.out else pathlib.Path(thrown_away)
        return gate(arguments, Places(arguments.tutti.resolve(), arguments.shared.resolve(), out))


def gate(arguments, places):
    jobs = [job for job in JOBS if (job.quick or not arguments.quick) and arguments.only in job.name]
    figures = run_all(jobs, places, arguments.jobs)
    committed = read_committed()
    lines = [line for job in jobs for line in lines_of(job, figures[job.name], committed.get(job.name, {}))]
    print_table(lines)
    if arguments.write:
        write_committed(committed, figures)
    if arguments.readme:
        gate_readme.write(places)
    version = subprocess.run([places.tutti, "--version"], check=True, capture_output=True, text=True).stdout.strip()
    name = f"of '{arguments.only}'" if arguments.only else "quick" if arguments.quick else "whole"
    print()
    print("\n".join(last_lines(lines, name, version, figures)))
    return 1 if any(line.verdict.startswith("WORSE") for line in lines) else 0


if __name__ == "__main__":
    sys.exit(main())
