# SPDX-License-Identifier: BSD-3-Clause
"""scripts/check_size.py counts what it says, and fails above a cap, for a room without one and for a cap without a room."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

SCRIPT = pathlib.Path(__file__).parents[1] / "scripts/check_size.py"
FILES = {
    "src/tutti/CMakeLists.txt": "foreach(module IN ITEMS base node)\nendforeach()\n",
    "src/tutti/base/a.hpp": '''// a comment

namespace tutti {
/* another
   one */
struct Config {
  double x = 0.0;  // "no" setting yet
  template <class V> void describe(V& v) {
    v.field("x", x);
    v.field(
        "y", x);
  }
};
int twice(int x);
class Room {
 public:
  int area() const;
 private:
  int width_, height_ = 2;
  const char* name_ = "// no comment";
};
}  // namespace tutti
''',
    "src/tutti/base/internal/b.hpp": "namespace tutti {\nint hidden();\n}\n",
    "src/tutti/node/a.cpp": "int a;\n",
    "src/tutti/node/a_test.cpp": "int a;\nint b;\n",
    "tests/c_test.py": "# comment\nx = 1\n",
}
CAPS = "base 21 2 3 3\nnode 1 0 0 0\n"


def check(caps, *options):
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        for name, text in {**FILES, "scripts/size_caps.txt": caps}.items():
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).write_text(text)
        done = subprocess.run([sys.executable, SCRIPT, *options, folder], capture_output=True, text=True, check=False)
        return done.returncode, done.stdout + done.stderr, (root / "scripts/size_caps.txt").read_text()


class CheckSize(unittest.TestCase):
    def test_todays_figures_pass(self):
        code, out, _ = check(CAPS)
        self.assertEqual(code, 0, out)
        self.assertIn("22 lines of code, 3 of tests, 2 settings", out)

    def test_what_is_above_a_cap_fails_and_says_what(self):
        for column, caps in (("lines", "base 20 2 3 3"), ("settings", "base 21 1 3 3"), ("names", "base 21 2 2 3"), ("members", "base 21 2 3 2")):
            code, out, _ = check(CAPS.replace("base 21 2 3 3", caps))
            self.assertEqual(code, 1, out)
            self.assertIn(f"{column}, at most {caps.split()[('lines', 'settings', 'names', 'members').index(column) + 1]} are allowed", out)

    def test_a_room_without_a_cap_and_a_cap_without_a_room_fail(self):
        code, out, _ = check(CAPS.replace("node", "nodes"))
        self.assertEqual(code, 1)
        self.assertIn("add 'node 1 0 0 0'", out)
        self.assertIn("a line of nodes", out)

    def test_lowering_keeps_reasons_and_raises_nothing(self):
        code, out, caps = check(CAPS.replace("base 21 2 3 3", "base 30 2 2 3  # as it is"), "--lower")
        self.assertEqual(code, 1, out)
        self.assertRegex(caps, r"base +21 +2 +2 +3  # as it is")

    def test_a_line_that_is_no_row_is_named(self):
        code, out, _ = check(CAPS + "base many\n")
        self.assertEqual(code, 1)
        self.assertIn("size_caps.txt:3: 'base many'", out)


if __name__ == "__main__":
    unittest.main()
