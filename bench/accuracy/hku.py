#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs the two real LiDAR missions over seeds and drifts and writes docs/results/hku.md.

Usage: bench/accuracy/hku.py TUTTI_PROGRAM --data FOLDER [--seeds 10]
docs/data.md says what FOLDER holds.
"""
import argparse
import math
import statistics

from runs import mission_file, page, report_of, row, write_results


def run(arguments, mission, seed, *assignments):
    command = [arguments.tutti, "run", mission_file(mission), "--data", arguments.data, "--seed", seed]
    for assignment in assignments:
        command += ["--set", assignment]
    return report_of(*command, keep=arguments.keep)


def corrected(report, robot):
    return robot["policies"][report["default_policy"]]


def millimetres(value):
    return "-" if value is None else f"{1000 * value:.1f}"


def allowed(server_rmse_m):
    return None if server_rmse_m is None else 1.1 * server_rmse_m + 0.01


def two_sessions(arguments):
    lines = [row("seed", "components", "closures between robots", "wrong", "largest closure error",
                 "transform off by", "alpha / bravo to server, mm RMS", "constraints"), row(*["---"] * 8)]
    for seed in range(1, arguments.seeds + 1):
        report = run(arguments, "hku_two_sessions", seed)
        check, transform = report["server"]["closure_check"], report["transforms"][0]
        robots = [corrected(report, robot) for robot in report["robots"]]
        lines.append(row(seed, report["server"]["components"], report["server"]["closures_accepted_inter"], check["wrong"],
                         f"{check['max_error_m']:.3f} m, {check['max_error_deg']:.2f} deg",
                         f"{millimetres(transform['error_m'])} mm, {transform['error_deg']:.3f} deg",
                         " / ".join(millimetres(r["agreement_rmse_m"]) for r in robots),
                         " + ".join(str(r["constraints"]) for r in robots)))
    return lines


def degraded(arguments):
    lines = [row("seed", "server", "robot", "onboard", "server", "corrected", "allowed: 1.1 x server + 10 mm",
                 "RPE onboard", "RPE corrected", "constraints"), row(*["---"] * 10)]
    for seed in range(1, arguments.seeds + 1):
        report = run(arguments, "hku_degraded", seed)
        for robot in report["robots"]:
            own = corrected(report, robot)
            lines.append(row(seed, millimetres(report["server"]["rmse_m"]), robot["name"],
                             millimetres(robot["onboard_rmse_m"]), millimetres(robot["server_rmse_m"]),
                             millimetres(own["rmse_m"]), millimetres(allowed(robot["server_rmse_m"])),
                             millimetres(robot["onboard_rpe_m"]), millimetres(own["rpe_m"]), own["constraints"]))
    return lines


def drift_sweep(arguments):
    lines = [row("yaw drift", "onboard", "closures", "between robots", "wrong", "components", "server",
                 "corrected alpha / bravo"), row(*["---"] * 8)]
    for yaw in (0.1, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0):
        runs = []
        for seed in range(1, 4):
            sets = [f"robots.{i}.degrade.yaw_deg_per_m={sign * yaw}" for i, sign in ((0, 1), (1, -1))]
            sets += [f"robots.{i}.covariance.rotation_deg_per_sqrt_m={max(0.3, 2.3 * yaw)}" for i in (0, 1)]
            runs.append(run(arguments, "hku_degraded", seed, *sets))
        median = lambda values: statistics.median(v if v is not None else float("nan") for v in values)
        lines.append(row(
            f"{yaw} deg/m",
            f"{median(max(r['onboard_rmse_m'] or math.nan for r in report['robots']) for report in runs):.2f} m",
            f"{median(r['server']['closures_accepted'] for r in runs):.0f}",
            f"{median(r['server']['closures_accepted_inter'] for r in runs):.0f}",
            sum(r["server"]["closure_check"]["wrong"] if r["server"]["closure_check"] else 0 for r in runs),
            "/".join(str(r["server"]["components"]) for r in runs),
            f"{median(r['server']['rmse_m'] for r in runs):.3f} m",
            " / ".join(f"{median(corrected(r, r['robots'][i])['rmse_m'] for r in runs):.3f} m" for i in (0, 1))))
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tutti")
    parser.add_argument("--data", required=True)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--keep", help="folder for finished runs, which are not repeated")
    arguments = parser.parse_args()
    text = page(
        "HKU: two real LiDAR recordings of one place",
        ["Asked were one component, at least 60 closures between the robots, none wrong by more than 0.5 m or 2 degrees, a transform within",
         "30 mm and 0.15 degrees at bravo's centroid, and corrected robots within 20 mm RMS of the server."],
        two_sessions(arguments),
        ["bench/accuracy/hku.py TUTTI --data FOLDER   # these: missions/hku_two_sessions.yaml, bravo's frame drawn from the seed"],
        "Real scans and FAST-LIO2 odometry of both recordings, replayed side by side. There is no external ground truth: closures and",
        "the transform are compared with a reference derived from the same scans (repeatable to 1 mm and 0.013 degrees).",
        "The seed draws bravo's frame and nothing else, so equal rows say that nothing depends on the frame; they are not",
        "ten independent trials.",
        "",
        "## `missions/hku_degraded.yaml`: 0.3 degrees of yaw per metre and 0.3 % of scale, opposite signs",
        "",
        "Millimetres. RMSE against the undegraded odometry after one rigid alignment, at keyframes; server: both robots",
        "at once, then per robot. RPE over 1 s. To hold: server at most 50 mm; corrected as allowed; RPE no worse than",
        "the raw odometry's.",
        "",
        *degraded(arguments),
        "",
        "## How much drift it stands",
        "",
        "The same mission with other yaw drifts (the front end's stated uncertainty grows with it), medians of three",
        "seeds; closures wrong summed, components of each. Submap clouds are built with the drifting odometry, so they",
        "bend: a 10 s submap is about 5 m long.",
        "",
        *drift_sweep(arguments),
        "",
        "Read: up to 2 degrees/m the server stays below 9 cm, and its robots up to 1.5, although from 0.5 on submaps bend so much that",
        "some closures attach the right place with a pose more than 2 degrees or 0.5 m off: their covariances say so since a submap's own",
        "bend counts (docs/decisions/lidar-closures-at-mission-scale.md; before, 0.24 m at 1.5 and 3.69 m at 2 degrees/m). At 2 robots are",
        "decimetres off, and at 3 no closure is found. At 0.3 alpha's motion over a second is a tenth worse than its raw odometry's.",
    )
    write_results("hku.md", text)


if __name__ == "__main__":
    main()
