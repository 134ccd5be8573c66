#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Checks every file below src/tutti against the architecture (docs/architecture.md); prints file:line for each breach.

usage: check_layers.py [project root]
"""
import pathlib
import re
import sys

# (what an #include looks like, which files may have it, in words)
CONFINED = [
    (r"yaml-cpp/", r"base/config_yaml\.cpp$", "base/config_yaml.cpp"),
    (r"google/protobuf|.*\.pb\.h$", r"(tests/support/)?(wire|bus|program/feed)/", "wire/, bus/ and program/feed/"),
    (r"ceres/", r"(estimation/bundle/.*\.cpp|.*_test\.cpp)$", "estimation/bundle/*.cpp and tests"),
    (r"Spectra/", r"spectral/.*\.cpp$", "spectral/*.cpp"),
    (r"nanoflann", r"(perception|spectral|consistency|evaluation)/.*\.cpp$", "perception/, spectral/, consistency/, evaluation/ *.cpp"),
    (r"nats(/|\.h)", r"(bus/(nats_.*\.cpp|internal/nats_connection\.hpp)|tests/support/pki/sign\.hpp)$",
     "bus/nats_*.cpp and their bus/internal/nats_connection.hpp, and tests/support/pki/sign.hpp"),
    (r"(spdlog|systemd)/", r"program/.*\.cpp$", "program/*.cpp"),
    (r"sqlite3", r"(storage/(sqlite_.*\.cpp|internal/sqlite\.hpp)|bags/(db3_reader|.*_test)\.cpp|tests/support/bags/rosbag2_writer\.hpp)$",
     "storage/sqlite_*.cpp and internal/sqlite.hpp, and bags/db3_reader.cpp, which only reads, and its tests"),
    (r"opencv2/", r"perception/visual/frontend/.*\.cpp$", "perception/visual/frontend/*.cpp"),
    (r"lz4|bzlib", r"(tests/support/)?bags/", "bags/"),
    (r"dds/", r"program/ros/(dds|internal/raw_type)\.cpp$", "program/ros/dds.cpp and internal/raw_type.cpp"),
    (r"openssl/", r"(bags/internal/sha256|bus/nats_settle|bus/nats_trust|pki/.*)\.cpp$",
     "bags/internal/sha256.cpp, bus/nats_settle.cpp, bus/nats_trust.cpp and pki/*.cpp"),
    (r"httplib", r"(tests/support/)?program/page/(internal/)?(guarded_server|guarded_stream|routes|history_routes|mark_routes|shared_answer|page_server_test|served_page)\.[ch]pp$", "the page's server and its tests"),
    (r"turbojpeg", r"formats/.*\.cpp$", "formats/*.cpp"),
    (r"CLI/", r"(?!)", "apps/"),
    (r"pybind11/", r"(?!)", "python/"),
    (r"support/", r"(.*_test\.cpp|tests/.*)$", "tests"),
]
# A library returns what it has to report, never ends the program, and knows nothing but its arguments.
FORBIDDEN = re.compile(
    r"\bstd::(cout|cerr|clog)\b|\bfmt::print\b|\brandom_device\b|(?<![\w.>])(std::|::)?"
    r"(f?printf|puts|abort|exit|_Exit|quick_exit|terminate|s?rand|getenv)\s*\(")
# Rooms that play robots and spoil what they send, to measure the product: no other room knows of them.
LABORATORY = {"simulation", "lab"}
# Rooms that replay recordings and score them: of the product, but nothing on a robot or its server knows of them.
REPLAY = {"mission", "mission/report"}
CLOCK = re.compile(r"\bsystem_clock\b")  # of the day: for programs
SUPPORT = "tests/support/"  # what tests share: a folder a module, checked against its layer
INCLUDE = re.compile(r'\s*#\s*include\s*[<"]([^>"]+)[>"]')


def layer_order(root):
    """The one list of layers is the list CMake builds them by."""
    cmake = (root / "src/tutti/CMakeLists.txt").read_text()
    return re.search(r"foreach\(module IN ITEMS ([^)]*)\)", cmake).group(1).split()


def layer_of(order, path):
    """The innermost listed folder that contains `path`, which is relative to src/tutti; None outside of them."""
    return max((layer for layer in order if path.startswith(layer + "/")), key=len, default=None)


def include_breach(order, relative, include):
    layer = layer_of(order, relative.removeprefix(SUPPORT))
    if include.startswith(("tutti/", "support/")) and not include.endswith(".pb.h"):  # those are generated from proto/
        other = layer_of(order, include.split("/", 1)[1])
        if other is None and include.startswith("support/"):
            other = order[0]  # what every test may use
        if other is None:
            return f"'{include.split('/')[1]}' is no layer"
        if order.index(other) > order.index(layer):
            return f"{layer} may not use {other}, a layer below it"
        if other in LABORATORY and layer not in LABORATORY and not relative.endswith("_test.cpp") and not relative.startswith(SUPPORT):
            return f"{layer} is of the product and may not use {other}, which is of the laboratory"
        if other in REPLAY and layer not in LABORATORY | REPLAY and not relative.endswith("_test.cpp") and not relative.startswith(SUPPORT):
            return f"{layer} runs on robots and servers and may not use {other}, which replays missions"
        if (layer, other) == ("server", "robot"):
            return "robot and server never include each other"
    for library, allowed, words in CONFINED:
        if re.match(library, include) and not re.match(allowed, relative):
            return f"{include} belongs only in {words}"
    return None


def breaches(root):
    order = layer_order(root)
    files = [*(root / "src/tutti").rglob("*"), *(root / SUPPORT).glob("*/**/*")]
    for path in sorted(p for p in files if p.suffix in (".hpp", ".cpp")):
        relative = path.relative_to(root).as_posix().removeprefix("src/tutti/")
        if layer_of(order, relative.removeprefix(SUPPORT)) is None:
            yield f"{path}:1: '{relative.split('/')[0]}' is missing in src/tutti/CMakeLists.txt"
            continue
        text = re.sub(r"/\*.*?\*/", lambda m: "\n" * m.group().count("\n"), path.read_text(), flags=re.S)
        for number, line in enumerate(text.splitlines(), 1):
            breach = None
            if match := INCLUDE.match(line):
                breach = include_breach(order, relative, match.group(1))
            elif not relative.endswith("_test.cpp"):
                code = re.sub(r'"(\\.|[^"\\])*"', '""', line).split("//")[0]
                if match := FORBIDDEN.search(code) or (not relative.startswith("program/") and CLOCK.search(code)):
                    breach = f"a library may not use {match.group().strip(' (')}"
            if breach:
                yield f"{path}:{number}: {breach}"


if __name__ == "__main__":
    found = list(breaches(pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parents[1])))
    print("\n".join(found) or "layers: nothing to complain about")
    sys.exit(1 if found else 0)
