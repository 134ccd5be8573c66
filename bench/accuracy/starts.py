#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes docs/results/starts.md: many starts without a start pose, in simulated worlds.

Usage: bench/accuracy/starts.py TUTTI_PROGRAM [--starts 10000] [--jobs CORES] [--first-seed 1001] [--keep FOLDER]
A start takes about one second of one core. With --keep a bench that was stopped goes on where it was (runs.remembered()).
"""
import argparse
import collections
import concurrent.futures
import os
import pathlib
import tempfile

from localise import ONE_SUBMAP_S, percent, robots_of, run, set_words
from runs import SOURCE, mission_file, page, remembered, row, write_results

MAPPED_M = 5.0
# A name, the mission, how often robots forget where they are, and what is set: who maps comes first, robots that search begin when these
# have long ended
WORLDS = [
    ("a tunnel", "next_day", 15, ["simulation.robots.2.copies=8"]),
    ("a regular grid of look-alike corridors", "look_alike", 15, []),
    ("a network of tunnels, half of it mapped", "next_day", 15, [
        "simulation.robots.2.copies=8", "simulation.world.network.rows=4", "simulation.world.network.columns=4"]),
]


def starts_in(tutti, world, seed, keep):
    """The robots of one world."""
    _, mission, every_s, settings = world

    def make():
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            common = [mission_file(mission), "--seed", seed, *set_words(settings)]
            run(tutti, "run", *common, "--set", "duration_s=500", "--map", folder / "map.tutti", "-o", folder / "mapped")
            run(tutti, "run", *common, "--map-in", folder / "map.tutti", "--frozen", "--restart-every", every_s,
                "-o", folder / "starts")
            return robots_of(folder / "starts")
    return remembered(keep, [*world, seed], make)


def cells(robots):
    starts = [start for robot in robots for start in robot["starts"]]
    mapped = [start for start in starts if start["from_map_m"] is not None and start["from_map_m"] <= MAPPED_M]
    found = lambda some: [s["fix_after_s"] for s in some if s["fix_after_s"] is not None]
    soon = [after for after in found(mapped) if after <= ONE_SUBMAP_S]
    scores = [robot["score"] for robot in robots if robot["score"]]
    mean = lambda key: sum(robot["share_of_time"][key] for robot in robots) / len(robots)
    return [str(len(starts)), str(len(mapped)), percent(len(soon) / max(1, len(mapped))),
            str(len(found(starts)) - len(found(mapped))), percent(mean("ambiguous")),
            f"{sum(s['wrong'] for s in scores)} of {sum(s['scored'] for s in scores)}",
            f"{max((s['max_m'] for s in scores if s['scored']), default=0.0):.2f} m"]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tutti")
    parser.add_argument("--starts", type=int, default=10000)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--first-seed", type=int, default=1001)
    parser.add_argument("--keep", help="folder for finished worlds, which are not repeated")
    arguments = parser.parse_args()
    found = [[] for _ in WORLDS]
    done, seed = 0, arguments.first_seed
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        begin = lambda one: [pool.submit(starts_in, arguments.tutti, world, one, arguments.keep) for world in WORLDS]
        ahead = collections.deque(begin(seed + i) for i in range(arguments.jobs))
        while done < arguments.starts:
            for robots, job in zip(found, ahead.popleft()):
                robots += job.result()
            done = sum(len(robot["starts"]) for robots in found for robot in robots)
            print(f"{done} starts; " + "; ".join(f"{world[0]}: {', '.join(cells(robots))}"
                                                 for world, robots in zip(WORLDS, found)), flush=True)
            seed += 1
            if done < arguments.starts:
                ahead.append(begin(seed + arguments.jobs - 1))
        pool.shutdown(cancel_futures=True)
    table = [row("world", "starts", "on mapped ground", "of these a fix in one submap", "fixes elsewhere", "ambiguous",
                 "wrong poses", "worst"), row("---", *["---:"] * 7)]
    table += [row(world[0], *cells(robots)) for world, robots in zip(WORLDS, found)]
    _, section, by_hand = (SOURCE / "docs/results/starts.md").read_text().partition("\n## Wrong fixes")
    write_results("starts.md", page(
        "Starts without a start pose",
        ["Asked was how often a robot that knows nothing of where it is finds its place in somebody else's map, and whether it is",
         "ever published in a wrong one."],
        table,
        [f"bench/accuracy/starts.py build/ci/apps/tutti/tutti --starts {arguments.starts} --jobs {arguments.jobs}"],
        f"All simulated, seeds {arguments.first_seed} to {seed - 1}; nothing was tuned on these but what is said below of",
        "1010, 1015, 1020, 1021 and 1024. Robots other than those that made the map forget",
        f"every {' or '.join(str(s) for s in sorted({world[2] for world in WORLDS}))} s where they are. *on mapped ground*: for {ONE_SUBMAP_S} s from the start they are within {MAPPED_M:.0f} m of where a robot of the map",
        f"has been. *a fix in one submap*: within {ONE_SUBMAP_S} s: 10 s of driving, and scans that confirm what it shows. *ambiguous*: share of",
        "the whole time. *wrong poses*: published, and off in the map ([localise.md](localise.md)) by more than 1 m or 5 degrees. *worst*:",
        "error of a published pose there.",
    ) + [section + by_hand])


if __name__ == "__main__":
    main()
