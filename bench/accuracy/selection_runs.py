# SPDX-License-Identifier: BSD-3-Clause
"""What bench/accuracy/selection.py runs: every job once, kept in a folder, several at a time."""
import concurrent.futures
import json
import pathlib
import subprocess
import sys
import time

from runs import compare, mission_file, outcome_of

POLICIES = ["every_node", "spectral", "uniform", "random", "euclidean", "skeleton", "adaptive"]
DEFAULT = "adaptive"
BUDGETS = [5, 10, 15, 25, 50, 100, 200, 400, 746, 2584]
HELD_OUT_BUDGETS = [5, 12, 25, 100]
TRAJECTORIES = ["simulation.sensors=none", "closures.finder=reference"]
SETS = {"tunnel": TRAJECTORIES + ["closures.reference.radius_m=1.5"], "terrace": TRAJECTORIES}
SIMULATED = ["tunnel", "terrace", "agree", "spin", "height", "degenerate", "revision", "late"]
REAL = ["euroc_mh", "kitti_00_halves", "kitti_02_halves", "kitti_05_halves", "kitti_07_halves", "hku_two_sessions",
        "hku_degraded"]
TARGET_BUDGET = {"tunnel": 12, "terrace": 6}  # constraints per robot
R, N = "simulation.robots.0", "simulation.world.network"
HELD_OUT = {  # docs/simulation.md: never used for tuning
    "spin": [f"{N}.block_m=24", f"{R}.walk.length_m=384", f"{R}.walk.duration_s=510",
             f"{R}.odometry.scripted.0.yaw_deg=-12"],
    "height": ["simulation.world.ramp_rise_m=1.5", f"{R}.odometry.scripted.0.up_m=-2",
               f"{R}.odometry.scripted.0.length_m=8"],
    "degenerate (longer)": [f"{N}.block_m=60", f"{R}.walk.length_m=640", f"{R}.walk.duration_s=1000",
                            f"{R}.odometry.degeneracy.slide_percent=2.5"],
    "degenerate (other drift)": [f"{R}.odometry.yaw_drift_deg_per_m=0.05", f"{R}.odometry.scale_percent=1",
                                 f"{R}.odometry.slips_per_km=4", f"{R}.odometry.slip_deg=5"],
    "agree": [f"{N}.block_m=30", f"{R}.walk.max_speed_mps=1.2", "closures.reference.sigma_m=0.05"],
    "terrace": TRAJECTORIES + ["simulation.world.roof_length_m=34", f"{R}.odometry.failure.yaw_deg=0",
                               f"{R}.odometry.failure.drift_m=2"],
    "tunnel": SETS["tunnel"] + [f"{N}.block_m=40",
                                f"{R}.odometry.scripted=[{{after_m: 150, length_m: 40, yaw_deg: 6}}]"],
}
ABLATION = {
    "wavelets": ("without ties", ["agent.policy.adaptive.agreement.tests=wavelets"]),
    "ties": ("without wavelets: ties alone", ["agent.policy.adaptive.agreement.tests=ties"]),
    "rmse": ("without either: aligned RMSE above 3x what the server says", ["agent.policy.adaptive.detection=rmse"]),
    "always": ("without any detection", ["agent.policy.adaptive.detection=always"]),
    "even": ("the same detection, uniform placement", ["agent.policy.adaptive.placement=uniform"]),
    "absolute": ("absolute thresholds (5 cm, 0.5 degrees)", ["agent.policy.adaptive.agreement.thresholds=absolute"]),
}

DETECTION = ["wavelets", "ties", "rmse"]  # of these, what notices a disagreement


class Runs:
    """Names of jobs -> their results; `all()` runs what is not there yet."""

    def __init__(self, arguments, folder):
        self.arguments, self.folder = arguments, pathlib.Path(folder) / ("quick" if arguments.quick else "full")
        self.jobs = {}
        quick = arguments.quick
        self.seeds = range(1, 3 if quick else arguments.seeds + 1)
        # Of scans that are found again the same, a seed changes little more than a frame.
        self.real_seeds = {name: range(1, 2) if quick else range(1, 4) if name.startswith("hku") else self.seeds
                           for name in REAL}
        self.loop_seeds = {name: range(1, 2 if quick else 6 if name in SETS else 4) for name in SIMULATED}
        self.many_seeds = range(1, 3 if quick else arguments.many + 1)
        self.held_out_seeds = range(1001, 1003 if quick else 1001 + arguments.seeds)
        self.budgets = [5, 25, 400] if quick else BUDGETS
        self.real = (["euroc_mh", "hku_two_sessions"] if quick else REAL) if arguments.data else []
        self.full = [] if quick else ["terrace", "tunnel"]

    def budgets_of(self, name):
        return sorted(self.budgets + ([TARGET_BUDGET[name]] if name in TARGET_BUDGET else []))

    def curves(self, key, mission, seed, sets, policies=(DEFAULT,), budgets=(0,), closed_loop=False):
        command = [self.arguments.curves, mission_file(mission), "--seed", seed, "--policies", ",".join(policies)]
        command += ["--closed-loop"] if closed_loop else ["--budgets", ",".join(map(str, budgets))]
        command += ["--data", self.arguments.data] if self.arguments.data else []
        for assignment in sets:
            command += ["--set", assignment]
        self.jobs[key, seed] = lambda: self.lines_of(key, seed, command)

    def mission(self, key, mission, seed, sets):
        command = [self.arguments.tutti, "run", mission_file(mission), "--seed", seed, "--threads", 1, "--set",
                   compare("spectral", "every_node")]
        command += ["--data", self.arguments.data] if self.arguments.data else []
        for assignment in sets:
            command += ["--set", assignment]
        self.jobs[key, seed] = lambda: outcome_of(self.folder / f"{key}_seed{seed}", *command)[0]

    def lines_of(self, key, seed, command):
        path = self.folder / f"{key}_seed{seed}.jsonl".replace(" ", "_").replace("(", "").replace(")", "")
        if not path.exists():
            done = subprocess.run([str(part) for part in command], check=True, capture_output=True, text=True)
            unfinished = path.with_suffix(".unfinished")
            unfinished.write_text(done.stdout)
            unfinished.rename(path)
        return [json.loads(line) for line in path.read_text().splitlines()]

    def plan(self):
        """The longest first: two workers then end at about the same time."""
        for name in reversed(self.full):
            self.mission(f"full_{name}", name, 1, [])
        for name in SIMULATED:
            for seed in self.loop_seeds[name]:
                self.mission(f"loop_{name}", name, seed, SETS.get(name, []))
        for name in SIMULATED:
            for seed in self.seeds:
                self.curves(f"curves_{name}", name, seed, SETS.get(name, []), POLICIES, self.budgets_of(name) + [0])
        for name in self.real:
            for seed in self.real_seeds[name]:
                self.curves(f"curves_{name}", name, seed, [], POLICIES, self.budgets_of(name) + [0])
            for seed in self.real_seeds[name][:3]:
                self.mission(f"loop_{name}", name, seed, [])
        for name in SIMULATED + self.real:
            for seed in self.real_seeds.get(name, self.seeds):
                for variant in DETECTION:
                    self.curves(f"noticed_{variant}_{name}", name, seed, SETS.get(name, []) + ABLATION[variant][1])
        for seed in self.seeds:
            self.curves("loops_revision", "revision", seed, [], [DEFAULT, "spectral", "every_node"], closed_loop=True)
            self.curves("loops_trusting_revision", "revision", seed, ["server.proxy_graph.shape_deletions=0"],
                        closed_loop=True)
        for seed in self.many_seeds:
            self.curves("loops_agree", "agree", seed, [], closed_loop=True)
            for name in ("agree", "spin", "height", "terrace", "degenerate"):
                self.curves(f"many_{name}", name, seed, SETS.get(name, []))
        for name, sets in HELD_OUT.items():
            for seed in self.held_out_seeds:
                mission = name.split(" (")[0]
                self.curves(f"held_{name}", mission, seed, sets, POLICIES, HELD_OUT_BUDGETS + [0])
                for variant, (_, more) in ABLATION.items():
                    self.curves(f"held_{variant}_{name}", mission, seed, sets + more, [DEFAULT], HELD_OUT_BUDGETS + [0])

    def all(self):
        self.folder.mkdir(parents=True, exist_ok=True)
        self.plan()
        start = time.monotonic()

        def run(item):
            (key, seed), job = item
            result = job()
            return key, seed, result
        results = {}
        with concurrent.futures.ThreadPoolExecutor(self.arguments.jobs) as pool:
            for done, (key, seed, result) in enumerate(pool.map(run, self.jobs.items()), 1):
                results.setdefault(key, {})[seed] = result
                if done % 20 == 0 or done == len(self.jobs):
                    print(f"{done} of {len(self.jobs)} jobs, {time.monotonic() - start:.0f} s", file=sys.stderr)
        return results
