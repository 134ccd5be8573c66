# SPDX-License-Identifier: BSD-3-Clause
"""What the accuracy scripts share: one run of tutti as JSON, and rows of Markdown tables."""
import json
import pathlib
import subprocess
import tempfile

SOURCE = pathlib.Path(__file__).resolve().parents[2]


def report_of(*command):
    """report.json of one call of the program; its output folder is thrown away."""
    with tempfile.TemporaryDirectory() as out:
        subprocess.run([str(part) for part in command] + ["--out", out], check=True, capture_output=True)
        return json.loads((pathlib.Path(out) / "report.json").read_text())


def outcome_of(out, *command):
    """(report.json, timing.json) of one call, its files kept in the folder `out`; a finished one is not run again."""
    out = pathlib.Path(out)
    if not (out / "timing.json").exists():
        out.mkdir(parents=True, exist_ok=True)
        subprocess.run([str(part) for part in command] + ["--out", str(out)], check=True, capture_output=True)
    return [json.loads((out / name).read_text()) for name in ("report.json", "timing.json")]


def compare(*policies):
    """The assignment with which a mission runs these policies, too, beside the one its robots follow."""
    return f"compare_policies=[{','.join(policies)}]"


def mission_file(name):
    return SOURCE / "missions" / f"{name}.yaml"


def write_results(name, lines):
    (SOURCE / "docs" / "results" / name).write_text("\n".join(lines).rstrip() + "\n")


def row(*cells):
    return "| " + " | ".join(str(cell) for cell in cells) + " |"
