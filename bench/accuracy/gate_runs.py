# SPDX-License-Identifier: BSD-3-Clause
"""The runs of the gate, and the figures that it takes from them.

A job gives figures by name, each with its kind (gate.py, KINDS). One whose files are not there gives none.
"""
import dataclasses
import json
import pathlib
import re
import statistics
import subprocess

import fleets
import forms
import graph_scores
from runs import mission_file, outcome_of

TRAJECTORIES = ["closures.verifier=reference", "simulation.sensors=none"]
FLEETS, MAP = "docs/results/fleets.md", "docs/results/map.md"
RECORDING = re.compile(r"\b(?:cosmo|euroc|excavator_mm|images|kitti|lidar|mulran)/[\w./-]*\w")  # as missions name them


@dataclasses.dataclass
class Places:
    """The program, the folder with data/ and cases/, and where runs are kept."""
    tutti: pathlib.Path
    shared: pathlib.Path
    out: pathlib.Path


@dataclasses.dataclass
class Job:
    name: str
    page: str  # which quotes its figures
    needs: object  # Places -> paths below the shared folder
    run: object  # Places -> {figure: (kind, value)}
    quick: bool = False  # part of the quick gate, too

    def missing(self, places):
        return next((path for path in self.needs(places) if not (places.shared / path).exists()), None)


def folder_of(places, job):
    return places.out / re.sub(r"\W+", "_", job)


def outcome(places, job, source, seed=1, settings=()):
    """(report, timing) of one mission, run once for one program."""
    words = [word for setting in settings for word in ("--set", setting)]
    return outcome_of(folder_of(places, job), places.tutti, "run", *source, "--seed", seed, "--threads", 1, *words)


def mission_figures(report, timing):
    """The figures that every mission is asked for. A robot without a reference is compared with the map."""
    figures = {}
    for robot in report["robots"]:
        own = robot["policies"][report["default_policy"]]
        name = robot["name"]
        if robot["server_rmse_m"] is not None:
            figures[f"{name}, server"] = ("error_m", robot["server_rmse_m"])
            figures[f"{name}, corrected"] = ("error_m", own["rmse_m"])
            if robot.get("perfect_rmse_m"):
                figures[f"{name}, over perfect"] = ("ratio", robot["server_rmse_m"] / robot["perfect_rmse_m"])
        else:
            figures[f"{name}, robot to server"] = ("error_m", own["agreement_rmse_m"])
        for key, what in (("worst_server", "map"), ("worst_corrected", "robot")):
            if robot[key]:
                figures[f"{name}, worst instant of the {what}"] = ("harm_m", robot[key]["rmse_m"] - robot[key]["onboard_rmse_m"])
    server, check = report["server"], report["server"]["closure_check"]
    figures["maps"] = ("same", server["components"])
    figures["closures accepted"] = ("accepted", server["closures_accepted"])
    if check:
        figures["wrong accepted"] = ("wrong", check["wrong"])
        figures["wrong at an update, at most"] = ("wrong", max((update["closures_wrong"] or 0 for update in server["course"]), default=0))
    figures["factorisations"] = ("work", timing["server"]["work"]["factorisations"])
    return figures


def mission(name, file, page="README.md", seed=1, settings=(), **flags):
    """A mission of missions/, or one below the shared folder."""
    is_shared = file.endswith(".yaml")
    path = lambda places: places.shared / file if is_shared else mission_file(file)

    def run(places):
        source = [path(places), "--data", places.shared / "data"]
        return mission_figures(*outcome(places, name, source, seed, settings))

    def needs(places):
        if not path(places).exists():
            return [file]
        return [f"data/{name}" for name in RECORDING.findall(path(places).read_text())]
    return Job(name, page, needs, run, **flags)


def fleet(name, file, page=FLEETS, **flags):
    """A fleet as a mission: as README has it, and how long a closure takes to correct a robot."""
    path = f"data/cosmo/{file}.pyfg"

    def run(places):
        report, timing = outcome(places, name, ["--graph", places.shared / path], settings=fleets.LIMITS)
        figures = mission_figures(report, timing)
        graph = fleets.Graph(places.shared / path)
        took_s = fleets.corrections(report, graph, fleets.accepted_edges(folder_of(places, name)))
        figures["joint"] = ("error_m", report["server"]["rmse_m"])
        figures["updates worse than odometry"] = ("updates", fleets.worse_updates(report)[0])
        figures["updates worse than odometry, a perfect judge's not"] = ("updates", fleets.avoidably_worse_updates(report)[0])
        figures["closure to correction, median"] = ("latency_s", statistics.median(took_s))
        figures["closure to correction, p99"] = ("latency_s", fleets.quantile(took_s, 0.99))
        return figures
    return Job(name, page, lambda _: [path], run, **flags)


def score_figures(score):
    figures = {"ATE": ("error_m", score.ate_m), "over perfect": ("ratio", score.ratio), "wrong accepted": ("wrong", score.wrong_accepted),
               "wrong by a metre": ("wrong", score.far), "right refused": ("refused", score.right_refused),
               "factorisations": ("work", score.factorisations)}
    return {name: (kind, value) for name, (kind, value) in figures.items() if value is not None}


def scores_of_forms(places):
    """Scores by (fleet, form)."""
    scores = {}
    for fleet_name, file in fleets.FLEETS.items():
        folder = places.out / "forms" / file
        for form in forms.NAMES:
            case_of_form = graph_scores.fleet_case(places.shared / "data/cosmo" / f"{file}.pyfg", form, folder, form)
            scores[fleet_name, form] = graph_scores.run(places.tutti, case_of_form, folder)
    return scores


def forms_summary(scores):
    of = graph_scores.summary(scores)
    return {"median": ("ratio", of.median), "p95": ("ratio", of.p95), "worst": ("ratio", of.worst),
            "worst of first50": ("ratio", of.worst_first50), "right refused": ("share", of.refused_share),
            "wrong accepted": ("some", of.wrong), "wrong by a metre": ("some", of.far),
            "factorisations": ("work", sum(score.factorisations for score in scores.values())), "median CPU s": ("cpu_s", of.median_cpu_s)}


def fleets_in_forms(**flags):
    """How near the fleets' maps in all forms come to a perfect judge's."""
    def run(places):
        scores = scores_of_forms(places)
        figures = forms_summary(scores)
        for (fleet_name, form), score in scores.items():
            figures[f"{fleet_name} {form}"] = ("form", score.ratio)
        return figures
    return Job("forms", FLEETS, lambda _: [f"data/cosmo/{file}.pyfg" for file in fleets.FLEETS.values()], run, **flags)


def case(name, **flags):
    """A graph of cases/graphs."""
    path = f"cases/graphs/{name}"

    def run(places):
        folder = places.out / "graphs"
        found = next(one for one in graph_scores.graph_cases(places.shared / "cases/graphs", folder) if one.name == name)
        return score_figures(graph_scores.run(places.tutti, found, folder))
    return Job(f"graph {name}", "../shared/cases/README.md", lambda _: [path], run, **flags)


def published(name, folder="data/g2o", page="docs/results/optimise.md", options=()):
    """A published graph: its optimum, and how far off that --robust is, which should refuse nothing."""
    path = f"{folder}/{name}.g2o"

    def run(places):
        folder = places.out / "graphs"
        folder.mkdir(parents=True, exist_ok=True)
        optimum = folder / f"{name}.optimum.g2o"
        made = subprocess.run([places.tutti, "optimise", places.shared / path, "-o", optimum, "--json"], check=True, capture_output=True, text=True)
        plain = json.loads(made.stdout)
        found = graph_scores.Case(name, places.shared / path, ["--truth", optimum, *options], None)
        score = graph_scores.run(places.tutti, found, folder)
        report = json.loads((folder / f"{name}.json").read_text())
        return {"chi2": ("cost", plain["chi2_after"]), "iterations": ("work", plain["iterations"]),
                "off the optimum": ("error_m", score.ate_m), "right refused": ("refused", report["refused"]),
                "factorisations": ("work", score.factorisations)}
    return Job(f"graph {name}", page, lambda _: [path], run)


# README's table, in its order.
README = [
    mission("cosmo_tuhh", "cosmo_tuhh"),
    fleet("kth wifi", fleets.FLEETS["kth wifi"], f"README.md, {FLEETS}"),
    mission("hku_two_sessions", "hku_two_sessions"),
    mission("hku_degraded", "hku_degraded"),
    mission("euroc_mh", "euroc_mh"),
    mission("kitti_00_05", "kitti_00_05"),
    mission("tunnel", "tunnel", settings=TRAJECTORIES + ["closures.reference.radius_m=1.5"]),
    mission("euroc_v101_rovio", "euroc_v101_rovio"),
    mission("hall", "hall"),
    mission("terrace", "terrace"),
    mission("demo", "demo", quick=True),
]
JOBS = README + [
    fleets_in_forms(quick=True),
    *[fleet(name, file) for name, file in fleets.FLEETS.items() if name != "kth wifi"],
    mission("v1_two_flights", "cases/rooms/v1_two_flights.yaml", MAP, quick=True),
    mission("v2_three_flights, seed 5", "cases/rooms/v2_three_flights.yaml", MAP, seed=5),
    mission("v2_three_flights_no_covariance", "cases/rooms/v2_three_flights_no_covariance.yaml", MAP),
    mission("kitti_00_halves, seed 9", "kitti_00_halves", MAP, seed=9),
    mission("kitti_02_halves", "kitti_02_halves", MAP),
    mission("mulran_dcc_02_halves", "cases/mulran_dcc_02_halves.yaml", MAP),
    mission("terrace *, seed 5", "terrace", MAP, seed=5, settings=TRAJECTORIES),
    mission("terrace *, seed 16", "terrace", MAP, seed=16, settings=TRAJECTORIES),
    mission("terrace *, 30 % wrong", "terrace", MAP, settings=TRAJECTORIES + ["closures.reference.wrong_share=0.3"]),
    mission("spin", "spin", MAP),
    mission("height", "height", MAP),
    *[case(name, quick=name in ("f355", "f356", "intel3"))
      for name in ("f25", "f29", "f355", "f356", "intel3", "k260", "o21", "tuhh00_240")],
    published("kitti_09", "cases/graphs", "../shared/cases/README.md", ["--robots", "0"]),
    *[published(name) for name in ("sphere2500", "torus3D", "parking-garage", "intel", "manhattan")],
]
