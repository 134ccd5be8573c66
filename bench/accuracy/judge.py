#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Outlier rejection on simulated places of every scale. Writes docs/results/judge.md.

Usage: bench/accuracy/judge.py JUDGE_PROGRAM [--seeds N] [--places NAME...] [--out FOLDER]
JUDGE_PROGRAM is build/bench/bench/accuracy/tutti_bench_judge. A place that is finished in --out is not made again.
"""
import argparse
import json
import pathlib
import statistics
import subprocess

from runs import page, row, write_results

PLACES = ("room", "hall", "tunnel", "street")
# name: which maps of a place are in the row
ROWS = {
    "odometry holds": lambda m: not m["fails"],
    "odometry fails once": lambda m: m["fails"],
    "honest": lambda m: m["stated"] == 1.0,
    "three times too sure": lambda m: m["stated"] < 1.0,
    "three times too unsure": lambda m: m["stated"] > 1.0,
    "no wrong closures": lambda m: m["wrong_share"] == 0.0,
    "10 % wrong, and places that look alike": lambda m: m["alike_s"] > 0.0,
    "30 % wrong": lambda m: m["wrong_share"] == 0.3,
}


def maps_of(arguments, place):
    kept = pathlib.Path(arguments.out) / f"{place}.jsonl"
    if not kept.exists():
        kept.parent.mkdir(parents=True, exist_ok=True)
        made = subprocess.run([arguments.judge, "--place", place, "--seeds", str(arguments.seeds)], check=True,
                              capture_output=True, text=True)
        kept.write_text(made.stdout)
    return [json.loads(line) for line in kept.read_text().splitlines()]


def line(name, maps):
    ratios = sorted(m["rmse_m"] / m["perfect_rmse_m"] for m in maps)
    kept = sum(m["right_accepted"] for m in maps) / sum(m["right"] for m in maps)
    made_up = sum(m["failures"] > 0 and not m["fails"] for m in maps)
    return row(name, len(maps), f"{statistics.median(ratios):.3f}", f"{ratios[int(0.9 * (len(ratios) - 1))]:.3f}",
               f"{ratios[-1]:.2f}", f"{sum(m['wrong_accepted'] for m in maps)} of {sum(m['wrong'] for m in maps)}",
               f"{100 * kept:.1f} %", made_up)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("judge")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--places", nargs="+", default=PLACES, choices=PLACES)
    parser.add_argument("--out", default="out/judge")
    arguments = parser.parse_args()
    maps = {place: maps_of(arguments, place) for place in arguments.places}
    everything = [m for of in maps.values() for m in of]
    table = [row("maps", "how many", "median", "p90", "worst", "wrong accepted", "right kept", "failures made up"),
             row(*["---"] * 8), line("all", everything)]
    table += [line(place, of) for place, of in maps.items()]
    table += [line(name, [m for m in everything if belongs(m)]) for name, belongs in ROWS.items()]
    text = page(
        "Outlier rejection in places of every scale",
        ["Asked was how far a map is from that of a judge who knows which closures are wrong (ratio of RMSE), in places of every scale."],
        table,
        [f"bench/accuracy/judge.py JUDGE_PROGRAM --seeds {arguments.seeds} --places {' '.join(arguments.places)}"],
        "Simulated: two robots walk or drive through a network of corridors (room: 2.5 m between junctions, 0.7 m/s; hall: 8 m, 1 m/s;",
        "tunnel: 60 m, 2 m/s; street: 120 m, 12 m/s), closures from the truth with noise. Every place with odometry that is honest,",
        "three times too sure and three times too unsure of itself, holds or fails once (over up to 20 s, by as far as the robot",
        "gets in a second or so and 5 to 25 degrees), and with no wrong closures, 10 % and a group at two segments that look",
        "alike (18 or 32 s), or 30 %. RMSE is of the whole map.")
    write_results("judge.md", text)


if __name__ == "__main__":
    main()
