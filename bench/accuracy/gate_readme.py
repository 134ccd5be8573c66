# SPDX-License-Identifier: BSD-3-Clause
"""README's table of missions, written from their runs."""
import json

from gate_runs import README, folder_of
from runs import SOURCE, row, without_partial

BEGIN, END = "<!-- Written by bench/accuracy/gate.py --readme. -->", "<!-- End of the table. -->"
# A row's words for its input, and the number of digits of its errors.
ROWS = {
    "cosmo_tuhh": ("`cosmo_tuhh`", "real odometry and closures of three robots, closures as they arrived (COSMO-Bench)", 2),
    "kth wifi": ("kth wifi (`docs/results/fleets.md`)", "the same of three others, `tutti run --graph`", 2),
    "hku_two_sessions": ("`hku_two_sessions`", "real scans and odometry", 3),
    "hku_degraded": ("`hku_degraded`", "real scans, odometry made worse", 3),
    "euroc_mh": ("`euroc_mh`", "real odometry, closures from ground truth", 3),
    "kitti_00_05": ("`kitti_00_05`", "real odometry, closures from ground truth", 2),
    "tunnel": ("`tunnel`", "simulated, trajectories only, closures from the truth within 1.5 m, 1 h", 3),
    "euroc_v101_rovio": ("`euroc_v101_rovio`",
                         "real: ROVIO's poses, tracks and descriptors; closures from appearance, bundle-adjusted", 3),
    "hall": ("`hall`", "simulated, closures from camera images", 3),
    "terrace": ("`terrace`", "simulated, closures from LiDAR scans, odometry fails outdoors", 3),
    "demo": ("`demo`", "simulated, closures from LiDAR scans, 6 min", 3),
}


def in_words(values):
    values = [str(value or "none") for value in values]
    return values[0] if len(values) == 1 else ", ".join(values[:-1]) + " and " + values[-1]


def line(name, report):
    heading, what, digits = ROWS[name]
    robots = report["robots"]
    own = [robot["policies"][report["default_policy"]] for robot in robots]
    constraints = in_words(policy["constraints"] for policy in own)
    if all(robot["server_rmse_m"] is None for robot in robots):
        apart = in_words(f"{1000 * policy['agreement_rmse_m']:.0f}" for policy in own)
        return row(heading, what, "not measured: no ground truth", "not measured",
                   f"not measured; agrees with the server within {apart} mm", constraints)
    metres = lambda values: " / ".join("-" if value is None else f"{value:.{digits}f}" for value in values) + " m"
    return row(heading, what, metres(robot["onboard_rmse_m"] for robot in robots), metres(robot["server_rmse_m"] for robot in robots),
               metres(policy["rmse_m"] for policy in own), constraints)


def write(places):
    """Writes README's table from the runs that there are; says which rows stay as they were."""
    page = SOURCE / "README.md"
    before, rest = page.read_text().split(BEGIN)
    old, after = rest.split(END)
    lines = {text.split(" | ")[0].removeprefix("| "): text for text in old.strip().splitlines()}
    head = list(lines.values())[:2]
    rows, kept = [], []
    for job in README:
        report = folder_of(places, job.name) / "report.json"
        if job.missing(places) is None and report.exists():
            rows.append(line(job.name, without_partial(json.loads(report.read_text()))))
        else:
            rows.append(lines[ROWS[job.name][0]])
            kept.append(job.name)
    page.write_text(before + "\n".join([BEGIN, "", *head, *rows, "", END]) + after)
    print("README.md: its table is of these runs" + (f", but for {', '.join(kept)}, which stay as they were" if kept else ""))
