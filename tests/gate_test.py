# SPDX-License-Identifier: BSD-3-Clause
"""bench/accuracy: the forms of a fleet, the scores of graphs, and what the gate of figures calls worse."""
import io
import math
import pathlib
import sys
import tempfile
import unittest
from contextlib import redirect_stdout

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).parents[1] / "bench/accuracy"))
import forms  # noqa: E402
import gate  # noqa: E402
import gate_readme  # noqa: E402
import graph_scores  # noqa: E402
from gate_runs import Job  # noqa: E402

JOB = Job("demo", "README.md", lambda places: [], None)
COMMITTED = {"alpha, server": ("error_m", 1.0), "wrong accepted": ("wrong", 0), "factorisations": ("work", 100), "maps": ("same", 1)}


def verdicts(job=JOB, **changes):
    figures = {name: (kind, changes.get(name.split()[-1], value)) for name, (kind, value) in COMMITTED.items()}
    figures = {name: entry for name, entry in figures.items() if entry[1] is not None}
    return {line.figure.split(": ")[1].split()[-1]: line.verdict for line in gate.lines_of(job, figures, COMMITTED)}


class Gate(unittest.TestCase):
    def test_what_did_not_move_is_as_committed(self):
        self.assertEqual(set(verdicts(server=1.04, factorisations=109).values()), {"as committed"})

    def test_each_kind_of_figure_can_be_worse_and_better(self):
        self.assertEqual(verdicts(server=1.06)["server"], "WORSE")
        self.assertEqual(verdicts(server=0.9)["server"], "better")
        self.assertEqual(verdicts(accepted=1)["accepted"], "WORSE")
        self.assertEqual(verdicts(factorisations=111)["factorisations"], "WORSE")
        self.assertEqual(verdicts(factorisations=80)["factorisations"], "better")
        self.assertEqual(verdicts(maps=2)["maps"], "WORSE")
        self.assertEqual(verdicts(maps=0)["maps"], "WORSE")
        self.assertEqual(gate.verdict_of(gate.KINDS["accepted"], 90, 100), "WORSE")
        self.assertEqual(gate.verdict_of(gate.KINDS["accepted"], 110, 100), "better")

    def test_a_figure_that_is_gone_is_worse_and_a_new_one_is_not(self):
        self.assertEqual(verdicts(server=None)["server"], "WORSE: gone")
        self.assertEqual([line.verdict for line in gate.lines_of(JOB, {"x": ("work", 1)}, {})], ["new"])

    def test_a_missing_recording_is_skipped_and_a_failed_run_is_worse(self):
        self.assertEqual({line.verdict for line in gate.lines_of(JOB, None, COMMITTED)}, {"skipped"})
        self.assertEqual([line.verdict for line in gate.lines_of(JOB, None, {})], ["skipped"])
        self.assertEqual({line.verdict for line in gate.lines_of(JOB, {}, COMMITTED)}, {"WORSE: gone"})
        self.assertEqual([line.verdict for line in gate.lines_of(JOB, {}, {})], ["WORSE: failed"])

    def test_the_last_line_counts(self):
        lines = gate.lines_of(JOB, {"alpha, server": ("error_m", 2.0), "factorisations": ("work", 50), "maps": ("same", 1)}, COMMITTED)
        last = gate.last_lines(lines, "whole", "tutti 1", {})
        self.assertEqual(last[0], "better: demo: factorisations: 100 -> 50")
        self.assertIn("WORSE: demo: alpha, server: 1 -> 2", last)
        self.assertIn("4 figures, 1 as committed, 1 better, 2 worse, 0 new, 0 skipped", last[-1])

    def test_writing_keeps_what_was_not_run(self):
        before, gate.COMMITTED = gate.COMMITTED, pathlib.Path(tempfile.mkdtemp()) / "gate.json"
        try:
            committed = {"demo": dict(COMMITTED), "hall": {"maps": ("same", 1)}, "gone": {"maps": ("same", 1)}}
            gate.write_committed(committed, {"demo": {"maps": ("same", 2)}, "hall": None})
            written = gate.read_committed()
        finally:
            gate.COMMITTED = before
        self.assertEqual(written, {"demo": {"maps": ("same", 2)}, "hall": {"maps": ("same", 1)}})

    def test_without_recordings_it_is_skipped(self):
        with tempfile.TemporaryDirectory() as empty, redirect_stdout(io.StringIO()) as out:
            before, sys.argv = sys.argv, ["gate.py", "tutti", "--shared", empty]
            try:
                self.assertEqual(gate.main(), 0)
            finally:
                sys.argv = before
        self.assertIn("TUTTI_ALL_SKIPPED", out.getvalue())


class Readme(unittest.TestCase):
    def robot(self, onboard_m, server_m, corrected_m, constraints):
        return {"onboard_rmse_m": onboard_m, "server_rmse_m": server_m,
                "policies": {"adaptive": {"rmse_m": corrected_m, "agreement_rmse_m": 0.007, "constraints": constraints}}}

    def test_a_row_is_as_the_page_has_it(self):
        report = {"default_policy": "adaptive", "robots": [self.robot(2.316, 0.0571, 0.059, 25), self.robot(1.93, 0.058, 0.0582, 0)]}
        self.assertEqual(gate_readme.line("demo", report), "| `demo` | simulated, closures from LiDAR scans, 6 min | 2.316 / 1.930 m | "
                                                           "0.057 / 0.058 m | 0.059 / 0.058 m | 25 and none |")
        alone = {"default_policy": "adaptive", "robots": [self.robot(None, None, None, 12)]}
        self.assertIn("agrees with the server within 7 mm | 12 |", gate_readme.line("hku_two_sessions", alone))

    def test_every_row_of_the_page_has_a_job(self):
        self.assertEqual([job.name for job in gate_readme.README], list(gate_readme.ROWS))
        page = (pathlib.Path(__file__).parents[1] / "README.md").read_text()
        table = page.split(gate_readme.BEGIN)[1].split(gate_readme.END)[0].strip().splitlines()
        self.assertEqual([line.split(" | ")[0].removeprefix("| ") for line in table[2:]], [row[0] for row in gate_readme.ROWS.values()])


class Forms(unittest.TestCase):
    def fleet(self, folder):
        """Robot a at 0 to 29 s on a line, a closure from every pose to the one three later, the first of them wrong."""
        path = pathlib.Path(folder) / "fleet.pyfg"
        lines = [f"VERTEX_SE3:QUAT {k} a{k} {k} 0 0 0 0 0 1" for k in range(30)]
        lines += [f"EDGE_SE3:QUAT {k + 1} a{k} a{k + 1} 1 0 0 0 0 0 1" for k in range(29)]
        lines += [f"EDGE_SE3:QUAT {100 - k} a{k} a{k + 3} {9 if k == 0 else 3} 0 0 0 0 0 1" for k in range(27)]
        path.write_text("\n".join(lines) + "\n")
        pathlib.Path(f"{path}.wrong").write_text("a0 a3\n")
        return path

    def test_thirteen_forms_leave_out_what_they_say(self):
        with tempfile.TemporaryDirectory() as folder:
            fleet = forms.Fleet(self.fleet(folder))
        self.assertEqual(len(forms.NAMES), 13)
        count = {name: len(fleet.closures_of(name)) for name in forms.NAMES}
        self.assertEqual(count["whole"], 27)
        self.assertEqual(count["window10.4_0"], 6)  # 8 to 10 and 18 to 20
        self.assertEqual(count["window20_0"], 3)
        self.assertEqual((count["first50"], count["first75"]), (13, 20))
        self.assertEqual(fleet.closures_of("first50")[0][1], "a26")  # it arrived first
        self.assertNotEqual(fleet.closures_of("share70_0"), fleet.closures_of("share70_1"))

    def test_a_form_is_written_with_its_labels(self):
        with tempfile.TemporaryDirectory() as folder:
            case = graph_scores.fleet_case(self.fleet(folder), "first75", pathlib.Path(folder) / "out", "first75")
            text = case.path.read_text()
            right = case.path.with_name("first75_no_outliers.pyfg").read_text()
            self.assertEqual(pathlib.Path(f"{case.path}.wrong").read_text(), "")  # the wrong one arrived last
        self.assertEqual(text, right)
        self.assertEqual(text.count("EDGE"), 29 + 20)

    def test_how_far_a_closure_is_off(self):
        with tempfile.TemporaryDirectory() as folder:
            case = graph_scores.fleet_case(self.fleet(folder), "whole", pathlib.Path(folder) / "out")
            self.assertEqual(graph_scores.far_off(case, [("a0", "a3"), ("a1", "a4")]), 1)
        turned = [0.0, 0.0, math.sin(math.pi / 4), math.cos(math.pi / 4)]
        metres, degrees = graph_scores.error_of(([1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]), ([0.0, 0.0, 0.0], turned),
                                                ([0.0, 2.0, 0.0], turned))
        self.assertAlmostEqual(metres, 1.0)
        self.assertAlmostEqual(degrees, 0.0)
        _, degrees = graph_scores.error_of(([0.0, 0.0, 0.0], turned), ([0.0] * 3, [0.0, 0.0, 0.0, 1.0]), ([0.0] * 3, [0.0, 0.0, 0.0, 1.0]))
        self.assertAlmostEqual(degrees, 90.0)

    def test_a_summary_is_of_ratios(self):
        score = lambda ate_m, perfect_m: graph_scores.Score("x", ate_m, perfect_m, "1 of 1", 10, 1, 0, 0, 1.0, 5)
        of = graph_scores.summary({("f", f"form{k}"): score(1.0 + k / 100, 1.0) for k in range(20)} | {("f", "first50"): score(3.0, 2.0),
                                                                                                     ("f", "truth"): score(1.0, 0.0)})
        self.assertAlmostEqual(of.median, 1.10)
        self.assertAlmostEqual(of.p95, 1.19)
        self.assertAlmostEqual(of.worst, 1.5)
        self.assertAlmostEqual(of.worst_first50, 1.5)
        self.assertAlmostEqual(of.refused_share, 0.1)


if __name__ == "__main__":
    unittest.main()
