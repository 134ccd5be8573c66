# SPDX-License-Identifier: BSD-3-Clause
"""The parts of docs/results/selection.md, its table of all figures and its plots, from the results of Runs."""
import collections
import csv
import math

import svg_plot
from runs import row
from selection_runs import DEFAULT, POLICIES, SIMULATED
from selection_statistics import by_case, heading, median, number, own_lines, quantile, ratio, rmse, spread


# ---- one comparison at the end -------------------------------------------------------------------------------------

def curve_table(cases, budgets):
    lines = heading("policy", *budgets, "own rule (constraints)")
    for policy in POLICIES:
        cells = []
        for budget in budgets:
            found = cases.get((policy, budget))
            if not found:
                cells.append("")
            else:
                cells.append((spread if policy == DEFAULT else lambda v: number(median(v)))([rmse(l) for l in found]))
        own = cases[policy, 0]
        cells.append(f"{number(median(map(rmse, own)))} ({number(median(l['constraints'] for l in own), 0)})")
        lines.append(row(f"`{policy}`", *cells))
    return lines


METRICS = ["max_m", "rpe_1s_m", "rpe_10m_m"]


def metric_table(cases, budget):
    lines = heading("policy", "constraints", "RMSE m", "of the server's", "largest error m", "RPE 1 s mm",
                    "RPE 10 m mm", "kink mm", "to the server mm")
    sample = next(iter(cases.values()))
    for title in ("onboard", "server"):
        if sample[0][title]:
            own = {key: median(line[title][key] for line in sample) for key in ["rmse_m"] + METRICS}
            lines.append(row(title, "", number(own["rmse_m"]),
                             number(median(l[title]["rmse_m"] / l["server"]["rmse_m"] for l in sample), 2),
                             number(own["max_m"]), number(1e3 * own["rpe_1s_m"], 1), number(1e3 * own["rpe_10m_m"], 1),
                             "", ""))
    for policy in POLICIES:
        found = cases[policy, 0 if policy == "every_node" else budget]

        def of(key):
            return median(l["corrected"][key] if l["corrected"] else None for l in found)

        def mm(value):
            return number(None if value is None else 1e3 * value, 1)
        lines.append(row(f"`{policy}`", number(median(l["constraints"] for l in found), 0), number(of("rmse_m")),
                         number(median(map(ratio, found)), 2), number(of("max_m")), mm(of("rpe_1s_m")),
                         mm(of("rpe_10m_m")), mm(median(l.get("kink_m") for l in found)),
                         mm(median(l.get("agreement_m") for l in found))))
    return lines


def write_csv(path, results, names):
    errors = ["rmse_m"] + METRICS
    columns = ["constraints", "ratio_to_server", "kink_m", "to_server_m"] + errors

    def values(lines):
        return [[l["constraints"] for l in lines], [ratio(l) for l in lines], [l.get("kink_m") for l in lines],
                [l.get("agreement_m") for l in lines]] + [
                    [l["corrected"][key] if l["corrected"] else None for l in lines] for key in errors]

    with path.open("w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["scenario", "robot", "policy", "budget", "seeds"]
                     + [f"{column}{end}" for column in columns for end in ("", "_quartile_1", "_quartile_3")])
        for name in names:
            for robot, cases in by_case(results[f"curves_{name}"]).items():
                for (policy, budget), lines in cases.items():
                    quantiles = [quantile(found, share) for found in values(lines) for share in (0.5, 0.25, 0.75)]
                    out.writerow([name, robot, policy, budget, len(lines)]
                                 + ["" if q is None else f"{q:.4g}" for q in quantiles])


def curve_plot(path, results, names, budgets):
    panels = {}
    for name in names:
        for robot, cases in by_case(results[f"curves_{name}"]).items():
            lines = {}
            for policy in [DEFAULT] + [p for p in POLICIES if p not in (DEFAULT, "every_node")]:
                points = []
                for budget in budgets:
                    values = [rmse(l) for l in cases[policy, budget]]
                    points.append((budget, median(values)) + (
                        (quantile(values, 0.25), quantile(values, 0.75)) if policy == DEFAULT else ()))
                lines[policy] = points
            every = cases["every_node", 0]
            ends = (budgets[0], budgets[-1])
            lines["every_node"] = [(b, median(map(rmse, every))) for b in ends]
            if every[0]["server"]:
                lines["server"] = [(b, median(l["server"]["rmse_m"] for l in every)) for b in ends]
            panels[f"{name}, {robot}"] = lines
    svg_plot.write(path, panels, "constraints allowed", "median RMSE in m (band: quartiles of the default)")


def curves_section(runs, results):
    text = ["## One comparison at the end of the mission", "",
            "The server makes its map of the whole mission; every policy answers this one map from raw odometry, with "
            "every budget. RMSE",
            "in metres after one rigid alignment, at keyframes; medians over seeds, for the default with quartiles. "
            f"{len(runs.seeds)} seeds; the HKU recordings",
            f"{len(runs.real_seeds['hku_degraded'])} (of the closures' errors and drawn frames: recordings do not change). "
            "`every_node` takes no budget and "
            "has one figure,",
            "by its own rule: a link to every proxy node. `uniform` and `random` by their own rule hold 25. All figures "
            "with quartiles, and",
            "the largest error, RPE, kink and constraints of each: `selection.csv`. Where there is no truth "
            "(hku_two_sessions) errors are",
            "against the server's map. hku_degraded is scored against its own odometry before it was degraded.", ""]
    middle = 25
    for name in SIMULATED + runs.real:
        for robot, cases in by_case(results[f"curves_{name}"]).items():
            text += [f"### {name}, {robot}", ""] + curve_table(cases, runs.budgets_of(name))
            text += ["", f"With {middle} constraints allowed:", ""] + metric_table(cases, middle) + [""]
    return text


# ---- closed loop -----------------------------------------------------------------------------------------------------

def loop_section(runs, results, policies):
    text = ["## The whole mission in closed loop", "",
            "`tutti run`: the map grows, every update is answered, the radio is modelled; figures at the mission's end, "
            "medians over seeds.",
            "*full* are the LiDAR missions, closures found from scans (one seed). RPE and kink: raw -> corrected, mm.",
            ""]
    text += heading("mission", "seeds", "robot", "onboard RMSE m", "server", "policy", "constraints", "RMSE m",
                    "of the server's", "largest error m", "RPE 1 s mm", "RPE 10 m mm", "kink mm", "to the server mm")
    for key, title in [(f"full_{n}", f"{n} *full*") for n in runs.full] + [(f"loop_{n}", n)
                                                                          for n in SIMULATED + runs.real]:
        reports = list(results[key].values())
        for k, robot in enumerate(reports[0]["robots"]):
            robots = [report["robots"][k] for report in reports]
            for policy in policies:
                own = [r["policies"][policy] for r in robots]

                def med(name, entries=own, factor=1.0, digits=3):
                    value = median(e.get(name) for e in entries)
                    return number(None if value is None else factor * value, digits)
                ratios = [o["rmse_m"] / r["server_rmse_m"] for o, r in zip(own, robots)
                          if o["rmse_m"] is not None and r["server_rmse_m"]]

                def change(name):
                    return f"{med('onboard_' + name, robots, 1e3, 1)} -> {med(name, own, 1e3, 1)}"
                text.append(row(title, len(reports), robot["name"], med("onboard_rmse_m", robots),
                                med("server_rmse_m", robots), f"`{policy}`", med("constraints", digits=0),
                                med("rmse_m"), number(median(ratios), 2), med("max_error_m"), change("rpe_m"),
                                change("rpe_10m_m"), med("kink_m", factor=1e3, digits=1),
                                med("agreement_rmse_m", factor=1e3, digits=1)))
    return text + [""]


def standing(lines, policy=DEFAULT):
    """(seed, robot) -> updates of the map while it holds a wrong closure."""
    out = collections.defaultdict(list)
    for line in lines:
        if line["policy"] == policy and line["wrong_closures"] > 0 and line["onboard"]:
            out[line["seed"], line["robot"]].append(line)
    return out


def excess(line, key="rmse_m"):
    return line["corrected"][key] / min(line["onboard"][key], line["server"][key])


def revision_section(runs, results):
    every = [line for lines in results["loops_revision"].values() for line in lines]
    text = ["## While a wrong closure stands (*revision*)", "",
            "Every update of the map replayed without a radio. As long as the map holds a closure that is wrong by more "
            "than 0.5 m or",
            "2 degrees: the robot's RMSE over the better of raw odometry's and the server's, all three over the part of "
            "the run that the map",
            "knows. To hold: never above 1.5. *Taken at its word*: `server.proxy_graph.shape_deletions=0`.", ""]
    text += heading("policy", "robot", "seeds with a wrong closure", "updates", "ratio, median",
                    "largest of each seed, median (quartiles)", "largest of all", "seeds above 1.5",
                    "there: corrected / raw / server m", "largest ratio of the largest errors")
    trusting = [line for lines in results["loops_trusting_revision"].values() for line in lines]
    for title, lines, policy in ((f"`{DEFAULT}`", every, DEFAULT),
                                 (f"`{DEFAULT}`, every closure taken at its word", trusting, DEFAULT),
                                 ("`spectral`", every, "spectral"), ("`every_node`", every, "every_node")):
        found = standing(lines, policy)
        for robot in sorted({robot for _, robot in found}):
            seeds = [lines for (_, name), lines in found.items() if name == robot]
            worst = [max(map(excess, lines)) for lines in seeds]
            updates = [line for lines in seeds for line in lines]
            there = max(updates, key=excess)
            text.append(row(title, robot, f"{len(seeds)} of {len(runs.seeds)}", len(updates),
                            number(median(map(excess, updates)), 2), spread(worst, 2), number(max(worst), 2),
                            sum(w > 1.5 for w in worst),
                            " / ".join(number(there[key]["rmse_m"]) for key in ("corrected", "onboard", "server")),
                            number(max(excess(u, "max_m") for u in updates), 2)))
    return text + ["", "![Errors over time](images/selection_revision.svg)", ""]


def revision_plot(path, results):
    panels = {}
    for robot in ("alpha", "bravo"):
        for seed in sorted(results["loops_revision"])[:3]:
            def updates(key):
                return [line for line in results[key][seed]
                        if line["robot"] == robot and line["policy"] == DEFAULT and line["onboard"]]
            curves = {title: [(line["time_s"], line[key]["rmse_m"]) for line in updates("loops_revision")]
                      for title, key in ((DEFAULT, "corrected"), ("raw odometry", "onboard"), ("server", "server"))}
            curves["every closure taken at its word"] = [(line["time_s"], line["corrected"]["rmse_m"])
                                                         for line in updates("loops_trusting_revision")]
            panels[f"revision, seed {seed}, {robot}"] = curves
    svg_plot.write(path, panels, "mission time in s", "RMSE in m so far", x_log=False, y_log=False)


# ---- many seeds ------------------------------------------------------------------------------------------------------

def nothing_added(runs_of_seeds):
    return sum(all(line["constraints"] == 0 for line in lines) for lines in runs_of_seeds.values())


def detected(runs_of_seeds):
    return sum(any(line["disagrees"] and line["constraints"] > 0 for line in lines)
               for lines in runs_of_seeds.values())


def overlap(a, b):
    return min(a["until_s"], b["until_s"]) - max(a["from_s"], b["from_s"])


def origin_of(line):
    """(hit, error of the start in s, lengths in s of the true one and the mark, false marks); None without an origin."""
    true = [o for o in line["true_origins"] if o["until_s"] - o["from_s"] >= 1.0 or o["kind"] == "slip"]
    if not true:
        return None
    largest = max(true, key=lambda o: o["translation_m"])
    marks = line["origins"]
    false = sum(all(overlap(mark, o) < 0.0 for o in true) for mark in marks)
    hits = [mark for mark in marks if overlap(mark, largest) >= 0.0]
    if not hits:
        return False, math.inf, None, false
    mark = max(hits, key=lambda m: overlap(m, largest))
    return True, abs(mark["from_s"] - largest["from_s"]), mark["until_s"] - mark["from_s"], false


def origins_found(results, name):
    return [found for line in own_lines(results[f"many_{name}"], "alpha") if (found := origin_of(line))]


def many_section(runs, results):
    count = len(runs.many_seeds)
    text = [f"## {count} seeds", "", "One comparison at the end, by the default's own rule.", ""]
    text += heading("scenario", "seeds", "nothing added", "detected (disagreement, and links added)")
    for name in ("agree", "spin", "height"):
        text.append(row(name, count, nothing_added(results[f"many_{name}"]), detected(results[f"many_{name}"])))
    text.append(row("agree, closed loop (no update of any robot adds anything)", count,
                    nothing_added(results["loops_agree"]), detected(results["loops_agree"])))
    text += ["", "Where drift was born: the true origin with the largest shift (of alpha; those shorter than 1 s only if "
             "they are slips) against",
             "the marked stretch that overlaps it most. A seed without such a mark counts as a start error without "
             "bound. False marks overlap",
             "no true origin; ordinary drift, which is born everywhere, is not among the true ones.", ""]
    text += heading("scenario", "seeds", "marked", "start error s, median (quartiles)", "length of the mark s, median",
                    "seeds with false marks", "false marks")
    for name in ("terrace", "degenerate"):
        found = origins_found(results, name)
        text.append(row(name, len(found), sum(f[0] for f in found), spread([f[1] for f in found], 1),
                        number(median(f[2] for f in found), 1), sum(f[3] > 0 for f in found), sum(f[3] for f in found)))
    return text + [""]
