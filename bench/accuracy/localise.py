#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes docs/results/localise.md: robots in maps that do not move.

Usage: bench/accuracy/localise.py TUTTI_PROGRAM --shared FOLDER [--seeds 3] [--pcl PROGRAM] [--keep FOLDER]

--pcl: tutti_beside_pcl, which is built with TUTTI_BUILD_BENCH where CMake finds PCL. Only the section about it is made anew
then, and without it that section stays as it is. --keep: what is in this folder is not measured again (use a new one for a
new program).
"""
import argparse
import dataclasses
import json
import pathlib
import subprocess
import tempfile

from runs import SOURCE, mission_file, page, remembered, row, write_results

LATE = 100000
LIDAR = "simulation.lidar.model="
CAMERAS = ("hall", "euroc_v101_halves")
RESTART_S, KIDNAP_S, ONE_SUBMAP_S, SAID_S = 30, 30, 12, 2


@dataclasses.dataclass
class Case:
    """Robots in the map that others of a mission made."""
    name: str
    mission: str
    kind: str  # real or simulated
    mapping: list  # what is set while it is mapped
    later: list = dataclasses.field(default_factory=list)  # and afterwards
    all_seeds: bool = False
    beside: bool = False  # PCL follows these robots, too


def tunnel(name, mapping=(), later=(), **more):
    """The tunnel's map of four minutes, and other robots in it."""
    return Case(name, "next_day", "simulated", ["duration_s=240", *mapping], list(later), **more)


def halves(name, mission, late_robot, **more):
    """One robot of two maps, and the other is found."""
    return Case(name, mission, "real", [f"robots.{late_robot}.start_s={LATE}", "duration_s=130"], **more)


CASES = [
    halves("HKU session 2 in session 1's map", "hku_two_sessions", 1, beside=True),
    halves("HKU session 1 in session 2's map", "hku_two_sessions", 0, beside=True),
    halves("EuRoC V1_01, its second half in its first's map, cameras", "euroc_v101_halves", 1),
    halves("EuRoC V1_01, its first half in its second's map, cameras", "euroc_v101_halves", 0),
    tunnel("a tunnel, four minutes, other robots", all_seeds=True, beside=True),
    tunnel("the tunnel on another day: 20 % of its walls gone, all things elsewhere", all_seeds=True,
           later=["simulation.surface.changed_share=0.2"]),
    tunnel("the tunnel, mapped with 16 beams, found with 64", later=[LIDAR + "64-beam"]),
    tunnel("the tunnel, mapped with 64 beams, found with 16", mapping=[LIDAR + "64-beam"]),
    tunnel("the tunnel, mapped with 16 beams, found with a rosette", later=[LIDAR + "rosette"]),
    tunnel("the tunnel, mapped with 16 beams, found with a narrow LiDAR ahead", later=[LIDAR + "narrow"]),
    tunnel("the tunnel, mapped with 16 beams, found with a narrow LiDAR crosswise", later=[LIDAR + "narrow-left"]),
    Case("a hall with LiDARs, four boxes more", "hall_next", "simulated", ["duration_s=500"], ["hall.boxes=40"], all_seeds=True),
    Case("a hall, three flights with cameras alone", "hall", "simulated", [f"hall.robots.2.start_s={LATE}", "duration_s=130"],
         all_seeds=True),
    Case("a regular grid of look-alike corridors, twenty starts", "look_alike", "simulated", ["duration_s=480"], beside=True),
]
LIFT = Case("a lift between two floors", "floors", "simulated", ["duration_s=240"])
AGAINST_DEG = 120
LIFT_SEEDS = (2, 3)  # with seed 1 the floors are joined while they are mapped (docs/floors.md)
BESIDE = "## PCL's NDT and GICP beside it"
METHODS = ("Tutti", "NDT", "GICP")
AT_THE_END_S = 5
BESIDE_COMMAND = ("bench/accuracy/localise.py build/bench/apps/tutti/tutti --shared ../shared "
                  "--pcl build/bench/bench/accuracy/tutti_beside_pcl")
BESIDE_ASKED = [
    "Asked was what registration alone does on the same runs, as its users set it up: PCL's NDT and GICP (1.13, Debian 12). All robots",
    "are given their true start pose, Tutti's too (`--true-start`); seed 1.",
]
BESIDE_WORDS = [
    "NDT and GICP have the defaults of lidar_localization_ros2, which calls these classes: NDT with cells of 1 m and steps of 0.1 m on",
    "the map's whole cloud (as `tutti export` writes it), GICP with 20 neighbours and correspondences of 2 m at most on the same, thinned",
    "to 0.2 m; scans thinned to 0.2 m, 35 iterations, epsilon 0.01. Published is what has converged with a fitness (mean squared distance",
    "to the map) of 2 m2 at most. Odometry predicts the next pose, which is better than the last motion that those users have. The",
    "same scans are registered (five a second at most), without points beyond the 60 m that the map keeps.",
    "",
    "*published*: share of the time; Tutti publishes ten poses a second, PCL one a scan. *error*, *in the map*, *worst* as above. *right at",
    "the end*: robots whose last pose that is not wrong is from their last 5 s. *CPU a scan*: median, of one thread; *times Tutti's* is of",
    "the same runs. PCL's has undistortion, thinning, registration and fitness in it, Tutti's all that its node does with a scan.",
    "",
    "The same robots, carried elsewhere every 30 s as above. *wrong since*: of all that was published since the first kidnap, what came",
    "before a robot said that it was lost, too.",
]
BESIDE_CARRIED = [
    "From a given start and left alone none of the three is ever wrong here. PCL is better than Tutti in these figures: NDT errs less in",
    "the tunnel and in the grid (0.041 and 0.109 m for 0.052 and 0.179 m), GICP in the tunnel; NDT's worst pose is nearer in both, GICP's in",
    "the tunnel; PCL publishes from the first scan on, Tutti when three more have confirmed the start; GICP's p99 is lower, as Tutti's has",
    "the merging of its submaps in it. Without what the map itself errs by Tutti is nearer everywhere, and it needs a half to a third of the",
    "CPU.",
    "",
    "After a kidnap NDT mostly falls silent for good, which is no wrong pose and no right one. There Tutti is worse in its share of wrong",
    "poses: it publishes for a second or two until it says that it is lost. GICP found itself again in the map of HKU session 1, which is",
    "15 m wide, with a smaller share of wrong poses than Tutti, and elsewhere never. In the grid runs end 10 s after the kidnap, and all that",
    "any of the three published since is wrong: Tutti's until they said that they were not there, each within 1.7 s, and none of them",
    "believed to be found again. In all other runs Tutti said each kidnap within 2 s, too.",
]


def run(program, *words):
    done = subprocess.run([str(program), *[str(word) for word in words]], capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(str(word) for word in words)}: {done.stderr}")


class Runs:
    """The runs of a case."""
    def __init__(self, arguments, case):
        self.tutti, self.pcl, self.keep = arguments.tutti, arguments.pcl, arguments.keep
        self.mission, self.mapping, self.later = case.mission, set_words(case.mapping), set_words(case.later)
        self.data = ["--data", pathlib.Path(arguments.shared) / "data"] if case.kind == "real" else []

    def mapped(self, folder, seed):
        """The map, and what names the mission."""
        common = [mission_file(self.mission), "--seed", seed, *self.data]
        run(self.tutti, "run", *common, *self.mapping, "--map", folder / "map.tutti", "-o", folder / "mapped")
        return folder / "map.tutti", [*common, *self.later]

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
                return [robots_of(folder / name) for name in trials]
        return remembered(self.keep, [self.mission, self.mapping, self.later, seed, trials], make)

    def beside_pcl(self):
        """By method, the figures of robots that are given their start pose; left alone, and carried elsewhere."""
        def make():
            with tempfile.TemporaryDirectory() as folder:
                folder = pathlib.Path(folder)
                known, common = self.mapped(folder, 1)
                return [{method: self.given_start(method, folder / method, known, common, more) for method in METHODS}
                        for more in ([], ["--kidnap-every", KIDNAP_S])]
        return remembered(self.keep, [self.mission, self.mapping, *METHODS], make)

    def given_start(self, method, out, known, common, more):
        program = [self.tutti, "run", "--frozen", "--true-start"] if method == "Tutti" else [self.pcl, "--method", method]
        run(*program, *common, "--map-in", known, *more, "--out", out)
        return robots_of(out)


def set_words(settings):
    return [word for one in settings for word in ("--set", one)]


def robots_of(folder):
    return json.loads((folder / "localise.json").read_text())["robots"]


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
            shown(mean([100 * r["fresh_share_since_fix"] for r in robots if r["fresh_share_since_fix"] is not None]), 1, " %"),
            f"{sum(s['wrong'] for s in scores)} of {scored}", rmse("rmse_m"), rmse("map_rmse_m"), rmse("in_map_rmse_m"),
            shown(max((s["max_m"] for s in scores), default=None), 3, " m"),
            "-" if sigma[0] is None else " / ".join(f"{value:.2f}" for value in sigma),
            " / ".join(shown(mean([t[key] for t in timing if t[key]]), digits, unit)
                       for key, digits, unit in (("scan_ms_median", 1, ""), ("scan_ms_p99", 0, " ms")))]


def start_cells(once, often):
    """The cells of all starts; a submap that begins with one is over after 10 s."""
    all_starts = [start for robots in (once, often) for robot in robots for start in robot["starts"]]
    starts = [start["fix_after_s"] for start in all_starts]
    fixes = sorted(after for after in starts if after is not None)
    against = [start["fix_after_s"] for start in all_starts if (start["turned_deg"] or 0.0) >= AGAINST_DEG]
    scores = [robot["score"] for robot in often if robot["score"]]
    in_one = sum(after <= ONE_SUBMAP_S for after in fixes)
    return [str(len(starts)), str(len(fixes)), f"{fixes[len(fixes) // 2]:.1f} s" if fixes else "-",
            percent(in_one / len(starts)),
            f"{sum(after is not None for after in against)} of {len(against)}" if against else "-",
            f"{sum(s['wrong'] for s in scores)} of {sum(s['scored'] for s in scores)}"]


def kidnap_cells(robots):
    kidnaps = [kidnap for robot in robots for kidnap in robot["kidnaps"]]
    said = [kidnap["said_after_s"] for kidnap in kidnaps if kidnap["said_after_s"] is not None]
    found = sorted(kidnap["found_after_s"] for kidnap in kidnaps if kidnap["found_after_s"] is not None)
    scores = [robot["score"] for robot in robots if robot["score"]]
    return [str(len(kidnaps)), str(sum(after <= SAID_S for after in said)), f"{max(said):.1f} s" if said else "-",
            str(len(found)), f"{found[len(found) // 2]:.1f} s" if found else "-", f"{found[-1]:.1f} s" if found else "-",
            f"{sum(s['wrong'] for s in scores)} of {sum(s['scored'] for s in scores)}"]


def right_at_the_end(robot):
    score = robot["score_since_kidnap"] or robot["score"]
    return score["right_last_s"] is not None and robot["duration_s"] - score["right_last_s"] <= AT_THE_END_S


def beside_cells(robots, key, cpu_ms):
    """The cells of one method's robots, by the scores under `key`."""
    scores = [robot[key] for robot in robots if robot[key] and robot[key]["scored"]]
    scored, wrong = sum(score["scored"] for score in scores), sum(score["wrong"] for score in scores)
    published = [f"{wrong} of {scored}", percent(wrong / scored) if scored else "-"]
    found = f"{sum(right_at_the_end(robot) for robot in robots)} of {len(robots)}"
    if key == "score_since_kidnap":
        return [str(sum(len(robot["kidnaps"]) for robot in robots)), *published, found]
    _, localised, _, _, error, _, in_map, worst, _, _ = cells(robots)
    median, p99 = [median_of(robots, which) for which in ("scan_ms_median", "scan_ms_p99")]
    return [localised, *published, error, in_map, worst, found, f"{median:.1f} ms", f"{median / cpu_ms:.1f}", f"{p99:.0f} ms"]


def median_of(robots, key):
    values = sorted(robot["timing"][key] for robot in robots)
    return values[len(values) // 2]


def beside_section(arguments):
    """The lines below BESIDE."""
    alone = [row("map and robots", "input", "by", "published", "wrong", "share", "error", "in the map", "worst", "right at the end",
                 "CPU a scan", "times Tutti's", "p99"), row("---", "---", "---", *["---:"] * 10)]
    carried = [row("map and robots", "input", "by", "kidnaps", "wrong since", "share", "right at the end"),
               row("---", "---", "---", *["---:"] * 4)]
    for case in (case for case in CASES if case.beside):
        left, taken = Runs(arguments, case).beside_pcl()
        cpu_ms = median_of(left["Tutti"], "scan_ms_median")
        alone += [row(case.name, case.kind, method, *beside_cells(left[method], "score", cpu_ms)) for method in METHODS]
        carried += [row(case.name, case.kind, method, *beside_cells(taken[method], "score_since_kidnap", cpu_ms)) for method in METHODS]
    return [*BESIDE_ASKED, "", *alone, "", "```sh", BESIDE_COMMAND, "```", "", *BESIDE_WORDS, "", *carried, "", *BESIDE_CARRIED]


def page_file():
    return SOURCE / "docs" / "results" / "localise.md"


def around_beside(text):
    """The page before BESIDE, the lines below it, and the page from the next heading on."""
    before, _, rest = text.partition(BESIDE + "\n\n")
    lines, heading, after = rest.partition("\n## ")
    return before, lines.rstrip("\n").split("\n"), heading.lstrip("\n") + after


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tutti")
    parser.add_argument("--shared", required=True, help="folder with data/")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--pcl", help="tutti_beside_pcl: its section alone is made anew")
    parser.add_argument("--keep", help="folder for what was measured")
    arguments = parser.parse_args()
    before, beside, after = around_beside(page_file().read_text())
    if arguments.pcl:
        return write_results("localise.md", [before + BESIDE, "", *beside_section(arguments), "", after])
    starts = [row("map and robots", "input", "starts", "fixes", "after (median)", "in one submap", "against the map's robots", "wrong"),
              row("---", "---", *["---:"] * 6)]
    table = [row("map and robots", "input", "CPU until the first fix", "localised", "ambiguous", "fresh", "wrong", "error", "the map's own",
                 "in the map", "worst", "within 1 / 2 / 3 sigma", "CPU a scan (median / p99)"), row("---", "---", *["---:"] * 11)]
    carried = [row("map and robots", "input", "kidnaps", f"said within {SAID_S} s", "said, worst", "found again", "after (median)", "worst",
                   "wrong"), row("---", "---", *["---:"] * 7)]
    for case in CASES:
        once, often, taken = [], [], []
        for seed in range(1, (arguments.seeds if case.all_seeds else 1) + 1):
            for robots, found in zip((once, often, taken), Runs(arguments, case).localised(seed)):
                robots += found
        table.append(row(case.name, case.kind, *cells(once)))
        starts.append(row(case.name, case.kind, *start_cells(once, often)))
        if taken:
            carried.append(row(case.name, case.kind, *kidnap_cells(taken)))
    ridden = [Runs(arguments, LIFT).tried(seed, {"lift": ["--lift"]})[0] for seed in LIFT_SEEDS]
    carried.append(row(LIFT.name, LIFT.kind, *kidnap_cells([robot for robots in ridden for robot in robots])))
    write_results("localise.md", page(
        "Robots in a map that does not move",
        ["Asked was whether a robot without a start pose finds itself in a map that others made, whether it follows it, and whether it",
         "ever says that it is where it is not."],
        table,
        ["bench/accuracy/localise.py build/ci/apps/tutti/tutti --shared ../shared"],
        "Robots started once. *localised*, *ambiguous*: share of the whole time. *fresh*: share of the time since the first fix with a pose",
        "that the map has shown within 0.2 s. *wrong*: published poses that are off by more than 1 m or 5 degrees. *error*: RMSE of the",
        "published poses against the reference, which the robots that made the map tie to it; nothing of the robot that is scored does. *the",
        "map's own*: what the map itself errs by at these places. *in the map*: RMSE without that, against what the map shows about the robot,",
        "which is what its covariance is of (*sigma*: shares along x, y and z). *wrong* and *worst* are of these, too. CPU is of this machine",
        "(2 cores, other work beside it).",
        "",
        "## Starts",
        "",
        *starts,
        "",
        f"Here robots also forgot every {RESTART_S} s where they were, and searched the whole map again. *in one submap*: share of the starts",
        f"that were a fix within {ONE_SUBMAP_S} s, as the first submap is 10 s of driving. *against the map's robots*: fixes of the starts at which,",
        f"within 2 m, no robot of the map has ever looked less than {AGAINST_DEG} degrees away from where this one does. *wrong* is of the runs",
        "with many starts.",
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
        "Said within 2 s, and found within one more submap, was asked of all. A robot that was carried to where corridors look the same may not",
        "notice, and one that sees little, or the same in several places, takes more than one submap to be found.",
        "",
        BESIDE,
        "",
        *beside,
        "",
        "## What is missing",
        "",
        "KITTI and KAIST are at hand as trajectories without scans. Their closures are made from the truth, so a robot that is laid into a",
        "map by them shows what the solver makes of given closures, and nothing of finding a place: no row here. EuRoC V1_01 is at hand as",
        "tracks, and as 100 of its stereo pairs, which are too far apart to follow points. There the covariance is too small (*sigma*).",
        "",
        "Thousands of starts are in [starts.md](starts.md).",
    ))


if __name__ == "__main__":
    main()
