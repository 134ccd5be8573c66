#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs the real fleets of COSMO-Bench as missions, with the policies side by side, and writes docs/results/fleets.md.

Usage: bench/accuracy/fleets.py TUTTI_PROGRAM --data FOLDER [--jobs 2] [--out FOLDER] [--quick]
       bench/accuracy/fleets.py TUTTI_PROGRAM --data FOLDER --forms FOLDER [--graphs FOLDER] [--jobs 2]
FOLDER/cosmo holds the graphs (docs/data.md). Runs that are finished in --out are not made again. --quick prints the same of
the shortest fleet. --forms optimises each fleet as a graph in 13 forms (forms.py) instead, keeps what it writes in that folder,
and prints how near every map comes to a perfect judge's; with --graphs, of the graphs in that folder instead.
"""
import argparse
import bisect
import concurrent.futures
import csv
import math
import pathlib
import statistics

import forms
import graph_scores
from runs import compare, outcome_of, page, row, write_results

FLEETS = {
    "kth wifi": "kth_r3_00_d06_d09_d10_wifi",
    "kth proradio": "kth_r3_00_d06_d09_d10_proradio",
    "tuhh wifi": "tuhh_r3_00_day_wifi",
    "tuhh proradio": "tuhh_r3_00_day_proradio",
}
COMPETITORS = ["spectral", "every_node", "skeleton"]
LIMITS = [f"closure_check.wrong_m={graph_scores.WRONG_M:g}", f"closure_check.wrong_deg={graph_scores.WRONG_DEG:g}"]
SUBMAP_S, SUBMAP_M = 10.0, 20.0  # agent.submap.duration_s, distance_m
EVERY_S = 60.0


class Graph:
    """A PyFG file: stamps and odometry by name, closures with their arrival, labels."""

    def __init__(self, path):
        self.stamp, self.closures, step = {}, [], {}
        for line in path.read_text().splitlines():
            word = line.split()
            if word[0] == "VERTEX_SE3:QUAT":
                self.stamp[word[2]] = float(word[1])
            elif word[0] == "EDGE_SE3:QUAT":
                a, b = word[2:4]
                if a[0] == b[0] and int(b[1:]) == int(a[1:]) + 1:
                    step[b] = math.hypot(*map(float, word[4:7]))
                else:
                    self.closures.append((a, b, float(word[1])))
        self.begin = min(self.stamp.values())
        self.wrong = {tuple(line.split()) for line in pathlib.Path(f"{path}.wrong").read_text().splitlines()}
        self.submap, self.ends = {}, {}
        self.cut(step)

    def cut(self, step):
        """Submaps as robots end them: a keyframe that two share counts for the earlier one."""
        for robot in {name[0] for name in self.stamp}:
            names = sorted((name for name in self.stamp if name[0] == robot), key=lambda name: int(name[1:]))
            number, since_s, distance_m, open_ = 0, self.stamp[names[0]], 0.0, []
            for name in names:
                distance_m += step.get(name, 0.0)
                open_.append(name)
                if self.stamp[name] - since_s >= SUBMAP_S or distance_m >= SUBMAP_M or name == names[-1]:
                    for one in open_:
                        self.submap[one], self.ends[one] = (robot, number), self.stamp[name]
                    number, since_s, distance_m, open_ = number + 1, self.stamp[name], 0.0, []

    def joins_submaps(self, closure):
        return self.submap[closure[0]] != self.submap[closure[1]]


def accepted_edges(out):
    """Pairs of names that closures of the final map join."""
    with open(out / "graph_stamps.csv", newline="") as stamps:
        rows = list(csv.DictReader(stamps))
    letters = {}
    for line in rows:
        letters.setdefault(line["robot"].split(":")[0], None)
    letters = {robot: chr(ord("a") + i) for i, robot in enumerate(sorted(letters, key=int))}
    name = {line["id"]: letters[line["robot"].split(":")[0]] + line["keyframe"] for line in rows}
    edges = set()
    for line in (out / "graph.g2o").read_text().splitlines():
        word = line.split()
        if word and word[0].startswith("EDGE"):
            edges.add(frozenset((name[word[1]], name[word[2]])))
    return edges


def corrections(report, graph, accepted):
    """Seconds from a closure's arrival to the first map with it on each robot that it joins."""
    updates = [update["time_s"] for update in report["server"]["course"]]
    heard = {robot["name"]: [update["time_s"] for update in robot["course"]] for robot in report["robots"]}
    out = []
    for a, b, arrived in graph.closures:
        if frozenset((a, b)) not in accepted or not graph.joins_submaps((a, b)):
            continue
        known_s = max(arrived, graph.ends[a], graph.ends[b]) - graph.begin
        update = bisect.bisect_left(updates, known_s)
        for robot in {a[0], b[0]}:
            at = bisect.bisect_left(heard[robot], updates[update]) if update < len(updates) else len(heard[robot])
            if at < len(heard[robot]):
                out.append(heard[robot][at] - (arrived - graph.begin))
    return sorted(out)


def quantile(values, share):
    return values[min(len(values) - 1, int(share * len(values)))]


def metres(value):
    return "-" if value is None else f"{value:.2f}"


def seconds(values):
    return f"{statistics.median(values):.1f}, {quantile(values, 0.99):.1f}" if values else "-"


def robots_table(reports):
    policies = list(next(iter(reports.values()))["robots"][0]["policies"])
    lines = [row("fleet", "robot", "distance", "odometry", "map", "perfect judge", *(f"{p}" for p in policies), "kB up", "kB down"),
             row(*["---"] * (8 + len(policies)))]
    for fleet, report in reports.items():
        for robot in report["robots"]:
            own = [robot["policies"][policy] for policy in policies]
            lines.append(row(fleet, robot["name"], f"{robot['distance_m']:.0f} m", metres(robot["onboard_rmse_m"]),
                             metres(robot["server_rmse_m"]), metres(robot["perfect_rmse_m"]),
                             *(f"{metres(p['rmse_m'])} ({p['constraints']})" for p in own),
                             f"{robot['bytes_up'] / 1e3:.0f}", f"{robot['bytes_down'] / 1e3:.0f}"))
    return lines


def closures_of(graph, accepted):
    """Right and wrong ones that the map has, of those that there are, and those within one submap."""
    joining = [closure for closure in graph.closures if graph.joins_submaps(closure)]
    right = [c for c in joining if (c[0], c[1]) not in graph.wrong]
    wrong = [c for c in joining if (c[0], c[1]) in graph.wrong]
    has = lambda closures: sum(frozenset(c[:2]) in accepted for c in closures)
    return f"{has(right)} of {len(right)}", f"{has(wrong)} of {len(wrong)}", len(graph.closures) - len(joining)


def worst(report, key):
    instants = [robot[key] for robot in report["robots"] if robot[key]]
    if not instants:
        return "-"
    at = max(instants, key=lambda at: at["rmse_m"] - at["onboard_rmse_m"])
    return f"{at['rmse_m']:.2f} for {at['onboard_rmse_m']:.2f} at {at['time_s']:.0f} s"


def worse_updates(report):
    """How many updates leave a robot more than 10 % and 5 cm worse than its odometry, of how many that can be scored."""
    scored = [(update["policies"][report["default_policy"]]["rmse_m"], update["onboard_rmse_m"])
              for robot in report["robots"] for update in robot["course"]]
    scored = [(own, odometry) for own, odometry in scored if own is not None and odometry is not None]
    return sum(is_worse(*pair) for pair in scored), len(scored)


def is_worse(estimate_m, odometry_m):
    return estimate_m > 1.1 * odometry_m + 0.05


def avoidably_worse_updates(report):
    """Counts updates whose closures a perfect judge has judged, too: how many leave a robot worse than its odometry though the judge's
    map would not, and how many these are."""
    judged = [(update["policies"][report["default_policy"]]["rmse_m"], update["onboard_rmse_m"], update["perfect_rmse_m"])
              for robot in report["robots"] for update in robot["course"]]
    judged = [three for three in judged if None not in three]
    return sum(is_worse(own, odometry) and not is_worse(perfect, odometry) for own, odometry, perfect in judged), len(judged)


def course_table(reports, timings, graphs, edges):
    lines = [row("fleet", "right closures accepted", "wrong", "within one submap", "joint ATE", "maps",
                 "worst instant: map, for odometry", "worst instant: robot", "updates with a robot worse than odometry", "and a perfect judge not",
                 "closure to correction, s: median, p99", "changes of mind", "MB up, down", "server CPU s"),
             row(*["---"] * 14)]
    for fleet, report in reports.items():
        right, wrong, within = closures_of(graphs[fleet], edges[fleet])
        minds = len(report["server"]["changes_of_mind"])
        up, down = [sum(robot[key] for robot in report["robots"]) / 1e6 for key in ("bytes_up", "bytes_down")]
        lines.append(row(fleet, right, wrong, within, metres(report["server"]["rmse_m"]), report["server"]["components"],
                         worst(report, "worst_server"), worst(report, "worst_corrected"), "{} of {}".format(*worse_updates(report)), "{} of {}".format(*avoidably_worse_updates(report)),
                         seconds(corrections(report, graphs[fleet], edges[fleet])), minds,
                         f"{up:.2f}, {down:.2f}", f"{timings[fleet]['server']['load']['map_cpu_s']:.1f}"))
    return lines


def minutes_table(report):
    """Per minute and robot: odometry, map, robot, at the last update until then."""
    names = [robot["name"] for robot in report["robots"]]
    lines = [row("s", "closures (wrong)", *(f"{name}: odometry, map, robot" for name in names)), row(*["---"] * (2 + len(names)))]
    last = max(update["time_s"] for robot in report["robots"] for update in robot["course"])
    at_s = EVERY_S
    while at_s < last + EVERY_S:
        until = lambda course: ([update for update in course if update["time_s"] <= at_s] or [None])[-1]
        server = until(report["server"]["course"])
        cells = [f"{server['closures_accepted']} ({server['closures_wrong']})" if server else "-"]
        for robot in report["robots"]:
            update = until(robot["course"])
            cells.append(", ".join(metres(value) for value in (
                update["onboard_rmse_m"], update["server_rmse_m"], update["policies"][report["default_policy"]]["rmse_m"]))
                         if update else "-")
        lines.append(row(f"{at_s:.0f}", *cells))
        at_s += EVERY_S
    return lines


def print_forms(arguments):
    """Every fleet in every form, or the graphs of a folder."""
    kept = pathlib.Path(arguments.forms)
    if arguments.graphs:
        cases = {(case.name,): case for case in graph_scores.graph_cases(pathlib.Path(arguments.graphs), kept)}
    else:
        source = lambda name: pathlib.Path(arguments.data) / "cosmo" / f"{name}.pyfg"
        cases = {(fleet, form): graph_scores.fleet_case(source(name), form, kept / name, form)
                 for fleet, name in FLEETS.items() for form in forms.NAMES}
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        run = lambda case: graph_scores.run(arguments.tutti, case, case.path.parent if case.path.is_relative_to(kept) else kept)
        scores = dict(zip(cases, pool.map(run, cases.values())))
    print("\n".join(graph_scores.table({" ".join(name): score for name, score in scores.items()})))
    print("\n" + graph_scores.summary_line({(name[0], name[-1]): score for name, score in scores.items()}))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tutti")
    parser.add_argument("--data", required=True)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", default="out/fleets")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--forms", metavar="FOLDER")
    parser.add_argument("--graphs", metavar="FOLDER")
    arguments = parser.parse_args()
    if arguments.forms:
        print_forms(arguments)
        return
    folder = pathlib.Path(arguments.data) / "cosmo"
    fleets = {"tuhh wifi": FLEETS["tuhh wifi"]} if arguments.quick else FLEETS

    def run(name):
        settings = [compare(*COMPETITORS), *LIMITS]
        sets = [word for setting in settings for word in ("--set", setting)]
        return outcome_of(pathlib.Path(arguments.out) / name, arguments.tutti, "run", "--graph", folder / f"{name}.pyfg",
                          "--threads", 1, *sets)

    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        outcomes = dict(zip(fleets, pool.map(run, fleets.values())))
    reports, timings = [{fleet: outcome[i] for fleet, outcome in outcomes.items()} for i in range(2)]
    graphs = {fleet: Graph(folder / f"{name}.pyfg") for fleet, name in fleets.items()}
    edges = {fleet: accepted_edges(pathlib.Path(arguments.out) / name) for fleet, name in fleets.items()}
    text = page(
        "Real fleets",
        ["Asked was how close the map of a real fleet comes to that of a judge who knows which closures are wrong, and its robots to the map.",
         "RMSE in metres after one rigid alignment (SE(3), no scale) at keyframes, each robot alone; in brackets the constraints that a robot holds at the end."],
        robots_table(reports),
        ["bench/accuracy/fleets.py TUTTI --data FOLDER   # each run: tutti run --graph FLEET.pyfg " +
         " ".join(f"--set {setting}" for setting in [compare(*COMPETITORS), *LIMITS])],
        "Three robots each, hand-held and car-borne LiDAR on two campuses (COSMO-Bench, of MCD's recordings; `docs/data.md`).",
        "Odometry as it came, every pose a keyframe; closures when a server got them over that radio (`wifi`, `proradio`), between",
        "robots up to 13 minutes late; the truth as reference. `perfect judge`: the map of a judge who knows by the truth which closures",
        "are wrong. Robots follow the first policy; `every_node` is the paper's baseline.",
        *(["", "One of the four fleets only (`--quick`)."] if arguments.quick else []), "",
        "## Over the course", "",
        "Right and wrong as the benchmark labels them. A closure within one submap of 10 s joins no two submaps and is left out.",
        "Joint ATE: all robots after one alignment. Worst instant: the update after which the map, or the robot that follows it,",
        "was worst beside its odometry. Worse than odometry: by more than 10 % and 5 cm; the perfect judge judges some updates alone. Closure to correction: from a closure's",
        "arrival to the first map with it on each robot that it joins; it waits for the end of both submaps and for the server's",
        "next update (`server.update_least_s`). Changes of mind: maps that differ from the one a robot follows by more than that allowed for.",
        "Published for a central server on this benchmark: 4.3 s in the median and",
        "17.7 s at p99 from closure to correction; 6.0 MB down and 11.3 MB up for four robots.", "",
        *course_table(reports, timings, graphs, edges), "",
    )
    for fleet, report in reports.items():
        text += [f"## {fleet}, minute by minute", "",
                 "At the last update before: RMSE of odometry, of the map and of the robot so far, m; accepted closures (wrong ones).", "",
                 *minutes_table(report), ""]
    if arguments.quick:
        print("\n".join(text))
    else:
        write_results("fleets.md", text)


if __name__ == "__main__":
    main()
