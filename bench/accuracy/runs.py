# SPDX-License-Identifier: BSD-3-Clause
"""Shared by the accuracy scripts: one run of tutti as JSON, and rows of Markdown tables."""
import hashlib
import json
import pathlib
import subprocess
import tempfile

SOURCE = pathlib.Path(__file__).resolve().parents[2]
ERRORS = ("rmse_m", "max_error_m", "rpe_m", "rpe_deg", "rpe_10m_m", "rpe_10m_deg")


def without_partial(report):
    """The report without the errors that were scored on too little of the distance (docs/report.md): no table has them."""
    def drop(figures, prefix=""):
        if figures.get(f"{prefix}partial"):
            for key in figures:
                if key.startswith(prefix) and key[len(prefix):] in ERRORS:
                    figures[key] = None

    drop(report["server"])
    for robot in report["robots"]:
        for prefix in ("onboard_", "server_"):
            drop(robot, prefix)
        for policy in robot["policies"].values():
            drop(policy)
            drop(policy, "agreement_")
    return report


def remembered(keep, what, make):
    """make(), which must be JSON. It stays in the folder `keep`, if there is one, and is then not made again for the same `what`
    (use a new folder for a new program); a bench that was stopped goes on where it was."""
    kept = pathlib.Path(keep) / (hashlib.sha256(json.dumps(what).encode()).hexdigest()[:16] + ".json") if keep else None
    if kept and kept.exists():
        return json.loads(kept.read_text())
    made = make()
    if kept:
        kept.parent.mkdir(parents=True, exist_ok=True)
        unfinished = kept.with_suffix(".unfinished")
        unfinished.write_text(json.dumps(made))
        unfinished.rename(kept)
    return made


def report_of(*command, keep=None):
    """report.json of one call of the program, without partial figures, by remembered(); its output folder is thrown away."""
    words = [str(part) for part in command]

    def make():
        with tempfile.TemporaryDirectory() as out:
            subprocess.run(words + ["--out", out], check=True, capture_output=True)
            return json.loads((pathlib.Path(out) / "report.json").read_text())
    return without_partial(remembered(keep, words, make))


def outcome_of(out, *command):
    """(report.json without partial figures, timing.json) of one call, its files kept in the folder `out`; a finished one is not run again."""
    out = pathlib.Path(out)
    if not (out / "timing.json").exists():
        out.mkdir(parents=True, exist_ok=True)
        subprocess.run([str(part) for part in command] + ["--out", str(out)], check=True, capture_output=True)
    report, timing = [json.loads((out / name).read_text()) for name in ("report.json", "timing.json")]
    return [without_partial(report), timing]


def compare(*policies):
    """The assignment with which a mission runs these policies, too, beside the one its robots follow."""
    return f"compare_policies=[{','.join(policies)}]"


def mission_file(name):
    return SOURCE / "missions" / f"{name}.yaml"


def write_results(name, lines):
    (SOURCE / "docs" / "results" / name).write_text("\n".join(lines).rstrip() + "\n")


def page(title, asked, table, command, *rest):
    """The lines of a page of results: what was asked, the table that answers it, the command that makes it, and the rest."""
    return [f"# {title}", "", *asked, "", *table, "", "```sh", *command, "```", "", *rest]


def row(*cells):
    return "| " + " | ".join(str(cell) for cell in cells) + " |"
