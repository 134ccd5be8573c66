#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Checks what README.md and docs/ name against what is there; prints page:line for each name that is not.

Everywhere: the options and settings of `tutti` commands, and the arguments of tutti_ros's launch files. In docs/extending.md, which
says where to change what, also every file, function, type and table. A page of docs/results begins with what was asked. A guide, which is
a page of docs/ itself that is no reference, has 2,000 words at most.

With --run, README.md's commands for one's own data are run as they stand there, the live ones against a running server (run_readme.py).

usage: check_pages.py [--run TUTTI_PROGRAM] [project root]
"""
import pathlib
import re
import sys

import run_readme

SOURCES = {"src", "apps", "proto", "python", "ros2", "cmake", "tests", "scripts", "bench", "web/src", "web/test"}
SUFFIXES = {".cpp", ".hpp", ".py", ".proto", ".txt", ".cmake", ".sh", ".yaml", ".ts", ".mjs"}
EXTENDING = "docs/extending.md"
REFERENCES = {"architecture.md", "data.md", "math.md", "protocol.md", "report.md"}
MOST_WORDS = 2000
CODE = re.compile(r"`([^`]+)`")
COMMAND = re.compile(r"(?:^|[\s;])tutti (?:[a-z]+ ?)+.*")
OPTION = re.compile(r"(?<![\w-])(--[a-z][a-z-]+)")
SETTING = re.compile(r"--set ['\"]?([\w.]+)=")
LAUNCH = re.compile(r"ros2 launch tutti_ros (\S+)(.*)")
PATH = re.compile(r"[\w.-]+(/[\w.-]+)+/?|[\w-]+\.(md|cpp|hpp|py|proto|txt|sh)")
WORD = re.compile(r"[A-Za-z_]\w*(::\w+)*(\(\))?")


def read(path):
    return path.read_text(errors="ignore")


class Project:
    def __init__(self, root):
        self.root = root
        files = [f for top in SOURCES for f in (root / top).rglob("*") if f.is_file() and f.suffix in SUFFIXES]
        self.words = {word for file in files for word in re.findall(r"\w+", read(file))}
        self.options = {o for f in files if f.is_relative_to(root / "apps") for o in OPTION.findall(read(f))} | {"--help"}
        self.options |= {f"--{name}" for name in re.findall(r'"([a-z-]+)"', "".join(map(read, (root / "src/tutti/exports").glob("*.?pp"))))}
        self.keys = {key for f in files if f.is_relative_to(root / "src") for key in re.findall(r'"(\w+)"', read(f))}

    def has_file(self, name):
        return any((self.root / folder / name).exists() for folder in ("", "src/tutti", "apps/tutti"))

    def wrong_command(self, text):
        for setting in SETTING.findall(text):
            yield from (f"setting {setting}: '{key}' is no key" for key in setting.split(".") if not key.isdigit() and key != "N" and key not in self.keys)
        if COMMAND.search(text):
            yield from (f"option {o} is not in apps/" for o in OPTION.findall(COMMAND.search(text)[0].split(" #")[0]) if o not in self.options)
        if (launch := LAUNCH.search(text)):
            file = self.root / "ros2/tutti_ros/launch" / launch[1]
            if not file.exists():
                yield f"launch file {launch[1]} is not there"
            else:
                yield from (f"argument {a}:= is not in {launch[1]}" for a in re.findall(r"(\w+):=", launch[2].split(" #")[0]) if f'"{a}"' not in read(file))

    def wrong_name(self, code):
        if PATH.fullmatch(code):
            if not self.has_file(code):
                yield f"file {code} is not there"
        elif WORD.fullmatch(code):
            if any(word not in self.words for word in re.findall(r"\w+", code)):
                yield f"name {code} is in no source"


def breaches(root):
    project = Project(root)
    for page in sorted((root / "docs/results").glob("*.md")):
        if not re.match(r"# .+\n\nAsked (was|were) ", read(page)):
            yield f"{page.relative_to(root).as_posix()}:3: a page of results begins with 'Asked was ..' or 'Asked were ..'"
    for page in [root / "README.md", *sorted((root / "docs").glob("*.md"))]:
        if page.name not in REFERENCES and (words := len(read(page).split())) > MOST_WORDS:
            yield f"{page.relative_to(root).as_posix()}:1: {words} words, expected {MOST_WORDS} at most, as of any page that is no reference"
    for page in [root / "README.md", *sorted((root / "docs").rglob("*.md"))]:
        name = page.relative_to(root).as_posix()
        block, command = False, ""
        for number, line in enumerate(read(page).splitlines(), 1):
            if line.startswith("```"):
                block, command = not block, ""
                continue
            spans = [line] if block else CODE.findall(line)
            if block:  # a command that goes on in the next line
                command = (command + line).rstrip("\\") if line.endswith("\\") else command + line
                spans, command = ([], command) if line.endswith("\\") else ([command], "")
            for span in spans:
                wrong = list(project.wrong_command(span))
                if name == EXTENDING and not block:
                    wrong += project.wrong_name(span)
                yield from (f"{name}:{number}: {what}" for what in wrong)


def main():
    arguments = sys.argv[1:]
    program = arguments[1] if arguments[:1] == ["--run"] else None
    rest = arguments[2:] if program else arguments
    root = pathlib.Path(rest[0] if rest else pathlib.Path(__file__).parents[1]).resolve()
    found = run_readme.run(read(root / "README.md"), program) if program else list(breaches(root))
    print("\n".join(found) or f"check_pages: {root.name}: every command {'of README.md runs' if program else 'and name is there'}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
