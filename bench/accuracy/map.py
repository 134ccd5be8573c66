#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""How good the map itself is: the server's error over that of a perfect judge (docs/report.md, perfect_rmse_m), at the end and
at the worst instant, on missions whose wrong closures are known. Writes docs/results/map.md.

Usage: bench/accuracy/map.py TUTTI_PROGRAM --shared FOLDER [--before OTHER_TUTTI] [--jobs 2] [--out FOLDER]
FOLDER holds data/ (docs/data.md) and cases/. With --before every run is made by the other program, too. Runs that are
finished in --out are not made again.
"""
import argparse
import concurrent.futures
import pathlib
import statistics

from runs import mission_file, outcome_of, page, row, write_results

REFERENCE = ["closures.verifier=reference", "simulation.sensors=none"]
# name: (mission file below the shared folder or a mission's name, seeds, settings)
CASES = {
    "v1_two_flights": ("cases/rooms/v1_two_flights.yaml", range(1, 6), []),
    "v2_three_flights": ("cases/rooms/v2_three_flights.yaml", range(1, 6), []),
    "euroc_mh": ("euroc_mh", range(1, 4), []),
    "kitti_00_halves": ("kitti_00_halves", [*range(1, 6), 9, 13], []),
    "kitti_02_halves": ("kitti_02_halves", range(1, 3), []),
    "kitti_00_05": ("kitti_00_05", range(1, 3), []),
    "kitti_05_halves": ("kitti_05_halves", range(1, 3), []),
    "kitti_07_halves": ("kitti_07_halves", range(1, 3), []),
    "spin": ("spin", range(1, 5), []),
    "height": ("height", range(1, 4), []),
    "terrace *": ("terrace", [*range(1, 7), 16], REFERENCE),
    "terrace *, 30 % wrong": ("terrace", range(1, 3), REFERENCE + ["closures.reference.wrong_share=0.3"]),
    "revision": ("revision", range(1, 3), []),
    "late": ("late", range(1, 3), []),
}


def run(program, label, name, seed, arguments):
    path, _, settings = CASES[name]
    mission = pathlib.Path(arguments.shared) / path if "/" in path else mission_file(path)
    out = pathlib.Path(arguments.out) / f"{label}_{name.replace(' ', '_')}_{seed}"
    command = [program, "run", mission, "--data", pathlib.Path(arguments.shared) / "data", "--seed", seed, "--threads", 1]
    for setting in settings:
        command += ["--set", setting]
    report, timing = outcome_of(out, *command)
    report["cpu_s"] = timing["server"]["load"]["map_cpu_s"]
    return report


def errors(report):
    return [robot["server_rmse_m"] for robot in report["robots"]]


def spread(values):
    values = sorted(values)
    return "-" if not values else f"{values[0]:.3f}" if values[0] == values[-1] else f"{values[0]:.3f} to {values[-1]:.3f}"


def spread_of(counts):
    return f"{min(counts)}" if min(counts) == max(counts) else f"{min(counts)} to {max(counts)}"


def median_of_robots(reports, of):
    """Per robot the median over the seeds."""
    per_robot = zip(*[of(report) for report in reports])
    return ", ".join("-" if None in values else f"{statistics.median(values):.3f}" for values in per_robot)


def changes_of_mind(reports):
    """All seeds and robots: how often the map changed its mind."""
    return sum(len(report["server"]["changes_of_mind"]) for report in reports)


def counts(reports):
    server = [report["server"] for report in reports]
    accepted = [s["closures_accepted"] for s in server]
    wrong = sum((s["closure_check"] or {"wrong": 0})["wrong"] for s in server)
    return f"{min(accepted)} to {max(accepted)} ({wrong})"


def ratios(reports, of, to):
    return [mine / theirs for report in reports for mine, theirs in zip(of(report), to(report)) if mine and theirs]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tutti")
    parser.add_argument("--shared", required=True)
    parser.add_argument("--before")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", default="out/map")
    arguments = parser.parse_args()
    programs = ([("before", arguments.before)] if arguments.before else []) + [("after", arguments.tutti)]
    jobs = [(program, label, name, seed) for name, (_, seeds, _) in CASES.items() for seed in seeds
            for label, program in programs]
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        reports = dict(zip([job[1:] for job in jobs], pool.map(lambda job: run(*job, arguments), jobs)))

    def of(label, name):
        return [reports[label, name, seed] for seed in CASES[name][1]]

    def perfect(report):
        return [robot["perfect_rmse_m"] for robot in report["robots"]]

    def worst(key):
        def of_report(report):
            instants = [robot[key] for robot in report["robots"] if robot[key]]
            return [m["rmse_m"] - m["onboard_rmse_m"] for m in instants]
        return of_report

    table = [row("mission", "seeds", *(f"{label}: accepted (wrong)" for label, _ in programs),
                 "odometry", *(label for label, _ in programs), "perfect", "over perfect",
                 "changes of mind", "maps", "CPU s", "worst instant: map", "corrected"),
             row(*["---"] * (11 + 2 * (len(programs) - 1) + 1))]
    everything = {label: [] for label, _ in programs}
    for name in CASES:
        after = of("after", name)
        seeds = CASES[name][1]
        for label, _ in programs:
            mine = [errors(report) for report in of(label, name)]
            everything[label] += [m / p for own, report in zip(mine, after) for m, p in zip(own, perfect(report)) if m and p]
        harm = [max([value for report in after for value in worst(key)(report)], default=None)
                for key in ("worst_server", "worst_corrected")]
        table.append(row(name, len(list(seeds)), *(counts(of(label, name)) for label, _ in programs),
                         median_of_robots(after, lambda r: [robot["onboard_rmse_m"] for robot in r["robots"]]),
                         *(median_of_robots(of(label, name), errors) for label, _ in programs),
                         median_of_robots(after, perfect), spread(ratios(after, errors, perfect)), changes_of_mind(after),
                         spread_of([report["server"]["components"] for report in after]),
                         f"{statistics.median(report['cpu_s'] for report in after):.1f}",
                         *("-" if value is None else f"{value:.3f}" for value in harm)))
    over = []
    for label, values in everything.items():
        values.sort()
        over.append(f"Over perfect, all {len(values)} robots, {label}: median {statistics.median(values):.3f}, "
                    f"p90 {values[int(0.9 * (len(values) - 1))]:.3f}, worst {values[-1]:.3f}.")
    text = page(
        "How good the map is",
        ["Asked was a map as good as that of a judge who knows which closures are wrong: RMSE over that judge's at most 1.02 in the median,",
         "1.10 at the 90th percentile, 1.5 at worst.", "", *over],
        table,
        ["bench/accuracy/map.py TUTTI --shared FOLDER" + (" --before OTHER" if arguments.before else "")],
        "Trajectories only, closures from the truth with noise, one in ten wrong unless stated (`*`: instead of LiDAR's). Odometry",
        "of EuRoC and KITTI is real and replayed, the rest simulated. RMSE of each robot's part of the server's map, m,",
        "aligned alone, median of the seeds; *perfect*: of the map of a judge who knows by the reference which closures are",
        "wrong (docs/report.md). Over perfect: all robots and seeds at the end. Changes of mind: updates in which the map differed",
        "from the one a robot followed by more than three of its own standard deviations. Maps: at the end. CPU: the server's without",
        "verification, median of the seeds. Worst instant: by how many metres the map, and the robot corrected by it, were worse than",
        "raw odometry at most while the mission ran (below 0: never).")
    write_results("map.md", text)


if __name__ == "__main__":
    main()
