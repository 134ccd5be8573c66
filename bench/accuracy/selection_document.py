# SPDX-License-Identifier: BSD-3-Clause
"""docs/results/selection.md from the results of selection_jobs.Jobs: tables, and sentences into which figures go."""
import collections
import math
import statistics

from runs import page, row
from selection_jobs import (ABLATIONS, DEFAULT, FLEETS, LEAST_M, OLD, SHORT_S, TOP, rows_of)

POLICIES = ["none", "every_node", "every_node_2", "spectral", TOP, "uniform", "random", "skeleton", OLD, DEFAULT]


def quantile(values, share):
    """Linear between the neighbours; None without values."""
    found = sorted(v for v in values if v is not None)
    if not found:
        return None
    place = share * (len(found) - 1)
    low = math.floor(place)
    return found[low] + (place - low) * (found[min(low + 1, len(found) - 1)] - found[low])


def median(values):
    return quantile(values, 0.5)


def largest(values):
    return quantile(values, 1.0)


def number(value, digits=2, unit=""):
    return "-" if value is None else f"{value:.{digits}f}{unit}"


def spread(values, digits=2):
    values = list(values)
    return " / ".join(number(quantile(values, share), digits) for share in (0.5, 0.9, 1.0))


def heading(*cells):
    return [row(*cells), row(*["---"] * len(cells))]


def ratio(line):
    """Final error over the server's; None where either is not scored on the whole distance."""
    own, server = line["own_rmse_m"], line["server_rmse_m"]
    return own / server if own is not None and server else None


def where(line):
    return f"{line['mission']} {line['robot']}, seed {line['seed']}"


def corrected(lines):
    return [line for line in lines if line["links"] > 0 and ratio(line) is not None]


def verdict(good):
    return "not run" if good is None else "reached" if good else "**missed**"


class Results:
    """Rows by kind of job."""

    def __init__(self, jobs, old):
        self.jobs, self.of = jobs, collections.defaultdict(list)
        names = {"top": {"spectral": TOP}}
        for key in jobs.jobs:
            result = jobs.result(key)
            if result is not None and key[0] == "calibration":
                self.of["calibration"] += [{"mission": key[1], **line} for line in result]
            elif result is not None:
                self.of[key[0]] += rows_of(result, *key[1:], names.get(key[0]))
        have = {(line["mission"], line["seed"]) for line in self.of["policies"]}
        self.of["old"] = [line for line in old if (line["mission"], line["seed"]) in have]
        self.lines = self.of["policies"] + self.of["top"] + self.of["old"]

    def default(self, kind="policies", mission=None):
        return [line for line in self.of[kind]
                if line["policy"] == DEFAULT and (mission is None or line["mission"] == mission)]


# ---- the tables ------------------------------------------------------------------------------------------------------

def policy_table(lines):
    text = heading("policy", "robots corrected", "final RMSE over the server's", "RMSE over the server's, all robots",
                   "harm, times", "harm, m", "RPE 1 s, mm", "RPE 10 m, mm", "RPE worse: 1 s, 10 m", "links",
                   "update ms: median, largest")
    scored = [line for line in lines if line["onboard_rmse_m"] is not None]
    for title, who in (("*odometry*", "onboard"), ("*map*", "server")):
        runs = {(line["mission"], line["seed"], line["robot"]): line for line in scored if line["policy"] == DEFAULT}
        text.append(row(title, *[""] * 5, *(number(median(1e3 * line[f"{who}_{key}"] for line in runs.values()
                                                          if line[f"{who}_{key}"] is not None), 1)
                                            for key in ("rpe_m", "rpe_10m_m")), *[""] * 3))
    for policy in POLICIES:
        own = [line for line in lines if line["policy"] == policy]
        if not own:
            continue
        held = corrected(own)

        def rpe(key):
            return number(median(1e3 * line[f"own_{key}"] for line in own if line[f"own_{key}"] is not None), 1)

        def worse(key):
            pairs = [(line[f"own_{key}"], line[f"onboard_{key}"]) for line in held]
            return sum(a > 1.05 * b for a, b in pairs if a is not None and b is not None)
        text.append(row(f"`{policy}`" if policy not in (TOP, OLD) else policy, f"{len(held)} of {len(own)}",
                        spread(map(ratio, held)), spread(map(ratio, own)), spread([l["harm"] for l in own]),
                        spread([l["harm_m"] for l in own]), rpe("rpe_m"), rpe("rpe_10m_m"),
                        f"{worse('rpe_m')}, {worse('rpe_10m_m')}", number(median(l["links"] for l in held), 0),
                        f"{number(median(l['median_ms'] for l in own), 1)}, {number(largest(l['max_ms'] for l in own), 0)}"))
    if harmed := [l for l in lines if l["policy"] == DEFAULT and l["harm_m"] is not None]:
        worst = max(harmed, key=lambda l: l["harm_m"])
        text += ["", f"The default's largest harm: {worst['harm_m']:.2f} m, {where(worst)}; over 1.5 times in "
                 f"{sum(l['harm'] > 1.5 for l in harmed)} of {len(harmed)} robots."]
    return text + [""]


def mission_table(results):
    shown = ["every_node", "skeleton", TOP, OLD]
    text = heading("mission", "runs", "odometry m", "map m", "default m", "default over map", *(f"{p} over map" for p in shown),
                   "links", "update ms", "kB per broadcast (old)")
    for mission in results.jobs.missions + results.jobs.fleets:
        lines = [line for line in results.lines if line["mission"] == mission]
        own = [line for line in lines if line["policy"] == DEFAULT]
        if not own:
            continue

        def over_map(policy):
            return number(median(filter(None, map(ratio, (l for l in lines if l["policy"] == policy)))))

        def bytes_of(policy):
            return number(median(l["broadcast_bytes"] / 1e3 for l in lines if l["policy"] == policy), 1)
        text.append(row(mission, len(own), *(number(median(l[key] for l in own), 3)
                                             for key in ("onboard_rmse_m", "server_rmse_m", "own_rmse_m")),
                        over_map(DEFAULT), *map(over_map, shown), number(median(l["links"] for l in own), 0),
                        number(median(l["median_ms"] for l in own), 1), f"{bytes_of(DEFAULT)} ({bytes_of(OLD)})"))
    return text + [""]


def calibration_table(results):
    text = heading("mission", "tests", "rejected, mean", "worst robot")
    by_mission = collections.defaultdict(lambda: collections.defaultdict(list))
    for line in results.of["calibration"]:
        by_mission[line["mission"]][line["robot"]].append(line["rejected"] / line["draws"])
    for mission, robots in by_mission.items():
        shares = [share for found in robots.values() for share in found]
        worst = max(robots, key=lambda robot: statistics.mean(robots[robot]))
        text.append(row(mission, len(shares), f"{statistics.mean(shares):.1%}",
                        f"{worst} {statistics.mean(robots[worst]):.1%}"))
    return text + [""]


def moved(results, title):
    """Missions in which a robot's error changes in every seed the same way, by 3 % and by 2 mm: {mission: (its mean error by
    the default, without it)}. Seed by seed, as a mission's seeds differ more from each other than from what is switched off."""
    out = {}
    for mission in results.jobs.missions:
        def errors(kind):
            return {(l["robot"], l["seed"]): l["own_rmse_m"] for l in results.default(kind, mission) if l["own_rmse_m"] is not None}
        base, changed = errors("policies"), errors(f"without {title}")
        for robot in sorted({robot for robot, _ in changed}):
            pairs = [(base[key], error) for key, error in changed.items() if key[0] == robot and key in base]
            shifts = [after - before for before, after in pairs]
            if not pairs or (min(shifts) < 0.0 < max(shifts)):
                continue
            if any(abs(after - before) <= max(0.002, 0.03 * before) for before, after in pairs):
                continue
            before, after = (statistics.mean(values) for values in zip(*pairs))
            if mission not in out or abs(after - before) > abs(out[mission][1] - out[mission][0]):
                out[mission] = (before, after)
    return out


def ablation_table(results):
    text = heading("without", "final RMSE over the server's", "harm, times", "agree: robots with links",
                   "revision, while wrong", "moves: mission (RMSE with, without it, m)")
    for title in [None, *ABLATIONS]:
        kind = "policies" if title is None else f"without {title}"
        lines = [l for l in results.default(kind) if l["mission"] not in FLEETS and
                 (title is None or l["seed"] in results.jobs.seeds[:2])]
        if not lines:
            continue
        changes = {} if title is None else moved(results, title)
        words = ", ".join(f"{m} ({a:.3f}, {b:.3f})" for m, (a, b) in sorted(changes.items())) or "nothing"
        agree = [l for l in lines if l["mission"] == "agree"]
        text.append(row(title or "*nothing*", spread(map(ratio, corrected(lines))), spread([l["harm"] for l in lines]),
                        f"{sum(l['most_links'] > 0 for l in agree)} of {len(agree)}",
                        number(largest(l["harm_while_wrong"] for l in lines if l["mission"] == "revision")),
                        "" if title is None else words))
    return text + [""]


# ---- what was asked --------------------------------------------------------------------------------------------------

def per_run(lines):
    runs = collections.defaultdict(list)
    for line in lines:
        runs[line["mission"], line["seed"]].append(line)
    return list(runs.values())


def first_line(results):
    lines = results.default()
    held = corrected(lines)
    values = [ratio(l) for l in held]
    if held:
        worst = max(held, key=ratio)
        p90 = quantile(values, 0.9)
        yield ("1. final RMSE over the server's where it corrects: at most 1.03 at the 90th percentile, 1.10 at worst",
               f"{number(p90)}, {number(max(values))} ({where(worst)}; {worst['own_rmse_m'] - worst['server_rmse_m']:+.3f} m); "
               f"{sum(v > 1.1 for v in values)} of {len(values)} above 1.10", p90 <= 1.03 and max(values) <= 1.1)
    silent = [all(l["most_links"] == 0 for l in run) for run in per_run(results.default("many", "agree"))]
    if silent:
        yield ("1. *agree*: no robot ever holds a link", f"{sum(silent)} of {len(silent)} seeds", all(silent))
    for mission in ("spin", "height"):
        done = [all(l["links"] > 0 and l["own_rmse_m"] < 0.5 * l["onboard_rmse_m"] for l in run)
                for run in per_run(results.default("many", mission))]
        if done:
            yield (f"1. *{mission}*: corrected (links, and less than half of odometry's error)",
                   f"{sum(done)} of {len(done)} seeds", all(done))
    wrong = [l for l in results.default("many", "revision") if l["harm_while_wrong"] is not None]
    if wrong:
        worst = max(wrong, key=lambda l: l["harm_while_wrong"])
        yield ("1. *revision*: while the wrong closure stands at most 2 times the better of map and odometry",
               f"{number(worst['harm_while_wrong'])} at worst ({worst['robot']}, seed {worst['seed']}); above 2 in "
               f"{sum(l['harm_while_wrong'] > 2 for l in wrong)} of {len(wrong)}", worst["harm_while_wrong"] <= 2)


def second_line(results):
    lines = results.of["calibration"]
    if not lines:
        return
    robots = collections.defaultdict(list)
    for line in lines:
        robots[line["mission"], line["robot"]].append(line["rejected"] / line["draws"])
    means = {key: statistics.mean(shares) for key, shares in robots.items()}
    mean, worst = statistics.mean(s for shares in robots.values() for s in shares), max(means, key=means.get)
    yield ("2. draws of the map's posterior rejected at alpha 1 %: at most 2 % on average, 5 % of any robot's",
           f"{mean:.1%}; {' '.join(worst)} {means[worst]:.1%}; above 5 %: {sum(m > 0.05 for m in means.values())} of "
           f"{len(means)} robots", mean <= 0.02 and means[worst] <= 0.05)


def third_line(results):
    def milliseconds(policy, key, mission=None):
        return [l[key] for l in results.lines
                if l["policy"] == policy and l[key] is not None and (mission is None or l["mission"] == mission)]
    tunnel = [median(milliseconds(p, "median_ms", "tunnel")) for p in (DEFAULT, "every_node")]
    if None not in tunnel:
        yield ("3. update no slower than `every_node`'s, in tunnel", f"{tunnel[0]:.1f} and {tunnel[1]:.1f} ms",
               tunnel[0] <= tunnel[1])
    if slowest := [l for l in results.default() + results.default("room") if l["max_ms"] is not None]:
        worst = max(slowest, key=lambda l: l["max_ms"])
        yield ("3. at worst 60 ms, two robots in one room for 15 minutes included", f"{worst['max_ms']:.0f} ms ({where(worst)}, {worst['nodes']} nodes)",
               worst["max_ms"] <= 60)
    if shares := [(max(l["server_ms"] for l in run) / len(run), run[0]) for run in per_run(results.default())
                  if run[0]["server_ms"] is not None]:
        share, line = max(shares, key=lambda entry: entry[0])
        yield ("3. server's share per robot and update below 0.3 s (here the server's whole update over robots)",
               f"{1e-3 * share:.2f} s at worst ({line['mission']}, seed {line['seed']})", share <= 300)
    before = {(l["mission"], l["seed"], l["robot"]): l["broadcast_bytes"] for l in results.of["old"]}
    more = {l["mission"]: l["broadcast_bytes"] - before[l["mission"], l["seed"], l["robot"]] for l in results.default()
            if (l["mission"], l["seed"], l["robot"]) in before}
    if more:
        worst = max(more, key=more.get)
        yield ("3. at most 2 kB more per broadcast (mean of a mission)", f"{more[worst] / 1e3:+.2f} kB at most ({worst})",
               more[worst] <= 2000)


def fourth_line(results):
    for title in ABLATIONS:
        if results.of[f"without {title}"]:
            changes = sorted(moved(results, title))
            wrong = [largest(l["harm_while_wrong"] for l in results.default(kind)
                             if l["mission"] == "revision" and l["seed"] in results.jobs.seeds[:2])
                     for kind in ("policies", f"without {title}")]
            if None not in wrong and wrong[0] <= 2.0 < wrong[1]:
                changes.append(f"revision while wrong ({wrong[0]:.2f}, {wrong[1]:.2f})")
            yield f"4. without {title} something moves in every seed", ", ".join(changes) or "nothing", bool(changes)


def fifth_line(results):
    lines = [l for l in results.default("short") if ratio(l) is not None and l["tied"]]
    if lines:
        worst = max(lines, key=ratio)
        values = [ratio(l) for l in lines]
        yield (f"5. missions cut to {SHORT_S} s: within 1.1 times the server's error",
               f"{sum(v <= 1.1 for v in values)} of {len(values)} robots; {spread(values)}; worst {where(worst)}: "
               f"{worst['own_rmse_m']:.3f} m, map {worst['server_rmse_m']:.3f}, odometry {worst['onboard_rmse_m']:.3f}, "
               f"{worst['links']} links", max(values) <= 1.1)


def as_good(results):
    """Which policies meet what line 1 asks of the final error, where they correct."""
    good = []
    for policy in POLICIES:
        values = [ratio(l) for l in corrected([l for l in results.lines if l["policy"] == policy])]
        if values and quantile(values, 0.9) <= 1.03 and max(values) <= 1.1:
            good.append(f"`{policy}`")
    return ", ".join(good) or "none"


def document(jobs, old):
    results = Results(jobs, old)
    of_tree = [l for l in results.lines if l["mission"] not in FLEETS]
    of_fleets = [l for l in results.lines if l["mission"] in FLEETS]
    seeds = sorted({l["seed"] for l in results.lines})
    missing = [f"{' '.join(map(str, key))}" for key in jobs.jobs if not jobs.path(key).exists()]
    asked = heading("asked", "measured", "")
    for part in (first_line, second_line, third_line, fourth_line, fifth_line):
        asked += [row(line, found, verdict(good)) for line, found, good in part(results)]
    text = page(
        "How a robot chooses its links",
        ["Asked was which policy corrects robots best without ever harming one (harm: the robot's error over the better of map's and odometry's)."],
        asked, ["bench/accuracy/selection.py TUTTI CALIBRATION_PROGRAM --data FOLDER   # CONTRIBUTING.md"],
        f"Whole missions in closed loop, {len(seeds)} seeds; tunnel, terrace and demo as",
        "trajectories with closures from the truth. All policies of a run answer the same broadcasts: what a robot uploads",
        "is raw odometry, whatever it corrects. Weights of links are the same for all, but the column *old default* is",
        "recorded from the program before (its own map, its own weights). `uniform` and `random` hold as many links as",
        "`spectral` does. Three figures with slashes: median, 90th percentile, worst, over all robots, missions and seeds.",
        "",
        "Corrected: the robot holds links at the end. Errors are ATE, RMSE, after one rigid alignment each (docs/report.md).",
        "Harm: after any broadcast, the robot's error over the better of map's and odometry's (taken for at least "
        f"{LEAST_M:g} m), and",
        "less that. RPE worse: corrected robots that are off by over 5 % more than odometry. "
        f"Times with {jobs.arguments.jobs} processes on two cores{jobs.arguments.note and '; '}{jobs.arguments.note}.")
    text += ["", f"What line 1 asks of the final error, wherever they correct, is met by: {as_good(results)}.", "",
             "## The missions of the tree", "", *policy_table(of_tree)]
    if of_fleets:
        text += ["## Fleets", "", "4 and 8 robots of half an hour in a network of 8 x 8 blocks (`missions/fleet.yaml`).",
                 "", *policy_table(of_fleets)]
    text += ["## Mission by mission", "", "Medians over robots and seeds; over map: final error over the server's, also of "
             "robots without links.", "", *mission_table(results)]
    if results.of["calibration"]:
        text += ["## False alarms", "", "200 draws of the map's own posterior, at every tenth update and the last, seed 1, put "
                 "through the robot's test at 1 %.", "", *calibration_table(results)]
    if any(results.of[f"without {title}"] for title in ABLATIONS):
        text += ["## Each mechanism switched off", "", "The default, seeds 1 and 2, on missions where any of these ever moved something. Moves: a robot's error changes in every "
                 "seed the same way, by 3 % and by 2 mm;", "of each mission the robot that moves most.", "",
                 *ablation_table(results)]
    if missing:
        text += [f"Not run, or failed: {len(missing)} of {len(jobs.jobs)} jobs.", ""]
    return text
