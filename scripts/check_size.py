#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Holds the size of every room below what scripts/size_caps.txt allows, so that the product does not grow unseen.

usage: check_size.py [--lower] [project root]

A room is a folder of src/tutti that is a layer, apps, python, proto or web/src. Counted are its lines of code (neither
empty nor comments, and no tests: nobody asks leave to add one), its settings (fields with a name in describe()), its public
names (what its headers outside internal/ declare) and the data members of its largest class. With --lower, caps above
today's figures become today's figures; a higher cap is written by hand, with its reason behind a '#'.
"""
import json
import pathlib
import re
import shutil
import subprocess
import sys

from check_layers import layer_of, layer_order

CAPS = "scripts/size_caps.txt"
COLUMNS = ("lines", "settings", "names", "members")
CODE = {".hpp", ".cpp", ".py", ".ts", ".css", ".mjs", ".proto"}
COMMENT = re.compile(r'"(?:\\.|[^"\\\n])*"|/\*.*?\*/|//[^\n]*', re.S)
SETTING = re.compile(r'\bv\.field\(\s*"')
PUBLIC = {"class", "struct", "enum", "prototype", "function", "alias", "typedef", "variable", "externvar"}


def lines_of_code(path):
    text = path.read_text()
    if path.suffix == ".py":
        text = re.sub(r"^\s*#.*$", "", text, flags=re.M)
    else:
        text = COMMENT.sub(lambda found: found[0] if found[0].startswith('"') else "", text)
    return sum(1 for line in text.splitlines() if line.strip())


def room_of(order, relative):
    """None: not of the product, or made by a program."""
    parts = relative.parts
    if relative.suffix not in CODE or "node_modules" in parts or "dist" in parts:
        return None
    if parts[0] == "tests" or relative.stem.endswith("_test") or parts[:2] == ("web", "test"):
        return "tests"
    if parts[:2] == ("src", "tutti"):
        return layer_of(order, "/".join(parts[2:]))
    if parts[:2] == ("web", "src"):
        return "web/src"
    return parts[0] if parts[0] in ("apps", "python", "proto") else None


def tags_of(headers):
    """The declarations in headers, by Universal Ctags."""
    if shutil.which("ctags") is None:
        raise ValueError("ctags is not installed: apt install universal-ctags")
    made = subprocess.run(["ctags", "--output-format=json", "--languages=C++", "--langmap=C++:.hpp", "--kinds-C++=+p", "--fields=+sKa",
                           "-L", "-", "-o", "-"], input="\n".join(map(str, headers)), capture_output=True, text=True, check=True)
    return [json.loads(line) for line in made.stdout.splitlines()]


def sizes(root):
    """{room: {column: figure}}"""
    order = layer_order(root)
    found, headers = {}, {}
    for folder in ("src", "apps", "python", "proto", "tests", "web"):
        for path in sorted((root / folder).rglob("*")):
            room = room_of(order, path.relative_to(root))
            if room is None:
                continue
            size = found.setdefault(room, dict.fromkeys(COLUMNS, 0))
            size["lines"] += lines_of_code(path)
            if room == "tests":
                continue
            if path.suffix in (".hpp", ".cpp"):
                size["settings"] += len(SETTING.findall(path.read_text()))
            if path.suffix == ".hpp":
                headers[str(path)] = room
    names, members = {}, {}
    for tag in tags_of(headers):
        room = headers[tag["path"]]
        if tag["kind"] == "member" and tag.get("scopeKind") == "class":
            members.setdefault(room, {}).setdefault(tag["scope"], set()).add(tag["name"])
        if tag["kind"] in PUBLIC and tag.get("scopeKind", "namespace") == "namespace" and "/internal/" not in tag["path"]:
            names.setdefault(room, set()).add((tag.get("scope"), tag["name"]))
    for room, size in found.items():
        size["names"] = len(names.get(room, ()))
        size["members"] = max((len(of) for of in members.get(room, {}).values()), default=0)
    return found


def read_caps(text):
    """({room: {column: cap}}, {room: reason})"""
    caps, reasons = {}, {}
    for number, line in enumerate(text.splitlines(), 1):
        words, _, reason = line.partition("#")
        if not words.split():
            continue
        room, *figures = words.split()
        if len(figures) != len(COLUMNS) or not all(figure.isdigit() for figure in figures):
            raise ValueError(f"{CAPS}:{number}: '{line}' is no room with {', '.join(COLUMNS)}")
        caps[room] = dict(zip(COLUMNS, map(int, figures)))
        reasons[room] = reason.strip()
    return caps, reasons


def breaches(found, caps):
    out = [f"{room} has {size[column]} {column}, at most {caps[room][column]} are allowed: make it smaller, or raise the cap in {CAPS} and say why behind a '#'"
           for room, size in found.items() if room in caps for column in COLUMNS if size[column] > caps[room][column]]
    out += [f"{room} has no line in {CAPS}: add '{room} {' '.join(str(found[room][column]) for column in COLUMNS)}'" for room in sorted(found.keys() - caps.keys())]
    return out + [f"{CAPS} has a line of {room}, which is no room any more: delete it" for room in sorted(caps.keys() - found.keys())]


def text_of(caps, reasons):
    head = ["# The most that each room may have: see scripts/check_size.py. A cap is lowered with the change that makes it possible",
            "# (check_size.py --lower), and raised by hand with its reason behind a '#'.",
            f"# {'room':<25}" + "".join(f"{column:>9}" for column in COLUMNS)]
    rows = [f"{room:<27}" + "".join(f"{caps[room][column]:>9}" for column in COLUMNS) + (f"  # {reasons[room]}" if reasons.get(room) else "")
            for room in sorted(caps)]
    return "\n".join(head + rows) + "\n"


def main(arguments):
    lower = "--lower" in arguments
    root = pathlib.Path(next((word for word in arguments if word != "--lower"), pathlib.Path(__file__).resolve().parent.parent))
    found = sizes(root)
    tests = found.pop("tests")["lines"]
    caps, reasons = read_caps((root / CAPS).read_text()) if (root / CAPS).exists() else ({}, {})
    if lower:
        caps = {room: {column: min(size[column], caps.get(room, size)[column]) for column in COLUMNS} for room, size in found.items()}
        (root / CAPS).write_text(text_of(caps, reasons))
    wrong = breaches(found, caps)
    for line in wrong:
        print(line)
    print(f"{sum(size['lines'] for size in found.values()):,} lines of code, {tests:,} of tests, {sum(size['settings'] for size in found.values())} settings")
    spare = sum(caps[room]["lines"] - size["lines"] for room, size in found.items() if room in caps)
    if not wrong and spare > 0:
        print(f"caps are {spare} lines above today's: {pathlib.Path(sys.argv[0]).name} --lower")
    return 1 if wrong else 0


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except ValueError as error:
        sys.exit(str(error))
