# SPDX-License-Identifier: BSD-3-Clause
"""The package as a whole: what it has, how it documents that, and that it installs."""
import ast
import contextlib
import importlib.util
import inspect
import io
import os
import pathlib
import re
import shutil
import subprocess
import sys
import time
import zipfile

import numpy as np
import tutti
from support import SOURCE, InFolder, run, walk

BUILD = pathlib.Path(tutti.__file__).parents[2]


def public(value):
    return {name for name in vars(value) if not name.startswith("_")}


class Stub(InFolder):
    def setUp(self):
        super().setUp()
        text = pathlib.Path(tutti.__file__).with_suffix(".pyi").read_text()
        self.nodes = {node.name: node for node in ast.parse(text).body if hasattr(node, "name")}
        self.text = text

    def test_has_the_modules_names(self):
        self.assertEqual(set(self.nodes), set(tutti.__all__))
        for name, node in self.nodes.items():
            if isinstance(node, ast.ClassDef):
                members = {part.name for part in node.body if isinstance(part, ast.FunctionDef)}
                self.assertEqual({m for m in members if not m.startswith("_")}, public(getattr(tutti, name)), name)

    def test_has_pythons_types(self):
        for word in ("::", "tutti._tutti", "object", "handle", "List["):
            self.assertEqual([line for line in self.text.splitlines() if "def " in line and word in line], [])

    def test_everything_is_documented(self):
        for name, node in self.nodes.items():
            for part in [node] + [p for p in getattr(node, "body", []) if isinstance(p, ast.FunctionDef) and not p.name.startswith("__")]:
                if not isinstance(node, ast.FunctionDef) or part is node:
                    self.assertTrue(ast.get_docstring(part), f"{name}.{part.name}")

    def test_arguments_are_those_of_the_docstrings(self):
        compare = self.nodes["compare"]
        self.assertEqual([argument.arg for argument in compare.args.args][:3], ["estimate", "reference", "tolerance_m"])
        self.assertIn("tolerance_m", inspect.getdoc(tutti.compare))

    def test_docs_name_everything(self):
        page = (SOURCE / "docs/python.md").read_text()
        for name in tutti.__all__:
            if not inspect.isclass(getattr(tutti, name)):
                self.assertIn(f"`{name}", page)
        script = (SOURCE / "examples/python/compare_trajectories.py").read_text()
        self.assertIn(script[script.index("import"):], page)


class Library(InFolder):
    def test_blas_is_held_to_one_thread(self):
        """Our matrices are small: a team of threads for each takes tens of times longer than one (base/single_thread.hpp)."""
        n = 1500
        step = np.eye(4)
        step[0, 3] = 1.0
        rng = np.random.default_rng(1)
        poses = np.tile(np.eye(4), (n, 1, 1))
        poses[:, 0, 3] = np.arange(n)
        edges = [(i, i + 1) for i in range(n - 1)] + [tuple(sorted(rng.choice(n, 2, replace=False))) for _ in range(300)]
        graph = tutti.PoseGraph(poses, edges, [np.linalg.inv(poses[a]) @ poses[b] for a, b in edges])
        wall, cpu = time.perf_counter(), time.process_time()
        tutti.optimise(graph, initialisation="given")
        self.assertLess(time.process_time() - cpu, 1.3 * (time.perf_counter() - wall) + 0.05)

    def test_others_run_meanwhile(self):
        """Long calls release the interpreter."""
        import threading
        places = np.random.default_rng(1).uniform(0, 20, (1200, 3))
        graph = tutti.proximity_graph(places)
        thread = threading.Thread(target=lambda: tutti.spectrum(graph))
        thread.start()
        count = 0
        while thread.is_alive():
            count += 1
            time.sleep(0.001)
        self.assertGreater(count, 5)


class Wheel(InFolder):
    @staticmethod
    def backend():
        spec = importlib.util.spec_from_file_location("backend", SOURCE / "python/backend.py")
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module

    def test_who_waits_for_the_build_sees_how_far_it_is(self):
        screen, said = io.StringIO(), io.StringIO()
        ninja = [sys.executable, "-c", "print('[1/3] one\\n[3/3] three'); import sys; sys.exit(len(sys.argv) - 1)"]
        with contextlib.redirect_stdout(said):
            self.backend().build(ninja, screen)
            self.assertRaises(subprocess.CalledProcessError, self.backend().build, [*ninja, "fails"], None)
        self.assertIn("Building tutti: 1 of 3 steps, 0.0 min", screen.getvalue())
        self.assertEqual(said.getvalue(), 2 * "[1/3] one\n[3/3] three\n")

    def test_only_what_it_needs_is_built(self):
        ninja = shutil.which("ninja")
        if not ninja or not (BUILD / "build.ninja").exists():
            self.skipTest("not built with ninja")
        commands = subprocess.run([ninja, "-C", BUILD, "-t", "commands", "tutti_python"], capture_output=True, text=True, check=True).stdout
        built = set(re.findall(r"CMakeFiles/(\w+)\.dir/", commands))
        self.assertIn("tutti_lab", built)
        self.assertEqual(built & {"tutti_program", "tutti_feed", "tutti_lab_programs", "tutti_ros", "tutti_exports", "tutti_commands"}, set())

    def test_pip_installs_it(self):
        """As `pip install .` does in a virtual environment, but for building it once more."""
        environment = {**os.environ, "TUTTI_PYTHON_BUILD_DIR": str(BUILD), "PIP_NO_INDEX": "1", "PIP_DISABLE_PIP_VERSION_CHECK": "1"}
        environment.pop("PYTHONPATH", None)
        subprocess.run([sys.executable, "-m", "venv", "--system-site-packages", self.path / "venv"], check=True)
        python = self.path / "venv/bin/python"
        made = subprocess.run([python, "-m", "pip", "install", "--no-deps", SOURCE], env=environment, capture_output=True, text=True)
        self.assertEqual(made.returncode, 0, made.stdout + made.stderr)
        where = subprocess.run([python, "-c", "import tutti; print(tutti.__file__, tutti.__version__)"], env=environment, cwd="/",
                               capture_output=True, text=True, check=True).stdout
        self.assertIn(str(self.path / "venv"), where)
        self.assertIn(tutti.__version__, where)
        for name in ("a.tum", "b.tum"):
            tutti.write_trajectory(self.path / name, walk())
        said = subprocess.run([python, SOURCE / "examples/python/compare_trajectories.py", "a.tum", "b.tum"], env=environment, cwd=self.path,
                              capture_output=True, text=True)
        self.assertIn("AteResult", said.stdout, said.stderr)


if __name__ == "__main__":
    run()
