# SPDX-License-Identifier: BSD-3-Clause
"""Scores of `tutti optimise --robust` on graphs whose closures are labelled and whose truth is known, and their table."""
import collections
import csv
import dataclasses
import json
import math
import pathlib
import statistics
import subprocess

from forms import Fleet
from runs import row

# By the truth the benchmark's right closures are within 0.95 m and 4.6 degrees, all wrong ones but two of a fleet beyond.
WRONG_M, WRONG_DEG = 1.0, 5.0
LEAST_PERFECT_M = 0.01
# First vertex of each robot in the graphs of the folder cases/graphs, whose files do not say.
ROBOTS_BEGIN = {
    "o21": "0,803,1341,1876,2488",
    "f29": "0,806,1490,2345",
    "f25": "0,678,1257,1910",
    "f355": "0,678,1240",
    "f356": "0,529,1379,2221,2797",
    "intel3": "0,576,1152",
}


@dataclasses.dataclass
class Case:
    """A graph, the options that say what is known of it, and the file that holds the truth."""
    name: str
    path: pathlib.Path
    options: list
    truth: pathlib.Path


@dataclasses.dataclass
class Score:
    """None: not known."""
    name: str
    ate_m: float = None
    perfect_m: float = None
    joined: str = "-"  # robots of the largest map, of all
    right: int = None
    right_refused: int = None
    wrong_accepted: int = None
    far: int = None  # of these, beyond WRONG_M or WRONG_DEG
    cpu_s: float = 0.0
    factorisations: int = 0

    @property
    def ratio(self):
        """Over the perfect judge; None where his map is the truth itself, as of graphs whose truth is their optimum."""
        known = self.ate_m is not None and self.perfect_m is not None and self.perfect_m >= LEAST_PERFECT_M
        return self.ate_m / self.perfect_m if known else None


def pose_of(numbers):
    """x y z and quaternion, of these seven or of x y yaw."""
    if len(numbers) >= 7:
        return numbers[:3], numbers[3:7]
    x, y, yaw = numbers[:3]
    return [x, y, 0.0], [0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2)]


def rotated(q, v):
    x, y, z, w = q
    t = [2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])]
    return [v[0] + w * t[0] + y * t[2] - z * t[1], v[1] + w * t[1] + z * t[0] - x * t[2], v[2] + w * t[2] + x * t[1] - y * t[0]]


def product(p, q):
    a, b, c, d = p
    x, y, z, w = q
    return [d * x + a * w + b * z - c * y, d * y - a * z + b * w + c * x, d * z + a * y - b * x + c * w, d * w - a * x - b * y - c * z]


def conjugate(q):
    return [-q[0], -q[1], -q[2], q[3]]


def error_of(measured, a, b):
    """Metres and degrees by which a relative pose is off that of two true poses."""
    (p, q), (pa, qa), (pb, qb) = measured, a, b
    true_p = rotated(conjugate(qa), [s - t for s, t in zip(pb, pa)])
    off = product(conjugate(product(conjugate(qa), qb)), q)
    return math.dist(p, true_p), math.degrees(2 * math.atan2(math.hypot(*off[:3]), abs(off[3])))


def read(path, kind):
    """The lines VERTEX or EDGE of a g2o or PyFG file, as lists of words without their first and without a time."""
    has_times = path.suffix != ".g2o"
    lines = (line.split() for line in path.read_text().splitlines() if line.startswith(kind))
    return [words[2:] if has_times else words[1:] for words in lines]


def far_off(case, accepted):
    """How many of these closures, pairs of names, are beyond the limits by the truth."""
    truth = {name: pose_of([float(word) for word in numbers]) for name, *numbers in read(case.truth, "VERTEX")}
    edges = collections.defaultdict(list)
    for a, b, *numbers in read(case.path, "EDGE"):
        edges[a, b].append(pose_of([float(word) for word in numbers]))
    errors = [error_of(edges[a, b].pop(0), truth[a], truth[b]) for a, b in accepted]
    return sum(metres > WRONG_M or degrees > WRONG_DEG for metres, degrees in errors)


def run(tutti, case, folder):
    """Optimises the graph; what the program wrote stays in the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    out = folder / f"{case.name}.out.g2o"
    made = subprocess.run([str(word) for word in [tutti, "optimise", "--robust", case.path, "-o", out, "--json", *case.options]],
                          check=True, capture_output=True, text=True)
    (folder / f"{case.name}.json").write_text(made.stdout)
    report = json.loads(made.stdout)
    score = Score(case.name, cpu_s=report["cpu_s"], factorisations=report["factorisations"])
    if "ate_m" in report:
        ate = report["ate_m"]
        score.ate_m, score.joined = ate["joint"], f"{ate['robots_in_joint']} of {len(report['robots'])}"
        score.perfect_m = ate["perfect"]["joint"] if "perfect" in ate else None
    if "closures" in report:
        labels = report["closures"]
        score.right, score.right_refused = labels["right"], labels["right"] - labels["right_accepted"]
        score.wrong_accepted = labels["wrong_accepted"]
        with open(folder / f"{case.name}.out_closures.csv", newline="") as file:
            wrong = [(line["from"], line["to"]) for line in csv.DictReader(file) if line["accepted"] == "1" and line["right"] == "0"]
        score.far = far_off(case, wrong) if case.truth else None
    return score


def fleet_case(source, name, folder, form="whole"):
    """One form of a fleet, written into the folder."""
    fleet = Fleet(source)
    path = folder / f"{name}.pyfg"
    fleet.write(path, fleet.closures_of(form))
    return Case(name, path, [], path)


def graph_cases(source, folder):
    """The graphs of a folder: FLEET.pyfg, GRAPH.g2o, and folders with graph.g2o, truth.g2o and right.g2o or with fleet.pyfg.
    What is written goes to the other folder."""
    cases = []
    for path in sorted(source.iterdir()):
        begin = ROBOTS_BEGIN.get(path.name)
        if path.suffix == ".pyfg" and not path.stem.endswith("_no_outliers"):
            cases.append(fleet_case(path, path.stem, folder))
        elif path.suffix == ".g2o":
            cases.append(Case(path.stem, path, [], None))
        elif (path / "fleet.pyfg").exists():
            cases.append(fleet_case(path / "fleet.pyfg", path.name, folder))
        elif (path / "graph.g2o").exists():
            options = ["--truth", path / "truth.g2o", "--right", path / "right.g2o"] + (["--robots", begin] if begin else [])
            cases.append(Case(path.name, path / "graph.g2o", options, path / "truth.g2o"))
    return cases


def quantile(values, share):
    return sorted(values)[max(0, math.ceil(share * len(values)) - 1)]


def shown(value, form="{:.3f}"):
    return "-" if value is None else form.format(value)


def table(scores):
    """`scores` by the name of what they are of."""
    lines = [row("graph", "robots joined", "ATE, m", "perfect judge", "ratio", "right refused", "wrong accepted (far)", "CPU s", "factorisations"),
             row(*["---"] * 9)]
    for name, score in scores.items():
        refused = "-" if score.right is None else f"{score.right_refused} of {score.right}"
        wrong = "-" if score.wrong_accepted is None else f"{score.wrong_accepted} ({shown(score.far, '{}')})"
        lines.append(row(name, score.joined, shown(score.ate_m), shown(score.perfect_m), shown(score.ratio), refused, wrong,
                         f"{score.cpu_s:.2f}", score.factorisations))
    return lines


@dataclasses.dataclass
class Summary:
    median: float
    p95: float
    worst: float
    worst_first50: float
    refused_share: float
    wrong: int
    far: int
    median_cpu_s: float


def summary(scores):
    """Over graphs that have a perfect judge's ATE; `scores` by (fleet, form)."""
    ratios = {name: score.ratio for name, score in scores.items() if score.ratio is not None}
    labelled = [score for score in scores.values() if score.right is not None]
    return Summary(statistics.median(ratios.values()), quantile(ratios.values(), 0.95), max(ratios.values()),
                   max((ratio for (_, form), ratio in ratios.items() if form == "first50"), default=None),
                   sum(score.right_refused for score in labelled) / sum(score.right for score in labelled),
                   sum(score.wrong_accepted for score in labelled), sum(score.far for score in labelled),
                   statistics.median(score.cpu_s for score in scores.values()))


def summary_line(scores):
    of = summary(scores)
    return (f"{len(scores)} graphs over the perfect judge: median {of.median:.3f}, p95 {of.p95:.3f}, worst {of.worst:.3f}, worst of "
            f"first50 {shown(of.worst_first50)}; right refused {100 * of.refused_share:.2f} %, wrong accepted {of.wrong} "
            f"(far: {of.far}); median {of.median_cpu_s:.2f} s of CPU")
