#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs the missions once (and the demo) with all policies side by side and writes docs/results/missions.md; tunnel and
terrace are in paper.py, cosmo_tuhh in fleets.py.

Usage: bench/accuracy/missions.py TUTTI_PROGRAM --data FOLDER [--seed 1] [--keep FOLDER]
docs/data.md says what FOLDER holds.
"""
import argparse
import subprocess
import sys

from runs import SOURCE, compare, mission_file, report_of, row, write_results

COMPETITORS = ["every_node", "every_node_2", "spectral", "uniform", "random", "skeleton"]


def metres(value):
    return "-" if value is None else f"{value:.3f}"


def section(report):
    policies = list(report["robots"][0]["policies"])
    lines = [f"## {report['mission']}", "", f"{report['description']} Input: {report['input']}.", "",
             row("robot", "onboard", "server", *(p + (" *" if p == report["default_policy"] else "") for p in policies)),
             row(*["---"] * (3 + len(policies)))]
    for robot in report["robots"]:
        cells = []
        for policy in policies:
            own = robot["policies"][policy]
            error = own["rmse_m"] if own["scored_share"] is not None else own["agreement_rmse_m"]
            cells.append(f"{metres(error)} ({own['constraints']})")
        lines.append(row(robot["name"], metres(robot["onboard_rmse_m"]), metres(robot["server_rmse_m"]), *cells))
    server, check = report["server"], report["server"].get("closure_check")
    lines += ["", f"{server['components']} map(s); {server['closures_accepted']} closures accepted "
              f"({server['closures_accepted_inter']} between robots), {server['closures_rejected']} refused"
              + (f"; {check['wrong']} of {check['checked']} checked are wrong" if check else "") + "; "
              + ", ".join(f"{r['name']} {r['bytes_up'] / r['duration_s'] / 1000:.2f} kB/s up, "
                          f"{r['bytes_down'] / r['duration_s'] / 1000:.2f} down" for r in report["robots"]) + ".", ""]
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tutti")
    parser.add_argument("--data", required=True)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", help="folder for finished runs, which are not repeated")
    arguments = parser.parse_args()
    text = [
        "# All missions, all policies", "",
        "Asked was how far the server's map and every policy's robots are off in every mission: RMSE in metres after one rigid alignment",
        "(SE(3), no scale) at keyframes, in brackets the constraints held at the end; * is the policy the robot follows.", "",
        "```sh",
        f"bench/accuracy/missions.py TUTTI --data FOLDER   # each run: --seed {arguments.seed} --set {compare(*COMPETITORS)}",
        "```", "",
    ]
    options = ["--seed", arguments.seed, "--set", compare(*COMPETITORS)]
    text += section(report_of(arguments.tutti, "demo", *options, keep=arguments.keep))
    for name in sorted(file.stem for file in (SOURCE / "missions").glob("*.yaml")
                       if file.stem not in ("demo", "tunnel", "terrace", "cosmo_tuhh")):
        try:
            text += section(report_of(arguments.tutti, "run", mission_file(name), "--data", arguments.data, *options,
                                      keep=arguments.keep))
        except subprocess.CalledProcessError as error:  # a mission whose data is not at hand, for example
            print(f"{name} was not run: {error.stderr.decode().strip()}", file=sys.stderr)
            text += [f"## {name}", "", "Not run: its data was not at hand, or the run failed.", ""]
    text += ["## How to read the tables", "",
             "Where there is no reference, the figure is the RMSE to the server; a dash stands where the reference covers less than 95 % of",
             "the trajectory. Which part of the input is real is stated in each line. `uniform` and `random` have the budget of `spectral`.",
             "`tunnel` and `terrace` are in `paper.md`."]
    write_results("missions.md", text)


if __name__ == "__main__":
    main()
