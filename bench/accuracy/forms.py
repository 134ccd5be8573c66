# SPDX-License-Identifier: BSD-3-Clause
"""Forms of a fleet: the same trajectories with 13 different sets of its closures, because one fleet is one sample."""
import math
import pathlib
import random

# (length in s, seconds by which the first window begins early)
WINDOWS = [(10.4, 0), (10.4, 2), (10.4, 5), (10.4, 8), (20.0, 0), (20.0, 8)]
SHARE, DRAWS = 0.7, 4
FIRST = (0.5, 0.75)
NAMES = (["whole"] + [f"window{length:g}_{early}" for length, early in WINDOWS] +
         [f"share{100 * SHARE:.0f}_{draw}" for draw in range(DRAWS)] + [f"first{100 * share:.0f}" for share in FIRST])


class Fleet:
    """A PyFG file by its lines: vertices (and whatever else is no edge), odometry, and closures as (line, from, to, arrival)."""

    def __init__(self, path):
        self.others, self.odometry, self.closures, self.stamp = [], [], [], {}
        for line in pathlib.Path(path).read_text().splitlines():
            word = line.split()
            if word[:1] == ["EDGE_SE3:QUAT"]:
                a, b = word[2:4]
                if a[0] == b[0] and int(b[1:]) == int(a[1:]) + 1:
                    self.odometry.append(line)
                else:
                    self.closures.append((line, a, b, float(word[1])))
                continue
            self.others.append(line)
            if word[:1] == ["VERTEX_SE3:QUAT"]:
                self.stamp[word[2]] = float(word[1])
        labels = pathlib.Path(f"{path}.wrong")
        self.wrong = {frozenset(line.split()) for line in labels.read_text().splitlines()} if labels.exists() else None

    def is_wrong(self, closure):
        return frozenset(closure[1:3]) in self.wrong

    def across_windows(self, length_s, early_s):
        """Without a robot's closures to itself within one window of this length: submaps of that length have none."""
        begin = {}
        for name, stamp in self.stamp.items():
            begin[name[0]] = min(stamp, begin.get(name[0], stamp))
        window = lambda name: (name[0], math.floor((self.stamp[name] - begin[name[0]] + early_s) / length_s))
        return [closure for closure in self.closures if window(closure[1]) != window(closure[2])]

    def drawn(self, seed):
        draw = random.Random(seed)
        return [closure for closure in self.closures if draw.random() < SHARE]

    def first(self, share):
        arrived = sorted(self.closures, key=lambda closure: closure[3])
        return arrived[:int(share * len(arrived))]

    def closures_of(self, form):
        """The closures of the form of this name (NAMES)."""
        kind, _, number = form.partition("_")
        if form == "whole":
            return self.closures
        if kind.startswith("window"):
            return self.across_windows(float(kind.removeprefix("window")), int(number))
        return self.drawn(int(number)) if kind.startswith("share") else self.first(int(kind.removeprefix("first")) / 100)

    def write(self, path, closures):
        """The fleet with these closures; beside it the labels, as COSMO-Bench has them (.wrong) and as `tutti optimise
        --robust` finds them (_no_outliers)."""
        path.parent.mkdir(parents=True, exist_ok=True)
        graph = lambda some: "\n".join(self.others + self.odometry + [closure[0] for closure in some]) + "\n"
        path.write_text(graph(closures))
        if self.wrong is None:
            return
        wrong = [closure for closure in closures if self.is_wrong(closure)]
        pathlib.Path(f"{path}.wrong").write_text("".join(f"{a} {b}\n" for _, a, b, _ in wrong))
        right = [closure for closure in closures if not self.is_wrong(closure)]
        path.with_name(f"{path.stem}_no_outliers.pyfg").write_text(graph(right))
