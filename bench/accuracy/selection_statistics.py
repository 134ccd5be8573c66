# SPDX-License-Identifier: BSD-3-Clause
"""Statistics of what the runs of bench/accuracy/selection.py left, and cells of its tables."""
import collections
import math

from runs import row
from selection_runs import DEFAULT


def quantile(values, share):
    """Linear between order statistics; infinities stay."""
    values = sorted(v for v in values if v is not None)
    if not values:
        return None
    at = share * (len(values) - 1)
    low, high = values[math.floor(at)], values[math.ceil(at)]
    return low if low == high else low + (at - math.floor(at)) * (high - low)


def median(values):
    return quantile(list(values), 0.5)


def number(value, digits=3):
    return "-" if value is None else "never" if math.isinf(value) else f"{value:.{digits}f}"


def spread(values, digits=3):
    values = list(values)
    return f"{number(median(values), digits)} ({number(quantile(values, 0.25), digits)} - " \
           f"{number(quantile(values, 0.75), digits)})"


def heading(*cells):
    return [row(*cells), row(*["---"] * len(cells))]


def rmse(line):
    """Against the truth; for recordings that have none, against the server's map."""
    return line["corrected"]["rmse_m"] if line["corrected"] else line.get("agreement_m")


def ratio(line):
    return line["corrected"]["rmse_m"] / line["server"]["rmse_m"] if line["corrected"] else None


def by_case(runs_of_seeds):
    """robot -> (policy, budget) -> lines of all seeds."""
    out = collections.defaultdict(lambda: collections.defaultdict(list))
    for lines in runs_of_seeds.values():
        for line in lines:
            out[line["robot"]][line["policy"], line["budget"]].append(line)
    return out


def own_lines(runs_of_seeds, robot=None):
    """The default's, by its own rule."""
    return [line for lines in runs_of_seeds.values() for line in lines
            if line["policy"] == DEFAULT and line["budget"] == 0 and robot in (None, line["robot"])]
