# SPDX-License-Identifier: BSD-3-Clause
"""scripts/check_pages.py finds each kind of name that is not there, at its line, and nothing in true pages."""
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

SCRIPT = pathlib.Path(__file__).parents[1] / "scripts/check_pages.py"
SOURCES = {
    "apps/tutti/run.cpp": 'add_option("--bag,-b"); add_option("--set")',
    "src/tutti/exports/formats.cpp": 'Format{"grid", ".yaml"}',
    "src/tutti/robot/agent.hpp": 'v.field("submap", a); v.field("duration_s", b); struct Agent { void receive(); };',
    "ros2/tutti_ros/launch/robot.launch.py": '"odom": ("odom", "topic")',
}


def check(page, text):
    with tempfile.TemporaryDirectory() as folder:
        for name, content in {**SOURCES, "README.md": "", page: text}.items():
            (pathlib.Path(folder) / name).parent.mkdir(parents=True, exist_ok=True)
            (pathlib.Path(folder) / name).write_text(content)
        done = subprocess.run([sys.executable, SCRIPT, folder], capture_output=True, text=True, check=False)
        return done.returncode, done.stdout


class CheckPages(unittest.TestCase):
    def test_true_pages_pass(self):
        code, out = check("docs/extending.md", "`tutti run --bag a=b` and `robot/agent.hpp`: `Agent::receive()`, `src/tutti/robot/`\n```sh\n"
                          "tutti run --bag a=b \\\n  --set submap.duration_s=5   # --other\n"
                          "tutti map export --grid m.yaml\nros2 launch tutti_ros robot.launch.py odom:=a\nls --all\n```\n")
        self.assertEqual(code, 0, out)

    def test_a_reference_may_be_long(self):
        for page in ("docs/math.md", "docs/decisions/a.md"):
            code, out = check(page, "word " * 2001)
            self.assertEqual(code, 0, out)

    def test_each_breach_is_found(self):
        for page, text, said in (
                ("README.md", "a\n`tutti run --bags a=b`\n", "README.md:2: option --bags"),
                ("docs/a.md", "```sh\ntutti run \\\n  --mcap a\n```\n", "docs/a.md:3: option --mcap"),
                ("docs/a.md", "`--set submap.duration=5`\n", "docs/a.md:1: setting submap.duration"),
                ("docs/a.md", "`ros2 launch tutti_ros robot.launch.py odometry:=a`\n", "docs/a.md:1: argument odometry:="),
                ("docs/a.md", "`ros2 launch tutti_ros robots.launch.py`\n", "docs/a.md:1: launch file robots.launch.py"),
                ("docs/extending.md", "`robot/agents.hpp`\n", "docs/extending.md:1: file robot/agents.hpp"),
                ("docs/extending.md", "`Agent::hear()`\n", "docs/extending.md:1: name Agent::hear()"),
                ("docs/a.md", "word " * 2001, "docs/a.md:1: 2001 words, expected 2000 at most")):
            code, out = check(page, text)
            self.assertEqual(code, 1, text)
            self.assertIn(said, out)

    @unittest.skipUnless(shutil.which("nats-server"), "no nats-server")
    def test_commands_of_the_readme_that_fail_are_found(self):
        block = "From recordings:\n\n```sh\ntutti bag info a\ntutti run a\ntutti run b\n```\n"
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            program = root / "stub"
            program.write_text('#!/bin/sh\n[ "$1" = bag ] && echo "not ready" && exit 3\nexit 0\n')
            program.chmod(0o755)
            for page, said in ((block, "tutti bag info a\nexit code 3: not ready"), ("", "0 commands behind 'From recordings:'")):
                (root / "README.md").write_text(page)
                done = subprocess.run([sys.executable, SCRIPT, "--run", program, root], capture_output=True, text=True, check=False)
                self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
                self.assertIn(said, done.stdout)


if __name__ == "__main__":
    unittest.main()
