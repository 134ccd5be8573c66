#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes docs/results/localise.md: robots in maps that do not move.

Usage: bench/accuracy/localise.py TUTTI_PROGRAM --shared FOLDER [--seeds 3]
"""
import argparse
import json
import pathlib
import subprocess
import tempfile

from runs import mission_file, page, row, write_results

# A name, the mission, whether it is real, seeds, what maps it, who is localised
LATE = 100000
CASES = [
    ("HKU session 2 in session 1's map", "hku_two_sessions", "real", False, ["robots.1.start_s=%d" % LATE, "duration_s=130"]),
    ("HKU session 1 in session 2's map", "hku_two_sessions", "real", False, ["robots.0.start_s=%d" % LATE, "duration_s=130"]),
    ("a tunnel, four minutes, other robots", "next_day", "simulated", True, ["duration_s=240"]),
    ("a regular grid of look-alike corridors, twenty starts", "look_alike", "simulated", False, ["duration_s=480"]),
]


def run(tutti, *words):
    done = subprocess.run([str(tutti), *[str(word) for word in words]], capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(str(word) for word in words)}: {done.stderr}")


def localised(tutti, mission, data, seed, mapping):
    """The robots' figures of localise.json."""
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        common = [mission_file(mission), "--seed", seed, *(["--data", data] if data else [])]
        settings = [word for one in mapping for word in ("--set", one)]
        run(tutti, "run", *common, *settings, "--map", folder / "map.tutti", "-o", folder / "mapped")
        run(tutti, "run", *common, "--map-in", folder / "map.tutti", "--frozen", "-o", folder / "localised")
        return json.loads((folder / "localised" / "localise.json").read_text())["robots"]


def percent(value):
    return f"{100 * value:.0f} %"


def cells(robots):
    fixes = [robot["first_fix_s"] for robot in robots if robot["first_fix_s"] is not None]
    scores = [robot["score"] for robot in robots if robot["score"] and robot["score"]["scored"]]
    scored = sum(score["scored"] for score in scores)
    mean = lambda values: sum(values) / len(values) if values else None
    shown = lambda value, digits, unit="": "-" if value is None else f"{value:.{digits}f}{unit}"
    rmse = (sum(s["rmse_m"] ** 2 * s["scored"] for s in scores) / scored) ** 0.5 if scored else None
    sigma = [mean([s["within_sigma"][k] for s in scores]) for k in range(3)]
    timing = [robot["timing"] for robot in robots]
    return [f"{len(fixes)} of {len(robots)}", shown(mean(fixes), 1, " s"),
            shown(mean([t["first_fix_cpu_s"] for t in timing if t["first_fix_cpu_s"]]), 1, " s"),
            percent(mean([robot["share_of_time"]["localised"] for robot in robots])),
            percent(mean([robot["share_of_time"]["ambiguous"] for robot in robots])),
            f"{sum(s['wrong'] for s in scores)} of {scored}", shown(rmse, 3, " m"),
            shown(max((s["max_m"] for s in scores), default=None), 3, " m"),
            "-" if sigma[0] is None else " / ".join(f"{value:.2f}" for value in sigma),
            shown(mean([t["scan_ms_median"] for t in timing if t["scan_ms_median"]]), 1, " ms")]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tutti")
    parser.add_argument("--shared", required=True, help="folder with data/")
    parser.add_argument("--seeds", type=int, default=3)
    arguments = parser.parse_args()
    table = [row("map and robots", "input", "first fix", "after", "CPU until then", "localised", "ambiguous", "wrong", "error", "worst",
                 "within 1 / 2 / 3 sigma", "CPU a scan"), row("---", "---", *["---:"] * 10)]
    for name, mission, kind, all_seeds, mapping in CASES:
        data = pathlib.Path(arguments.shared) / "data" if kind == "real" else None
        robots = []
        for seed in range(1, (arguments.seeds if all_seeds else 1) + 1):
            robots += localised(arguments.tutti, mission, data, seed, mapping)
        table.append(row(name, kind, *cells(robots)))
    write_results("localise.md", page(
        "Robots in a map that does not move",
        ["Asked was whether a robot without a start pose finds itself in a map that others made, whether it follows it, and whether it",
         "ever says that it is where it is not."],
        table,
        ["bench/accuracy/localise.py build/ci/apps/tutti/tutti --shared ../shared"],
        "*first fix*: robots that found their place, and the mean time until then; one submap is 10 s. *localised*, *ambiguous*: share of",
        "the whole time. *wrong*: published poses that are off by more than 1 m or 5 degrees. *error*: RMSE of the published poses in the",
        "map's frame, with the map's own error in it; the robots that made the map tie it to the reference, and nothing of the robot",
        "that is scored does. CPU is of this machine (2 cores, other work beside it).",
        "",
        "Where corridors look the same, a robot says so and names the places; it does not guess.",
        "",
        "Not measured yet: ten thousand starts, KITTI, EuRoC and KAIST, cameras, moved furniture, a lift, PCL's NDT and GICP beside it. A",
        "robot that is carried elsewhere is lost within 2 s and found again within a submap after the next (test `localise/localiser`).",
    ))


if __name__ == "__main__":
    main()
