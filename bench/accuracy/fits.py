#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs a small mission with every mistake of `mistakes:`, and honest ones, and writes docs/results/fits.md.

Usage: bench/accuracy/fits.py TUTTI_PROGRAM --data FOLDER
docs/data.md says what FOLDER holds.
"""
import argparse

from runs import mission_file, page, report_of, row, write_results

SMALL = ["simulation.world.network={rows: 2, columns: 2, block_m: 10.0, jitter_m: 1.0}",
         "simulation.robots.0.walk.duration_s=120", "simulation.robots.1.walk.duration_s=120"]
MISTAKES = ["scans_late", "lidar_ahead", "lidar_turned", "lidar_head_down", "mirrored", "millimetres", "world_cloud",
            "ned_positions", "ned", "inverse_poses", "w_first", "frozen", "drift", "scale"]
HONEST = [("hku_two_sessions, real", "hku_two_sessions", []),
          ("demo", "demo", []),
          ("demo, 64 beams", "demo", SMALL + ["simulation.lidar.model=64-beam"]),
          ("demo, rosette like a Livox's", "demo", SMALL + ["simulation.lidar.model=rosette"]),
          ("demo, ranges of 5 cm noise", "demo", SMALL + ["simulation.lidar.range_sigma_m=0.05"]),
          ("demo, tunnels without features", "demo", SMALL + ["simulation.world.featureless_share=1.0"]),
          ("terrace, odometry fails on the roof", "terrace", ["closures.verifier=lidar"]),
          ("degenerate", "degenerate", ["simulation.sensors=lidar"]),
          ("hall_mixed", "hall_mixed", [])]


def run(arguments, mission, assignments):
    command = [arguments.tutti, "run", mission_file(mission), "--data", arguments.data]
    for assignment in assignments:
        command += ["--set", assignment]
    return report_of(*command, keep=arguments.keep)


def said(report):
    return "; ".join(f"{robot['name']}: {misfit['says']}" for robot in report["robots"] for misfit in robot["misfits"])


def metres(value):
    return "-" if value is None else f"{value:.3f}"


def map_of(report):
    server = report["server"]
    return (f"{server['components']}", f"{server['closures_accepted_inter']}",
            metres(max((robot["server_rmse_m"] or 0.0) for robot in report["robots"])))


def mistakes(arguments):
    lines = [row("bravo's mistake", "reported", "maps", "closures between robots", "worst robot in the server's map, m"),
             row(*["---"] * 5)]
    report = run(arguments, "demo", SMALL)
    lines.append(row("none", said(report) or "nothing", *map_of(report)))
    for kind in MISTAKES:
        report = run(arguments, "demo", SMALL + [f"mistakes=[{{robot: bravo, kind: {kind}}}]"])
        lines.append(row(f"`{kind}`", said(report) or "**nothing**", *map_of(report)))
    report = run(arguments, "demo", SMALL + ["mistakes=[{robot: bravo, kind: frozen}]", "agent.submap.fit.scans=say"])
    lines.append(row("`frozen`, `agent.submap.fit.scans=say`", said(report) or "**nothing**", *map_of(report)))
    return lines


def honest(arguments):
    lines = [row("recording", "reported"), row("---", "---")]
    for name, mission, assignments in HONEST:
        lines.append(row(name, said(run(arguments, mission, assignments)) or "nothing"))
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tutti")
    parser.add_argument("--data", required=True)
    parser.add_argument("--keep", help="folder in which reports are kept, so that a run that was stopped goes on")
    arguments = parser.parse_args()
    text = page(
        "Does a robot fit itself?",
        ["Asked was whether a robot's own scans show that it is set up wrongly or that its odometry fails, without a false alarm."],
        mistakes(arguments),
        ["bench/accuracy/fits.py TUTTI --data FOLDER"],
        "A robot registers each keyframe's scan on the one before and compares this motion with odometry's",
        "(`src/tutti/perception/fit`). What it reports is the warning at the head of the report. Simulated: `missions/demo.yaml` in a",
        "tunnel of 2 x 2 blocks of 10 m, 120 s, two robots with 16 beams, seed 1; bravo is set up wrongly (`docs/simulation.md`).",
        "Nothing is corrected of the mistakes of setting up: the warning has what to type. Where odometry stood still (`frozen`),",
        "submaps have the scans' motion, and a steady drift of yaw (`drift`) is taken out of them.", "",
        "## Honest recordings", "",
        "Simulated but for the first. What is reported of these is no mistake of setting up, but must be true.", "",
        *honest(arguments))
    write_results("fits.md", text)


if __name__ == "__main__":
    main()
