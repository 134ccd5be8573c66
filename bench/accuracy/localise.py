#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes docs/results/localise.md: robots in maps that do not move.

Usage: bench/accuracy/localise.py TUTTI_PROGRAM --shared FOLDER [--seeds 3] [--keep FOLDER]

--keep: what is in this folder is not measured again (use a new one for a new program).
"""
import argparse
import hashlib
import json
import pathlib
import subprocess
import tempfile

from runs import mission_file, page, row, write_results

# A name, the mission, whether it is real, seeds, what maps it, who is localised
LATE = 100000
CAMERAS = ("hall", "euroc_v101_halves")
RESTART_S, KIDNAP_S, ONE_SUBMAP_S, SAID_S = 30, 30, 12, 2
CASES = [
    ("HKU session 2 in session 1's map", "hku_two_sessions", "real", False, ["robots.1.start_s=%d" % LATE, "duration_s=130"]),
    ("HKU session 1 in session 2's map", "hku_two_sessions", "real", False, ["robots.0.start_s=%d" % LATE, "duration_s=130"]),
    ("EuRoC V1_01, its second half in its first's map, cameras", "euroc_v101_halves", "real", False,
     ["robots.1.start_s=%d" % LATE, "duration_s=130"]),
    ("EuRoC V1_01, its first half in its second's map, cameras", "euroc_v101_halves", "real", False,
     ["robots.0.start_s=%d" % LATE, "duration_s=130"]),
    ("a tunnel, four minutes, other robots", "next_day", "simulated", True, ["duration_s=240"]),
    ("a hall, three flights with cameras alone", "hall", "simulated", True, ["hall.robots.2.start_s=%d" % LATE, "duration_s=130"]),
    ("a regular grid of look-alike corridors, twenty starts", "look_alike", "simulated", False, ["duration_s=480"]),
]
LIFT = ("a lift between two floors", "floors", "simulated", ["duration_s=240"])
LIFT_SEEDS = (2, 3)  # with seed 1 the floors are joined while they are mapped (docs/floors.md)


def run(tutti, *words):
    done = subprocess.run([str(tutti), *[str(word) for word in words]], capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(str(word) for word in words)}: {done.stderr}")


def remembered(keep, what, make):
    """make(), or what it was the last time."""
    kept = pathlib.Path(keep) / (hashlib.sha256(json.dumps(what).encode()).hexdigest()[:16] + ".json") if keep else None
    if kept and kept.exists():
        return json.loads(kept.read_text())
    made = make()
    if kept:
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_text(json.dumps(made))
    return made


class Runs:
    """A mission's robots in the map that the others of them made."""
    def __init__(self, arguments, mission, kind, mapping):
        self.tutti, self.keep = arguments.tutti, arguments.keep
        self.mission, self.mapping = mission, mapping
        self.data = ["--data", pathlib.Path(arguments.shared) / "data"] if kind == "real" else []

    def mapped(self, folder, seed):
        """The map, and what names the mission."""
        common = [mission_file(self.mission), "--seed", seed, *self.data]
        settings = [word for one in self.mapping for word in ("--set", one)]
        run(self.tutti, "run", *common, *settings, "--map", folder / "map.tutti", "-o", folder / "mapped")
        return folder / "map.tutti", common

    def localised(self, seed):
        """The robots' figures of localise.json: of one start, where robots forget their place every RESTART_S, and where those
        with LiDAR are carried elsewhere every KIDNAP_S."""
        trials = {"once": [], "often": ["--restart-every", RESTART_S], "carried": ["--kidnap-every", KIDNAP_S]}
        if self.mission in CAMERAS:
            del trials["carried"]
        return self.tried(seed, trials)

    def tried(self, seed, trials):
        def make():
            with tempfile.TemporaryDirectory() as folder:
                folder = pathlib.Path(folder)
                known, common = self.mapped(folder, seed)
                for name, more in trials.items():
                    run(self.tutti, "run", *common, "--map-in", known, "--frozen", *more, "-o", folder / name)
                return [json.loads((folder / name / "localise.json").read_text())["robots"] for name in trials]
        return remembered(self.keep, [self.mission, self.mapping, seed, trials], make)


def percent(value):
    return f"{100 * value:.0f} %"


def cells(robots):
    scores = [robot["score"] for robot in robots if robot["score"] and robot["score"]["scored"]]
    scored = sum(score["scored"] for score in scores)
    mean = lambda values: sum(values) / len(values) if values else None
    shown = lambda value, digits, unit="": "-" if value is None else f"{value:.{digits}f}{unit}"
    rmse = lambda key: shown((sum(s[key] ** 2 * s["scored"] for s in scores) / scored) ** 0.5 if scored else None, 3, " m")
    sigma = [mean([s["within_sigma"][k] for s in scores]) for k in range(3)]
    timing = [robot["timing"] for robot in robots]
    return [shown(mean([t["first_fix_cpu_s"] for t in timing if t["first_fix_cpu_s"]]), 1, " s"),
            percent(mean([robot["share_of_time"]["localised"] for robot in robots])),
            percent(mean([robot["share_of_time"]["ambiguous"] for robot in robots])),
            f"{sum(s['wrong'] for s in scores)} of {scored}", rmse("rmse_m"), rmse("map_rmse_m"), rmse("in_map_rmse_m"),
            shown(max((s["max_m"] for s in scores), default=None), 3, " m"),
            "-" if sigma[0] is None else " / ".join(f"{value:.2f}" for value in sigma),
            shown(mean([t["scan_ms_median"] for t in timing if t["scan_ms_median"]]), 1, " ms")]


def start_cells(once, often):
    """Of all starts; a submap that begins with one is over after 10 s."""
    starts = [start["fix_after_s"] for robots in (once, often) for robot in robots for start in robot["starts"]]
    fixes = sorted(after for after in starts if after is not None)
    scores = [robot["score"] for robot in often if robot["score"]]
    in_one = sum(after <= ONE_SUBMAP_S for after in fixes)
    return [str(len(starts)), str(len(fixes)), f"{fixes[len(fixes) // 2]:.1f} s" if fixes else "-",
            percent(in_one / len(starts)), f"{sum(s['wrong'] for s in scores)} of {sum(s['scored'] for s in scores)}"]


def kidnap_cells(robots):
    kidnaps = [kidnap for robot in robots for kidnap in robot["kidnaps"]]
    said = [kidnap["said_after_s"] for kidnap in kidnaps if kidnap["said_after_s"] is not None]
    found = sorted(kidnap["found_after_s"] for kidnap in kidnaps if kidnap["found_after_s"] is not None)
    scores = [robot["score"] for robot in robots if robot["score"]]
    return [str(len(kidnaps)), str(sum(after <= SAID_S for after in said)), f"{max(said):.1f} s" if said else "-",
            str(len(found)), f"{found[len(found) // 2]:.1f} s" if found else "-", f"{found[-1]:.1f} s" if found else "-",
            f"{sum(s['wrong'] for s in scores)} of {sum(s['scored'] for s in scores)}"]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tutti")
    parser.add_argument("--shared", required=True, help="folder with data/")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--keep", help="folder for what was measured")
    arguments = parser.parse_args()
    starts = [row("map and robots", "input", "starts", "fixes", "after (median)", "in one submap", "wrong"),
              row("---", "---", *["---:"] * 5)]
    table = [row("map and robots", "input", "CPU until the first fix", "localised", "ambiguous", "wrong", "error", "the map's own",
                 "in the map", "worst", "within 1 / 2 / 3 sigma", "CPU a scan"), row("---", "---", *["---:"] * 10)]
    carried = [row("map and robots", "input", "kidnaps", f"said within {SAID_S} s", "said, worst", "found again", "after (median)", "worst",
                   "wrong"), row("---", "---", *["---:"] * 7)]
    for name, mission, kind, all_seeds, mapping in CASES:
        once, often, taken = [], [], []
        for seed in range(1, (arguments.seeds if all_seeds else 1) + 1):
            for robots, found in zip((once, often, taken), Runs(arguments, mission, kind, mapping).localised(seed)):
                robots += found
        table.append(row(name, kind, *cells(once)))
        starts.append(row(name, kind, *start_cells(once, often)))
        if taken:
            carried.append(row(name, kind, *kidnap_cells(taken)))
    name, mission, kind, mapping = LIFT
    ridden = [Runs(arguments, mission, kind, mapping).tried(seed, {"lift": ["--lift"]})[0] for seed in LIFT_SEEDS]
    carried.append(row(name, kind, *kidnap_cells([robot for robots in ridden for robot in robots])))
    write_results("localise.md", page(
        "Robots in a map that does not move",
        ["Asked was whether a robot without a start pose finds itself in a map that others made, whether it follows it, and whether it",
         "ever says that it is where it is not."],
        table,
        ["bench/accuracy/localise.py build/ci/apps/tutti/tutti --shared ../shared"],
        "Robots started once. *localised*, *ambiguous*: share of the whole time. *wrong*: published poses that are off by more than 1 m",
        "or 5 degrees. *error*: RMSE of the published poses against the reference, which the robots that made the map tie to it; nothing of",
        "the robot that is scored does. *the map's own*: what the map itself errs by at these places. *in the map*: RMSE without that,",
        "against what the map shows about the robot, which is what its covariance is of (*sigma*: shares along x, y and z).",
        "*worst* is of *error*. CPU is of this machine (2 cores, other work beside it).",
        "",
        "## Starts",
        "",
        *starts,
        "",
        f"Here robots also forgot every {RESTART_S} s where they were, and searched the whole map again. *in one submap*: share of the starts",
        f"that were a fix within {ONE_SUBMAP_S} s, as the first submap is 10 s of driving. *wrong* is of the runs with many starts.",
        "",
        "Where corridors look the same, a robot says so and names the places; it does not guess.",
        "",
        "## Kidnapped",
        "",
        *carried,
        "",
        f"Here robots were carried every {KIDNAP_S} s to where they would be 20 s later, 5 m away at least, which their odometry did not notice",
        "(`--kidnap-every`). Those count that were localised when they were taken. *wrong* is without what was published until it was said.",
        "The lift takes 20 s, in which nothing can be found, and leads to another floor (`--lift`, [floors.md](../floors.md)).",
        "",
        "Said within 2 s, and found within one more submap, was asked of all: missed where scans of the new place half fit the map at the old",
        "one, and where corridors look the same a robot that was carried to such a place does not notice.",
        "",
        "## What is missing",
        "",
        "KITTI and KAIST are at hand as trajectories without scans. Their closures are made from the truth, so a robot that is laid into a",
        "map by them shows what the solver makes of given closures, and nothing of finding a place: no row here. Of EuRoC V1_01's tracks are",
        "at hand, and 100 of its stereo pairs, which are too far apart to follow points. There the covariance is too small: 0.92 and 0.98 of",
        "the errors are within three sigma.",
        "",
        "Not measured yet: ten thousand starts ([starts.md](starts.md) has hundreds), PCL's NDT and GICP beside it.",
        "Moved furniture is in [map-versions.md](../map-versions.md).",
    ))


if __name__ == "__main__":
    main()
