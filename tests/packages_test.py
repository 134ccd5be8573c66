#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The Debian packages, made of what is built and unpacked into an empty folder: no network, no root. What apt makes of them
in a clean system is scripts/test_packages.sh's. Usage: packages_test.py BUILD_DIR VERSION [Packages.TEST...]"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

BUILD, VERSION = pathlib.Path(sys.argv[1]).resolve(), sys.argv[2]
PROGRAMS = ("tutti", "tutti-server")


def run(*command, **more):
    return subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=300, **more)


def names_in(relation):
    """The names in "a (>= 1), b | c"."""
    return set(re.findall(r"(?:^|[,|])\s*([a-z0-9.+-]+)", relation))


class Packages(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.path = pathlib.Path(cls.folder.name)
        shutil.rmtree(BUILD / "manual", ignore_errors=True)  # what `ninja tutti` alone has built is enough
        done = run("cpack", "-G", "DEB", "--config", BUILD / "CPackConfig.cmake", "-B", cls.path / "made", "-D", "CPACK_DEBIAN_COMPRESSION_TYPE=none",
                   cwd=cls.path)
        assert done.returncode == 0, done.stdout + done.stderr
        cls.packages = {file.name.split("_")[0]: file for file in (cls.path / "made").glob("*.deb")}
        for name, file in cls.packages.items():
            subprocess.run(["dpkg-deb", "-x", file, cls.path / name], check=True)
            subprocess.run(["dpkg-deb", "-e", file, cls.path / name / "DEBIAN"], check=True)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def files(self, name):
        return [path.relative_to(self.path / name).as_posix() for path in (self.path / name).rglob("*") if not path.is_dir()]

    def field(self, name, field):
        return run("dpkg-deb", "-f", self.packages[name], field).stdout.strip()

    def test_they_are_there_with_a_version_a_licence_and_nothing_that_only_tests(self):
        self.assertGreaterEqual(set(self.packages), {"tutti", "tutti-server", "libtutti-dev"})
        for name in self.packages:
            self.assertEqual(self.field(name, "Version"), VERSION)
            copyright = (self.path / name / f"usr/share/doc/{name}/copyright").read_text()
            defined = set(re.findall(r"^License: (\S+)\n ", copyright, re.M))
            self.assertLessEqual(set(re.findall(r"^License: (\S+)$", copyright, re.M)), defined)
            self.assertEqual([file for file in self.files(name) if re.search(r"gtest|rapidcheck|_test\.|test_|bench|\.golden|simulation/", file)], [])
        for name in PROGRAMS:
            self.assertEqual([file for file in self.files(name) if re.match("usr/(s?bin|lib/[^s])", file)], ["usr/bin/tutti"])
            self.assertEqual(self.field(name, "Recommends"), "nats-server")
            self.assertLessEqual({"postinst", "prerm", "md5sums"}, {file.name for file in (self.path / name / "DEBIAN").iterdir()})

    def test_the_programs_run_from_where_they_were_unpacked(self):
        with tempfile.TemporaryDirectory() as folder:
            def unpacked(name, *words):
                return run(self.path / name / "usr/bin/tutti", *words, cwd=folder, env={"PATH": "/usr/bin:/bin", "HOME": folder})

            for name in PROGRAMS:
                self.assertEqual(unpacked(name, "--version").stdout.strip(), VERSION)
            mission = self.path / "tutti/usr/share/tutti/missions/tunnel.yaml"
            done = unpacked("tutti", "run", mission, "--out", "out", "--set", "simulation.robots=[{walk: {duration_s: 20}}, {walk: {duration_s: 20}}]")
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            self.assertIn("corrected", done.stdout)
            self.assertTrue((pathlib.Path(folder) / "out/report.html").exists())
            done = unpacked("tutti-server", "demo", "--sensors", "visual", "--out", "visual")
            self.assertEqual(done.returncode, 1)
            self.assertIn("without OpenCV", done.stderr)

    def test_every_library_that_is_needed_is_of_a_package_that_is_depended_on(self):
        needed = {}  # the files that need a library, with their package
        for name in self.packages:
            for file in self.files(name):
                path = self.path / name / file
                with path.open("rb") as binary:
                    is_linked = binary.read(4) == b"\x7fELF"
                if is_linked:
                    for library in re.findall(r"\(NEEDED\).*\[(.*)\]", run("readelf", "-d", path).stdout):
                        needed.setdefault(library, set()).add((name, file))
        self.assertGreater(len(needed), 20)
        owners = {library: set() for library in needed}  # packages, and what these provide
        for line in run("dpkg", "-S", *[f"*/{library}" for library in needed]).stdout.splitlines():
            packages, path = line.split(": ")
            # libopenblas0 is any one of libopenblas0-pthread, -openmp and -serial.
            owners[path.rsplit("/", 1)[1]].update(name for package in packages.split(", ") for name in (package.split(":")[0], package.split("-pthread")[0]))
        for library, files in needed.items():
            provided = run("dpkg-query", "-W", "-f", "${Provides},", *owners[library]).stdout
            for name, file in files:
                depends = names_in(self.field(name, "Depends"))
                self.assertTrue((owners[library] | names_in(provided)) & depends,
                                f"{name}: {file} needs {library} of {sorted(owners[library])}, and depends on {sorted(depends)}")
                self.assertFalse(name == "tutti-server" and "opencv" in library)

    def test_the_library_names_packages_that_there_are(self):
        """Those that this was built with, so that no name is made up."""
        for package in names_in(self.field("libtutti-dev", "Depends")) | names_in(self.field("libtutti-dev", "Recommends")):
            self.assertEqual(run("dpkg-query", "-W", "-f", "${db:Status-Status}", package).stdout, "installed", package)

    def test_manual_and_completion(self):
        for name in PROGRAMS:
            page = self.path / name / "usr/share/man/man1/tutti.1.gz"
            if shutil.which("man"):
                done = run("man", "--warnings", "-l", page, env=os.environ | {"LC_ALL": "C.UTF-8", "MAN_KEEP_FORMATTING": "", "PAGER": "cat"})
                self.assertEqual((done.returncode, done.stderr), (0, ""))
                self.assertIn("tutti map closure list", done.stdout)
            script = 'source "$1"; shift; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _tutti; echo "${COMPREPLY[@]}"'
            completed = lambda *words: run("bash", "-c", script, "bash", self.path / name / "usr/share/bash-completion/completions/tutti", "tutti", *words)
            self.assertEqual(completed("map", "clos").stdout, "closure\n")
            self.assertEqual(completed("server", "--lis").stdout, "--listen\n")

    def test_the_readme_names_only_what_is_in_the_package(self):
        for name in PROGRAMS:
            text = (self.path / name / f"usr/share/doc/{name}/README.md").read_text()
            named = set(re.findall(r"`((?:/usr/|docs/|examples/|[A-Z]+\.md)[^`]*)`", text)) | set(re.findall(r"docs/[a-z-]+\.md", text))
            self.assertGreater(len(named), 15)
            for file in named:
                self.assertTrue((self.path / name / f"usr/share/doc/{name}" / file if file[0] != "/" else self.path / name / file[1:]).exists(), file)
            for mission in re.findall(r"`([a-z_]+\.yaml)`", text):
                self.assertTrue((self.path / name / "usr/share/tutti/missions" / mission).exists(), mission)
            for elsewhere in ("docs/results", "docs/images", "scripts/", "CONTRIBUTING", "LICENSE"):
                self.assertNotIn(elsewhere, text)

    def test_systemd_has_nothing_to_say_of_the_units(self):
        if not shutil.which("systemd-analyze"):
            self.skipTest("no systemd-analyze here")
        for name in PROGRAMS:
            units = []
            for file in self.files(name):
                if file.endswith(".service"):
                    text = (self.path / name / file).read_text()
                    self.assertIn("\nExecStart=/usr/bin/tutti ", text)
                    self.assertIn("\nUser=tutti\n", text)
                    units.append(self.path / name / pathlib.Path(file).name.replace("@", "@one"))
                    units[-1].write_text(text.replace("ExecStart=/usr", f"ExecStart={self.path / name / 'usr'}"))
            self.assertEqual(len(units), 3)
            done = run("systemd-analyze", "verify", "--man=no", *units)
            self.assertEqual((done.returncode, done.stdout + done.stderr), (0, ""))

    def test_python_imports_the_module(self):
        if "python3-tutti" not in self.packages:
            self.skipTest("built without TUTTI_BUILD_PYTHON")
        done = run("python3", "-c", "import tutti; print(tutti.__file__)", cwd=self.path,
                   env={"PATH": "/usr/bin:/bin", "PYTHONPATH": str(self.path / "python3-tutti/usr/lib/python3/dist-packages")})
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("python3-tutti", done.stdout)


if __name__ == "__main__":
    if missing := [program for program in ("cpack", "dpkg-deb", "dpkg-shlibdeps", "readelf") if not shutil.which(program)]:
        print("TUTTI_ALL_SKIPPED: no", " ".join(missing))
        sys.exit(0)
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
