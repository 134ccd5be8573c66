#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Checks that the product's built libraries have no symbol of the laboratory (check_layers.py defines it), defined or
needed: what runs on a robot links nothing that measures it.

usage: check_product.py BUILD_FOLDER [ROOM..]
ROOM: one that this build leaves out (program/ros without CycloneDDS, for example).
"""
import pathlib
import re
import subprocess
import sys

from check_layers import LABORATORY, layer_order

ROOT = pathlib.Path(__file__).parents[1]


def names_in(room):
    """As a mangled name has the namespace of a room of this name."""
    name = room.split("/")[0]
    return f"N5tutti{len(name)}{name}"


def breaches(build, left_out):
    forbidden = re.compile("|".join(sorted({re.escape(names_in(room)) for room in LABORATORY})))
    for room in layer_order(ROOT):
        if room in LABORATORY or room in left_out:
            continue
        libraries = sorted((build / "src/tutti" / room).glob("libtutti_*.a"))
        for library in libraries:
            symbols = subprocess.run(["nm", "--format=just-symbols", library], capture_output=True, text=True, check=True).stdout
            if found := forbidden.search(symbols):
                line = symbols[symbols.rfind("\n", 0, found.start()) + 1:].split("\n", 1)[0]
                yield f"{library.name}: {line} is of the laboratory"
        if not libraries and any((ROOT / "src/tutti" / room).glob("*.cpp")):
            yield f"{room}: no library below {build}"


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    found = list(breaches(pathlib.Path(sys.argv[1]), sys.argv[2:]))
    print("\n".join(found) or "product: nothing of the laboratory in it")
    sys.exit(1 if found else 0)
