# SPDX-License-Identifier: BSD-3-Clause
"""The jobs of bench/accuracy/selection.py: every job once, its result kept in a folder, several at a time; and the rows
that are read from them."""
import concurrent.futures
import json
import pathlib
import subprocess
import sys
import tempfile
import time

from runs import SOURCE, compare, mission_file, without_partial

DEFAULT, TOP, OLD = "adaptive", "spectral, `top`", "old default"
COMPARED = ["none", "every_node", "every_node_2", "spectral", "uniform", "random", "skeleton"]
TRAJECTORIES = ["simulation.sensors=none", "closures.verifier=reference", "closures.reference.radius_m=1.5"]
FLEETS = {f"fleet_{n}": ["fleet", f"simulation.robots.0.copies={n}"] for n in (4, 8)}
ROOM = ["tunnel", *TRAJECTORIES, "simulation.world.featureless_share=0",
        "simulation.world.network={rows: 2, columns: 2, block_m: 8, jitter_m: 1}",
        *(f"simulation.robots.{k}.walk={{duration_s: 900, lookahead_m: 1.2}}" for k in (0, 1))]
# Runs under a name of their own: the mission file, and what is set.
VARIANTS = {**FLEETS, "room": ROOM, **{name: [name, *TRAJECTORIES] for name in ("tunnel", "terrace", "demo")}}
NEEDS_SCANS = ("hku_degraded", "hku_two_sessions")
SHORT_S = 120
MANY_SEEDS = 20
MANY = ("agree", "spin", "height", "revision")
# Where any mechanism ever moved something when all missions were run without it, and where silence is asked.
ABLATED = ("agree", "euroc_mh", "height", "kitti_00_05", "kitti_00_halves", "kitti_02_halves", "kitti_05_halves", "late",
           "revision", "spin", "terrace")
ABLATIONS = {  # a mechanism switched off: what it takes
    "directions": ["agent.disagreement.without=directions"],
    "hinges": ["server.proxy_graph.shape_deletions=0"],
    "a quarter of sigma": ["agent.policy.adaptive_error_share=1000"],
    "failed odometry": ["server.map.outlier_rejection.let_odometry_fail=false"],
    "honesty of odometry": ["server.map.judge_odometry=false"],
}


def all_missions():
    """Every mission of the tree but the fleet."""
    return sorted({file.stem for file in (SOURCE / "missions").glob("*.yaml")} - {"fleet"})


class Jobs:
    """In the order in which they are to be run: what shows most comes first."""

    def __init__(self, arguments):
        self.arguments, self.folder = arguments, pathlib.Path(arguments.keep)
        self.jobs, self.failed = {}, []
        quick = arguments.quick
        self.seeds = range(1, 2 if quick else 3)
        missions = [m for m in all_missions() if not (quick and m in NEEDS_SCANS)]
        if arguments.missions:
            missions = [m for m in missions + list(FLEETS) if m in arguments.missions]
        self.missions = [m for m in missions if m not in FLEETS]
        self.fleets = [f for f in FLEETS if not quick and (not arguments.missions or f in arguments.missions)]
        if arguments.old:
            self.plan_old()
        else:
            self.plan(quick)

    def plan_old(self):
        for missions in (self.missions, self.fleets):
            for seed in self.seeds:
                for mission in missions:
                    self.run("old", mission, seed)

    def plan(self, quick):
        def policies(missions, seeds):
            for seed in seeds:
                for mission in missions:
                    self.run("policies", mission, seed, [compare(*COMPARED)])
                    self.run("top", mission, seed, ["agent.policy.name=spectral", "agent.policy.classifier=top"])

        def many(last):
            for mission in MANY:
                for seed in range(1, last + 1):
                    if mission in self.missions:
                        self.run("many", mission, seed)

        light = [m for m in self.missions if m not in NEEDS_SCANS]
        policies(light, self.seeds[:1])
        many(3 if quick else MANY_SEEDS)
        for mission in light + self.fleets[:1]:
            self.calibration(mission, 1)
        for seed in self.seeds:
            for mission in light:
                self.run("short", mission, seed, [f"duration_s={SHORT_S}", compare("every_node", "skeleton")])
        policies(light, self.seeds[1:])
        if not quick:
            for seed in self.seeds:
                for title, sets in ABLATIONS.items():
                    for mission in light:
                        if mission in ABLATED:
                            self.run(f"without {title}", mission, seed, sets)
                policies(self.fleets[:1], [seed])
            policies([m for m in self.missions if m in NEEDS_SCANS], self.seeds[:1])
        if self.fleets:
            self.run("room", "room", 1, [compare("every_node", "skeleton")])
        policies(self.fleets[1:], self.seeds[:1])

    def command(self, mission, seed, sets):
        name, *own = VARIANTS.get(mission, [mission])
        command = [mission_file(name), "--seed", seed]
        command += ["--data", self.arguments.data] if self.arguments.data else []
        for assignment in own + list(sets):
            command += ["--set", assignment]
        return command

    def run(self, kind, mission, seed, sets=()):
        program = self.arguments.old or self.arguments.tutti
        command = [program, "run", *self.command(mission, seed, sets), "--threads", 1]

        def job():
            with tempfile.TemporaryDirectory() as out:
                done = subprocess.run([*map(str, command), "--out", out], capture_output=True, text=True)
                if done.returncode:
                    raise RuntimeError(done.stderr.strip() or done.stdout.strip()[-500:])
                report, timing = (json.loads((pathlib.Path(out) / f).read_text()) for f in ("report.json", "timing.json"))
            return {"report": report, "timing": timing}
        self.jobs[kind, mission, seed] = job

    def calibration(self, mission, seed):
        command = [self.arguments.calibration, *self.command(mission, seed, [])]

        def job():
            done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
            if done.returncode:
                raise RuntimeError(done.stderr.strip())
            return [json.loads(line) for line in done.stdout.splitlines()]
        self.jobs["calibration", mission, seed] = job

    def path(self, key):
        kind, mission, seed = key
        return self.folder / kind.replace(" ", "_") / f"{mission}_{seed}.json"

    def result(self, key):
        """None when it has not been run, or failed."""
        path = self.path(key)
        return json.loads(path.read_text()) if path.exists() else None

    def all(self):
        todo = [key for key in self.jobs if not self.path(key).exists()]
        print(f"{len(self.jobs)} jobs, {len(self.jobs) - len(todo)} of them done before", file=sys.stderr)
        start = time.monotonic()

        def one(key):
            began = time.monotonic()
            try:
                result = self.jobs[key]()
            except RuntimeError as error:
                return key, time.monotonic() - began, str(error)
            path = self.path(key)
            path.parent.mkdir(parents=True, exist_ok=True)
            unfinished = path.with_suffix(".unfinished")
            unfinished.write_text(json.dumps(result))
            unfinished.rename(path)
            return key, time.monotonic() - began, None

        with concurrent.futures.ThreadPoolExecutor(self.arguments.jobs) as pool:
            running = [pool.submit(one, key) for key in todo]
            for done, future in enumerate(concurrent.futures.as_completed(running), 1):
                key, took_s, error = future.result()
                kind, mission, seed = key
                if error:
                    self.failed.append((key, error))
                print(f"{done}/{len(todo)} {time.monotonic() - start:.0f} s: {kind} {mission} {seed} {took_s:.1f} s"
                      + (f" FAILED: {error}" if error else ""), file=sys.stderr)


# ---- rows: one robot with one policy in one run ----------------------------------------------------------------------

LEAST_M = 0.02  # the better of map and odometry is never taken for better than this when errors are divided by it


def harm(robot, policy, server):
    """How much worse than the better of map and odometry the robot was after an answer, at worst: (m, times, times while
    a wrong closure stood); None where that is not known."""
    metres, times, while_wrong = [], [], []
    for answer in robot["course"]:
        own = answer["policies"][policy]["rmse_m"]
        if own is None:
            continue
        better = min(answer["onboard_rmse_m"], answer["server_rmse_m"])
        metres.append(own - better)
        times.append(own / max(better, LEAST_M))
        before = [update for update in server["course"] if update["time_s"] <= answer["time_s"]]
        if before and before[-1]["closures_wrong"]:
            while_wrong.append(times[-1])
    return [max(values, default=None) for values in (metres, times, while_wrong)]


def rows_of(result, mission, seed, names=None):
    """Per robot and policy of one run; `names`: how policies are called here."""
    report, timing = without_partial(result["report"]), result["timing"]
    update_ms = {(entry["robot"], entry["policy"]): entry["update"] for entry in timing["policies"]}
    for robot in report["robots"]:
        graphs = [t for t in robot["traffic"] if t["kind"] == "proxy graph"]
        for policy, own in robot["policies"].items():
            metres, times, while_wrong = harm(robot, policy, report["server"])
            ms = update_ms[robot["name"], policy]
            yield {"policy": (names or {}).get(policy, policy), "mission": mission, "seed": seed, "robot": robot["name"],
                   "links": own["constraints"],
                   "most_links": max((a["policies"][policy]["constraints"] for a in robot["course"]), default=0),
                   **{f"{who}_{key}": figures[f"{prefix}{key}"] for key in ("rmse_m", "rpe_m", "rpe_10m_m")
                      for who, figures, prefix in (("onboard", robot, "onboard_"), ("server", robot, "server_"),
                                                   ("own", own, ""))},
                   "harm_m": metres, "harm": times, "harm_while_wrong": while_wrong,
                   "median_ms": ms["median_ms"], "max_ms": ms["max_ms"], "tied": robot["tied"],
                   "nodes": robot["proxy_nodes"],
                   "broadcast_bytes": sum(g["bytes"] for g in graphs) / max(1, sum(g["messages"] for g in graphs)),
                   "server_ms": timing["server"]["optimisation"]["max_ms"],
                   "disagrees": bool(robot["explanation"] and robot["explanation"]["disagrees"])}
