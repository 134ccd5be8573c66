#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Tutti as others get it: installed from what is built, and as a part of another project.
Usage: consumer_test.py SOURCE_DIR BUILD_DIR [Consumer.TEST...]"""
import concurrent.futures
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

SOURCE, BUILD = map(pathlib.Path, sys.argv[1:3])
EXAMPLES = SOURCE / "examples" / "library"
COMPILER = os.environ.get("CXX") or shutil.which("clang++-16") or "c++"  # which reads headers in two thirds of GCC's time


def run(*command, cwd=None):
    return subprocess.run([str(word) for word in command], capture_output=True, text=True, cwd=cwd, timeout=600)


def chains_of(headers):
    """Lists that hold every header once, each of them after only such as it includes itself, at whatever depth: what such a
    list compiles, each of its headers compiles alone. Half as many compilations as headers. And what each header includes."""
    direct = {name: [other for other in re.findall(r'#include "([^"]+)"', text) if other in headers]
              for name, text in headers.items()}
    below = {}

    def closure(name):
        if name not in below:
            below[name] = set(direct[name]).union(*map(closure, direct[name]))
        return below[name]

    def size(name):
        return len(closure(name)), name

    left, chains = set(headers), []
    for name in sorted(headers, key=size, reverse=True):
        chain = []
        while name in left:
            chain.insert(0, name)
            left.remove(name)
            name = max(closure(name) & left, key=size, default=None)
        if chain:
            chains.append(chain)
    return chains, below


class Consumer(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.path = pathlib.Path(cls.folder.name)
        cls.installed = cls.path / "installed"
        done = run("cmake", "--install", BUILD, "--prefix", cls.installed, "--component", "development")
        assert done.returncode == 0, done.stdout + done.stderr

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def expect(self, result, code, *words):
        text = result.stdout + result.stderr
        self.assertEqual(result.returncode, code, text)
        for word in words:
            self.assertIn(word, text)

    def configure(self, name, *options, source=EXAMPLES):
        launcher = ["-DCMAKE_CXX_COMPILER_LAUNCHER=ccache"] if shutil.which("ccache") else []
        return run("cmake", "-G", "Ninja", "-S", source, "-B", self.path / name, *launcher, *options)

    def project(self, name, text):
        folder = self.path / (name + "_source")
        folder.mkdir()
        (folder / "CMakeLists.txt").write_text("cmake_minimum_required(VERSION 3.25)\nproject(x LANGUAGES C CXX)\n" + text)
        return folder

    def test_the_examples_are_built_against_it_and_run(self):
        self.expect(self.configure("examples", f"-DCMAKE_PREFIX_PATH={self.installed}"), 0)
        self.expect(run("cmake", "--build", self.path / "examples"), 0)
        way = "".join(f"{i}.5 {i} {i % 3} 0 0 0 0 1\n" for i in range(20))
        (self.path / "way.tum").write_text(way)
        self.expect(run(self.path / "examples/compare_trajectories", "way.tum", "way.tum", cwd=self.path), 0, "20 poses, RMSE 0.000 m")
        information = " ".join("100" if i == j else "0" for i in range(6) for j in range(i, 6))
        edges = [(i, i + 1, "1 0 0") for i in range(30)] + [(i, i + 4, "4 0 0") for i in range(0, 26, 3)] + [(3, 25, "2 9 0")]
        (self.path / "in.g2o").write_text("".join(f"EDGE_SE3:QUAT {a} {b} {T} 0 0 0 1 {information}\n" for a, b, T in edges))
        self.expect(run(self.path / "examples/optimise_graph", "in.g2o", "out.g2o", cwd=self.path), 0, "40 edges, 1 of them wrong")
        last = (self.path / "out.g2o").read_text().splitlines()[30].split()
        self.assertEqual(last[:2], ["VERTEX_SE3:QUAT", "30"])
        self.assertAlmostEqual(float(last[2]), 30.0, places=3)
        self.expect(run(self.path / "examples/embed"), 0, "robot 1: RMSE")

    def test_a_component_looks_for_what_it_links_and_for_nothing_else(self):
        core = self.project("core", "find_package(tutti REQUIRED COMPONENTS core)\n"
                                    "foreach(target Ceres::ceres protobuf::libprotobuf-lite tutti::nats tutti::sqlite yaml-cpp PNG::PNG)\n"
                                    "  if(TARGET ${target})\n    message(FATAL_ERROR \"found ${target}\")\n  endif()\nendforeach()\n")
        self.expect(self.configure("core", f"-DCMAKE_PREFIX_PATH={self.installed}", source=core), 0)
        net = self.project("net", "find_package(tutti COMPONENTS net)\nmessage(\"net ${tutti_FOUND} ${tutti_net_FOUND}\")\n"
                                  "find_package(tutti COMPONENTS core simulation)\nmessage(\"simulation ${tutti_FOUND}\")\n")
        self.expect(self.configure("net", f"-DCMAKE_PREFIX_PATH={self.installed}", source=net), 0, "net 1 TRUE", "simulation 0")

    def test_the_document_shows_the_examples_as_they_are(self):
        text = (SOURCE / "docs" / "library.md").read_text()
        shown = dict(re.findall(r"`(examples/library/\S+)`:\n\n```\w+\n(.*?)```\n", text, flags=re.S))
        self.assertEqual(sorted(shown), sorted(path.relative_to(SOURCE).as_posix() for path in EXAMPLES.iterdir()))
        for path, code in shown.items():
            self.assertEqual(code, (SOURCE / path).read_text(), path)

    def test_nothing_internal_and_no_simulation_is_installed(self):
        headers = [path.relative_to(self.installed / "include").as_posix() for path in self.installed.rglob("*.hpp")]
        self.assertGreater(len(headers), 100)
        self.assertEqual([header for header in headers if "/internal/" in header or "simulation/" in header], [])
        self.assertEqual([path.name for path in self.installed.rglob("*.a") if "simulation" in path.name or "mission" in path.name], [])

    def test_as_a_part_of_another_project_it_builds_what_is_asked_for(self):
        self.expect(self.configure("part", f"-DTUTTI_SOURCE={SOURCE}", "-DTUTTI_COMPONENTS=server"), 0)
        targets = run("cmake", "--build", self.path / "part", "--target", "help").stdout
        self.assertIn("libtutti_server.a", targets)
        for absent in ("test_base", "libtutti_bus.a", "libtutti_mission.a", "install:"):
            self.assertNotIn(absent, targets)
        # A robot and a server need no bundle adjustment.
        self.expect(self.configure("lacking", f"-DTUTTI_SOURCE={SOURCE}", "-DTUTTI_COMPONENTS=server", "-DTUTTI_WITH_CERES=OFF"), 0,
                    "left out: bundle, for want of Ceres::ceres", "left out: verifiers")
        self.expect(self.configure("lacking_more", f"-DTUTTI_SOURCE={SOURCE}", "-DTUTTI_COMPONENTS=server", "-DTUTTI_WITH_ZSTD=OFF"), 1,
                    "left out: wire, for want of tutti::zstd")
        self.expect(self.configure("odd", f"-DTUTTI_SOURCE={SOURCE}", "-DTUTTI_COMPONENTS=sever"), 1, "'sever' is none of")


class Headers(unittest.TestCase):
    """Apart, since it takes the longest: every public header compiles by itself."""
    COMMON = ["tutti/geometry/pose3.hpp", "tutti/base/result.hpp"]  # compiled once for all headers that include one anyway

    def test_every_header_compiles_alone(self):
        with tempfile.TemporaryDirectory() as folder:
            done = run("cmake", "--install", BUILD, "--prefix", folder, "--component", "development")
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            include = pathlib.Path(folder) / "include"
            compiler = [COMPILER, "-std=c++20", "-I", include, "-isystem", "/usr/include/eigen3"]
            headers = {path.relative_to(include).as_posix(): path.read_text() for path in include.rglob("*.hpp")}
            chains, below = chains_of(headers)
            for number, header in enumerate(self.COMMON):
                compiled = pathlib.Path(folder) / f"common{number}.hpp"
                compiled.write_text(f'#include "{header}"\n')
                self.assertEqual(run(*compiler, "-x", "c++-header", compiled, "-o", f"{compiled}.gch").returncode, 0)

            def complaint(chain):
                common = [f"{folder}/common{number}.hpp" for number, header in enumerate(self.COMMON) if header in below[chain[0]]]
                source = "".join(f'#include "{header}"\n' for header in chain)
                done = subprocess.run([*compiler, *(["-include", common[0]] if common else []), "-fsyntax-only", "-x", "c++", "-"],
                                      input=source, capture_output=True, text=True)
                return None if done.returncode == 0 else f"{chain}:\n{done.stderr}"

            with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
                self.assertEqual([text for text in pool.map(complaint, chains) if text], [])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
