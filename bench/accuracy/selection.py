#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""How well robots agree with the server for how many constraints: writes docs/results/selection.md and its plots, and
the tables behind it (every budget, every robot, what is held out) to selection_details.md in the folder of --out.

Usage: bench/accuracy/selection.py TUTTI CURVES [--data ../shared/data] [--jobs 2] [--quick] [--keep FOLDER]
                                   [--out out/selection]
TUTTI and CURVES are the programs `tutti` and `tutti_selection_curves`. Both are built with TUTTI_BUILD_BENCH=ON, as
  scripts/install_dependencies.sh --bench
  cmake --preset bench && ninja -C build/bench tutti tutti_selection_curves
does; they are then build/bench/apps/tutti/tutti and build/bench/bench/accuracy/tutti_selection_curves.
Takes about 20 minutes on two cores with --data (1,163 s for all 1,705 jobs). Without --data (docs/data.md) the real
recordings are left out. With --keep, results stay there and finished jobs are not repeated: use a new folder for a new
program.
"""
import argparse
import math
import pathlib
import tempfile

from runs import SOURCE, row, write_results
from selection_ablation import held_cases, held_out_section, noticed_section
from selection_runs import DEFAULT, HELD_OUT, HELD_OUT_BUDGETS, POLICIES, REAL, SIMULATED, TARGET_BUDGET, Runs
from selection_sections import (curve_plot, curves_section, detected, excess, loop_section, many_section, nothing_added,
                                origins_found, revision_plot, revision_section, standing, write_csv)
from selection_statistics import by_case, heading, median, number, own_lines, quantile, ratio, rmse

ALLOWED_RATIO, ALLOWED_M = 1.1, 0.01


def contest(cases, budget):
    """(the default's median RMSE, the best other's, its name). Only policies that keep to the budget take part."""
    medians = {}
    for (policy, given), lines in cases.items():
        if given == budget or policy == "every_node":
            if policy == DEFAULT or max(line["constraints"] for line in lines) <= budget:
                medians[policy] = median(map(rmse, lines))
    own = medians.pop(DEFAULT)
    best = min(medians, key=medians.get)
    return own, medians[best], best


def too_much(own, best):
    return own - (ALLOWED_RATIO * best + ALLOWED_M)


def reached(good):
    return "reached" if good else "**missed**"


def first_target(results):
    for name, budget in TARGET_BUDGET.items():
        for robot, cases in by_case(results[f"curves_{name}"]).items():
            lines = cases[DEFAULT, budget]
            value, used = median(map(ratio, lines)), max(l["constraints"] for l in lines)
            yield row(f"1. {name}, {robot}: within 1.1x of the server with at most {budget} constraints",
                      f"{value:.2f}x (quartiles {number(quantile(list(map(ratio, lines)), 0.25), 2)} - "
                      f"{number(quantile(list(map(ratio, lines)), 0.75), 2)}) with {used} at most",
                      reached(value <= 1.1 and used <= budget))


def second_target(runs, results):
    contests = []
    for name in SIMULATED + runs.real:
        if name in ("agree", "revision"):
            continue
        for robot, cases in by_case(results[f"curves_{name}"]).items():
            for budget in runs.budgets:
                own, best, policy = contest(cases, budget)
                contests.append((too_much(own, best), name, robot, budget, own, best, policy))
    lost = sorted((c for c in contests if c[0] > 0.0), reverse=True)
    return contests, lost


def local_quality(runs, results):
    """Shares of robots and seeds whose correction (own rule) left RPE as good as raw odometry's, to a micrometre."""
    for key, title in (("rpe_1s_m", "RPE over 1 s"), ("rpe_10m_m", "RPE over 10 m")):
        lines = [l for name in SIMULATED + runs.real for l in own_lines(results[f"curves_{name}"]) if l["corrected"]]
        worse = [l for l in lines if l["corrected"][key] > l["onboard"][key] + 1e-6]
        factors = [l["corrected"][key] / l["onboard"][key] for l in worse]
        server_too = sum(l["server"][key] > l["onboard"][key] for l in worse)
        yield row(f"local quality: {title} never worse than raw odometry's",
                  f"worse in {len(worse)} of {len(lines)}, more than 1 % in {sum(f > 1.01 for f in factors)}, more than "
                  f"5 % in {sum(f > 1.05 for f in factors)}, at worst {max(factors, default=1.0):.2f}x; in {server_too} of "
                  "them the server's map is worse than raw odometry, too", reached(not worse))


def why_lost(results, lost):
    """Where target 2 is missed: whether the robot is as good as the map that it follows, or whatever beat it is better."""
    text = ["", "What the default and the policy that beat it made of it (medians, where the default loses most): a robot "
            "that ends at the",
            "server's map is as wrong as the map; what lies between the map and raw odometry can be better if the two are wrong "
            "in opposite ways",
            "(seeds of a recording share its odometry, so they share that luck).", ""]
    text += heading("scenario", "robot", "budget", "raw odometry m", "server m", "default m", "default to the server m",
                    "other m", "other to the server m", "other better than the map")
    for name, robot in sorted({entry[1:3] for entry in lost}):
        budget, policy = max(entry for entry in lost if entry[1:3] == (name, robot))[3::3]
        cases = by_case(results[f"curves_{name}"])[robot]
        own, other = cases[DEFAULT, budget], cases[policy, 0] if policy == "every_node" else cases[policy, budget]
        server = [l["server"]["rmse_m"] for l in own]
        text.append(row(name, robot, budget, number(median(l["onboard"]["rmse_m"] for l in own)), number(median(server)),
                        number(median(map(rmse, own))), number(median(l["agreement_m"] for l in own)),
                        f"{number(median(map(rmse, other)))} `{policy}`", number(median(l["agreement_m"] for l in other)),
                        f"{sum(rmse(l) < s for l, s in zip(other, server))} of {len(other)}"))
    return text


def verdict(runs, results):
    text = ["## The targets", "", "Computed from what follows.", ""] + heading("target", "measured", "")
    text += first_target(results)
    contests, lost = second_target(runs, results)
    worst = f"; worst: {lost[0][1]}, {lost[0][2]} with {lost[0][3]}: {lost[0][4]:.3f} m, `{lost[0][6]}` " \
            f"{lost[0][5]:.3f} m" if lost else ""
    text.append(row("2. at every budget, except in *agree* and *revision*: at most 1.1x the best other policy + 1 cm",
                    f"{len(contests) - len(lost)} of {len(contests)} (scenario, robot, budget){worst}", reached(not lost)))
    count = len(runs.many_seeds)
    for title, silent in (("one comparison", nothing_added(results["many_agree"])),
                          ("closed loop", nothing_added(results["loops_agree"]))):
        text.append(row(f"3. *agree*, {title}: nothing added in at least 99 %", f"{silent} of {count}",
                        reached(silent >= 0.99 * count)))
    for name in ("spin", "height"):
        found = detected(results[f"many_{name}"])
        text.append(row(f"3. *{name}*: detected always", f"{found} of {count}", reached(found == count)))
    for name in ("terrace", "degenerate"):
        found = origins_found(results, name)
        hits, error = sum(f[0] for f in found), median(f[1] for f in found)
        text.append(row(f"4. {name}: the marked interval overlaps the true one in at least 95 %",
                        f"{hits} of {len(found)}", reached(found and hits >= 0.95 * len(found))))
        text.append(row(f"4. {name}: median error of the start under 5 s",
                        "-" if error is None else number(error, 1) + ("" if math.isinf(error) else " s"),
                        reached(error is not None and error < 5.0)))
    held = [(too_much(*contest({(p, b): l for p in POLICIES for b, l in cases[p].items()}, budget)[:2]), name)
            for name in HELD_OUT if name != "agree" for cases in held_cases(results, name).values()
            for budget in HELD_OUT_BUDGETS]
    good = sum(h[0] <= 0.0 for h in held)
    text.append(row("5. held out: target 2 on seeds and parameters never used for tuning",
                    f"{good} of {len(held)}" + (f"; missed in {', '.join(sorted({h[1] for h in held if h[0] > 0}))}"
                                                if good < len(held) else ""), reached(good == len(held))))
    worst = {key: max(map(excess, lines)) for key, lines in standing(
        [l for lines in results["loops_revision"].values() for l in lines]).items()}
    seeds = {seed for seed, _ in worst}
    bad = {seed for (seed, _), value in worst.items() if value > 1.5}
    text.append(row("*revision*: at most 1.5x the better map while the wrong closure stands",
                    f"at most {max(worst.values()):.2f}x; above 1.5x in {len(bad)} of {len(seeds)} seeds"
                    if worst else "no wrong closure was accepted", reached(worst and not bad)))
    text += local_quality(runs, results)
    if lost:
        text += ["", f"Target 2 is missed in these {len(lost)} cases (medians, metres):", ""]
        text += heading("scenario", "robot", "budget", "default", "best other", "allowed", "too much by")
        text += [row(name, robot, budget, number(own), f"{number(best)} `{policy}`",
                     number(ALLOWED_RATIO * best + ALLOWED_M), number(by))
                 for by, name, robot, budget, own, best, policy in lost]
        text += why_lost(results, lost)
    return text + [""]


def introduction(runs):
    quick = ["**A quick run: few seeds and budgets, only to test the script. No figure here is a result.**", ""]
    return ["# Which constraints, and how many", "",
            "Written by `bench/accuracy/selection.py TUTTI CURVES --data FOLDER`; nothing in it is typed by hand.", "",
            *(quick if runs.arguments.quick else []),
            "- **Simulated, trajectories only**: " + ", ".join(SIMULATED) + ". Odometry with known errors; closures are "
            "the true relative",
            "  poses plus noise, some of them wrong. tunnel and terrace have the size of the paper's missions and are "
            "run here with",
            "  `simulation.sensors=none closures.finder=reference` (tunnel: `closures.reference.radius_m=1.5`), but for "
            "the *full* ones.",
            "- **Replayed**: " + ", ".join(n for n in REAL if not n.startswith("hku"))
            + ". Real odometry and ground truth; closures",
            "  are the true relative poses plus noise, because the sensor data are not at hand.",
            "- **Real**: hku_two_sessions, hku_degraded. Real odometry (in the second one made worse on purpose) and "
            "scans; closures",
            "  are found from the scans alone."
            + ("" if runs.real else " Without `--data`: left out in this run, like the replayed ones."), "",
            f"`{DEFAULT}` is the default. `every_node`: a link to every proxy node. `spectral`: the paper's. `uniform`, "
            "`random`: evenly spread,",
            "drawn. `euclidean`: where distances are largest. `skeleton`: splits the run until every node is close to the "
            "map. RMSE is ATE",
            "after one rigid alignment without scale. RPE: of the translation, root mean square. Kink: the most that the "
            "correction changes",
            "any motion over 1 s of the raw odometry. A policy takes part at a budget when no "
            "seed of it holds more.", "",
            "**Terms are not equal.** The default's links are five times stiffer than the competitors' where few closures "
            "support them",
            "(`constraint.trust` 0.02 against 0.1), `spectral` runs with the paper's thresholds only, not with the authors' "
            "own classifier",
            "(`top`), and held-out seeds, though never used to choose a setting, were looked at after every change. Budgets "
            "are those of one",
            "comparison; links are not transmitted, so few of them are a convenience, not a saving.", ""]


def plots(runs):
    return ["![Budget curves, simulated](images/selection_simulated.svg)", ""] + \
        (["![Budget curves, real recordings](images/selection_real.svg)", ""] if runs.real else [])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tutti")
    parser.add_argument("curves")
    parser.add_argument("--data")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--quick", action="store_true", help="2 seeds, 3 budgets, no full missions: tests the script")
    parser.add_argument("--seeds", type=int, default=10, help="of the budget curves and of what is held out")
    parser.add_argument("--many", type=int, default=100, help="seeds where a rate is measured")
    parser.add_argument("--keep", metavar="FOLDER")
    parser.add_argument("--out", metavar="FOLDER", default=SOURCE / "out" / "selection", help="for the details")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        runs = Runs(arguments, arguments.keep or scratch)
        results = runs.all()
    folder = SOURCE / "docs" / "results"
    text = introduction(runs) + verdict(runs, results) + many_section(runs, results) + \
        revision_section(runs, results) + loop_section(runs, results, [DEFAULT]) + noticed_section(runs, results) + \
        ["## More", "",
         "The same command writes the budget curves of every robot, all policies in closed loop and what was held out to",
         "`out/selection/selection_details.md`; `selection.csv` has every figure of the curves.", "",
         *plots(runs)]
    details = ["# Behind docs/results/selection.md", ""] + \
        loop_section(runs, results, [DEFAULT, "spectral", "every_node"]) + held_out_section(runs, results) + \
        curves_section(runs, results)
    curve_plot(folder / "images" / "selection_simulated.svg", results, SIMULATED, runs.budgets)
    if runs.real:
        curve_plot(folder / "images" / "selection_real.svg", results, runs.real, runs.budgets)
    revision_plot(folder / "images" / "selection_revision.svg", results)
    write_csv(folder / "selection.csv", results, SIMULATED + runs.real)
    write_results("selection.md", text)
    out = pathlib.Path(arguments.out)
    out.mkdir(parents=True, exist_ok=True)
    (out / "selection_details.md").write_text("\n".join(details).rstrip() + "\n")


if __name__ == "__main__":
    main()
