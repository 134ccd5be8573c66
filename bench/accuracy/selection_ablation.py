# SPDX-License-Identifier: BSD-3-Clause
"""The part of docs/results/selection.md on what was never used for tuning, and on what each part of the default is for."""
import collections

from runs import row
from selection_runs import ABLATION, DEFAULT, DETECTION, HELD_OUT, HELD_OUT_BUDGETS, POLICIES, SIMULATED
from selection_statistics import by_case, heading, median, number, own_lines, rmse


def held_cases(results, name):
    """robot -> title of the variant or policy -> budget -> lines."""
    out = collections.defaultdict(lambda: collections.defaultdict(dict))
    for robot, cases in by_case(results[f"held_{name}"]).items():
        for (policy, budget), lines in cases.items():
            out[robot][policy][budget] = lines
    for variant in ABLATION:
        for robot, cases in by_case(results[f"held_{variant}_{name}"]).items():
            for (_, budget), lines in cases.items():
                out[robot][variant][budget] = lines
    return out


def verdict_on_variant(results, variant, title):
    """One sentence from the medians over all held-out cases and budgets."""
    counts, added = collections.defaultdict(int), [0, 0, 0]
    worse, better = collections.Counter(), collections.Counter()
    for name in HELD_OUT:
        if name == "agree":
            cases = held_cases(results, name)
            for robot in cases.values():
                added[0] += sum(l["constraints"] > 0 for l in robot[variant][0])
                added[1] += sum(l["constraints"] > 0 for l in robot[DEFAULT][0])
                added[2] += len(robot[variant][0])
            continue
        for robot in held_cases(results, name).values():
            for budget in HELD_OUT_BUDGETS:
                own, other = (median(map(rmse, robot[p][budget])) for p in (DEFAULT, variant))
                kind = "same" if abs(other - own) <= max(0.03 * own, 0.001) else "worse" if other > own else "better"
                counts[kind] += 1
                if kind != "same":
                    (worse if kind == "worse" else better)[name] += 1
    total = sum(counts.values())
    where = [f"{words} in {', '.join(sorted(found))}" for words, found in (("worse", worse), ("better", better)) if found]
    judged = "changes nothing" if counts["same"] == total else \
        f"same {counts['same']}, worse {counts['worse']}, better {counts['better']} of {total}" + \
        (f" ({'; '.join(where)})" if where else "")
    return (f"- **{title}**: median RMSE against the default's (same: within 3 % or 1 mm): {judged}. In *agree* it adds "
            f"links in {added[0]} of {added[2]} robots, the default in {added[1]}.")


def detection_sentence(results):
    """What detection adds to accuracy, and to knowing when to be silent."""
    same, total, silent = collections.Counter(), 0, collections.Counter()
    for name in HELD_OUT:
        for robot in held_cases(results, name).values():
            if name == "agree":
                for key in (DEFAULT, *DETECTION, "always"):
                    silent[key] += sum(l["constraints"] == 0 for l in robot[key][0])
                silent["robots"] += len(robot[DEFAULT][0])
                continue
            for budget in HELD_OUT_BUDGETS:
                own = median(map(rmse, robot[DEFAULT][budget]))
                for key in (*DETECTION, "always"):
                    same[key] += median(map(rmse, robot[key][budget])) <= max(1.03 * own, own + 0.001)
                total += 1
    return (f"Where there is something to repair here, detection adds nothing to the accuracy in {same['always']} of {total} "
            "cases (scenario, robot, budget): the same placement without any is as good or better; with wavelets alone in "
            f"{same['wavelets']}, with ties alone in {same['ties']}, with a threshold on the aligned RMSE instead in "
            f"{same['rmse']}. Where there is nothing to repair (*agree*), robots that stay silent: {silent[DEFAULT]} of "
            f"{silent['robots']} with both, {silent['wavelets']} with wavelets, {silent['ties']} with ties, "
            f"{silent['rmse']} with the RMSE, {silent['always']} without detection. The section after this one compares "
            "them on all scenarios.")


def silence_spoken(results):
    """Held-out robots of *agree* that got links nevertheless."""
    lines = [l for l in own_lines(results["held_agree"]) if l["constraints"] > 0]
    return [f"In *agree*, seed {l['seed']}, {l['robot']} gets {l['constraints']} links: there raw odometry is off by "
            f"{number(l['onboard']['rmse_m'])} m, the server by {number(l['server']['rmse_m'])} m, and the robot ends at "
            f"{number(rmse(l))} m." for l in lines]


def noticed_section(runs, results):
    """Who notices what, by the default's own rule at the end of the mission."""
    text = ["## What notices a disagreement", "",
            "One comparison at the end, the default's own rule, its tests alone or together: in how many seeds links are "
            "added, and the",
            "median RMSE in metres. RMSE: links when the two are apart by more than 3 times what the server expects.", ""]
    names = {DEFAULT: "both", **{key: key for key in DETECTION}, "rmse": "RMSE"}
    text += heading("scenario", "robot", "seeds", "raw odometry m", "server m", *names.values())
    alone = collections.Counter()
    for name in SIMULATED + runs.real:
        found = {key: own_lines(results[f"curves_{name}" if key == DEFAULT else f"noticed_{key}_{name}"])
                 for key in names}
        for robot in sorted({l["robot"] for l in found[DEFAULT]}):
            of_robot = {key: [l for l in lines if l["robot"] == robot] for key, lines in found.items()}
            added = {key: sum(l["constraints"] > 0 for l in lines) for key, lines in of_robot.items()}
            for key in DETECTION:
                alone[key] += added[key] < added[DEFAULT]
            own = of_robot[DEFAULT]
            truth = [number(median(l[key]["rmse_m"] for l in own)) if own[0]["onboard"] else "-"
                     for key in ("onboard", "server")]
            text.append(row(name, robot, len(own), *truth,
                            *(f"{added[key]}, {number(median(map(rmse, lines)))}" for key, lines in of_robot.items())))
    return text + ["", f"Robots that wavelets alone would have left alone in some seed: {alone['wavelets']}; ties alone: "
                   f"{alone['ties']}; the RMSE: {alone['rmse']}. What wavelets are for beside ties: they need no closure "
                   "that comes back to the same place, and say where and at which scale.", ""]


def held_out_section(runs, results):
    seeds = runs.held_out_seeds
    text = ["## Held out", "",
            f"Seeds {seeds[0]} to {seeds[-1]} and other parameters of the scenarios (docs/simulation.md): never used to "
            "choose a setting, but looked at after every change. Median RMSE in",
            "metres. `every_node` and the policies' own rules as above; `uniform` uses the reduced solver like all.", "",
            detection_sentence(results), *silence_spoken(results), ""]
    text += [verdict_on_variant(results, variant, title) for variant, (title, _) in ABLATION.items()]
    text += [verdict_on_variant(results, "uniform", "`uniform` with the reduced solver"), ""]
    for name in HELD_OUT:
        for robot, cases in held_cases(results, name).items():
            sample = cases[DEFAULT][0]
            text += [f"### {name}, {robot}", "",
                     f"Onboard {number(median(l['onboard']['rmse_m'] for l in sample))} m, server "
                     f"{number(median(l['server']['rmse_m'] for l in sample))} m.", ""]
            text += heading("policy", *HELD_OUT_BUDGETS, "own rule (constraints)")
            titles = {**{p: f"`{p}`" for p in POLICIES}, **{v: f"`{DEFAULT}`, {t}" for v, (t, _) in ABLATION.items()}}
            for key, title in titles.items():
                own = cases[key][0]
                text.append(row(title, *(number(median(map(rmse, cases[key][b]))) if b in cases[key] else ""
                                         for b in HELD_OUT_BUDGETS),
                                f"{number(median(map(rmse, own)))} ({number(median(l['constraints'] for l in own), 0)})"))
            text.append("")
    return text
