#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The page for man and the completion for bash say what --help says. Usage: manual_test.py TUTTI_PROGRAM [Manual.TEST...]"""
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

TUTTI = sys.argv[1]


def tutti(*arguments):
    return subprocess.run([TUTTI, *arguments], capture_output=True, text=True, check=True).stdout


class Manual(unittest.TestCase):
    def test_the_manual_has_every_command_and_option_of_help(self):
        page, bash = tutti("manual", "man"), tutti("manual", "bash")
        self.assertEqual(subprocess.run([TUTTI, "manual"], capture_output=True).returncode, 2)

        def look(*path):
            text = tutti(*path, "--help")
            self.assertIn(f"'{' '.join(['tutti', *path])}')", bash)
            flags = re.findall(r"^  ((?:-\w,)?--[\w-]+)", text, re.M)
            self.assertIn("-h,--help", flags)
            # An option that took all words up to the next one would take the command's arguments, too.
            self.assertEqual(re.findall(r"^  (?:-\w,)?--[\w-]+[^,\n]* \.\.\.", text, re.M), [])  # lists with commas are one word
            for flag in flags:
                self.assertIn("\\fB" + flag.replace("-", "\\-") + "\\fR", page)
                self.assertIn(flag.split(",")[-1], bash)
            if "\nSubcommands:\n" in text:
                for command in re.findall(r"^  (\w+) ", text.split("\nSubcommands:\n")[1], re.M):
                    self.assertIn(f".SS {' '.join(['tutti', *path, command])}\n", page)
                    look(*path, command)

        look()
        if shutil.which("groff"):
            done = subprocess.run(["groff", "-man", "-Tutf8", "-ww", "-b"], input=page, capture_output=True, text=True)
            self.assertEqual(done.stderr, "")
            self.assertGreater(len(done.stdout), len(page) // 2)

    def test_bash_completes_commands_options_and_their_values(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        path = pathlib.Path(folder.name)
        (path / "completion").write_text(tutti("manual", "bash"))
        (path / "folder").mkdir()

        def completed(*words):
            script = 'source completion; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _tutti; printf "%s\\n" "${COMPREPLY[@]}"'
            done = subprocess.run(["bash", "-c", script, "bash", "tutti", *words], cwd=path, capture_output=True, text=True)
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            return done.stdout.split()

        self.assertEqual(completed("optim"), ["optimise"])
        self.assertEqual(completed("map", "closure", "re"), ["reject"])
        self.assertEqual(completed("demo", "--sens"), ["--sensors"])
        self.assertEqual(completed("demo", "--sensors", "vi"), ["visual"])
        self.assertEqual(completed("demo", "--sensors", "=", "b"), ["both"])
        self.assertEqual(completed("demo", "--out", ""), ["folder"])
        self.assertEqual(completed("bag", "info", ""), ["completion", "folder"])
        self.assertEqual(completed("run", "--print-config", "co"), ["completion"])
        self.assertEqual(completed("help", "optim"), ["optimise"])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[2:])
