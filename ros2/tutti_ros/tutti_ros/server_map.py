# SPDX-License-Identifier: BSD-3-Clause
"""The joint map of a server on this machine as a grid: `tutti map export --live` makes it of a copy of the map's file. Only
reads; without ROS."""
import contextlib
import dataclasses
import os
import pathlib
import re
import subprocess
import tempfile

import numpy as np

from tutti_ros.diagnosis import ERROR, OK, WARN

REST_PER_WORK = 9.0      # as of `tutti server --ros`: a tenth of a core at most
LONGEST_WAIT_S = 60.0    # after what failed
NICENESS = 10
LARGEST_GRID = 2**28     # cells
FREE, OCCUPIED, UNKNOWN = 0, 100, -1  # nav_msgs/OccupancyGrid
EXPECTED = ("image", "mode", "resolution", "origin", "negate", "occupied_thresh", "free_thresh")


@dataclasses.dataclass(eq=False)
class Grid:
    resolution_m: float
    origin_m: tuple    # corner of the first cell with the least x and y
    cells: np.ndarray  # height x width of int8, row by row from the least y on
    component: int = 0  # of the server's map, whose world it is in
    tilt: tuple = (0.0, 0.0, 0.0, 1.0)  # x y z w of the quaternion that takes this world level
    ground_m: float = 0.0               # where the grid lies, in the level frame

    def origin_in_world(self):
        """(x y z, x y z w): the pose of the first cell's corner."""
        x, y, z, w = self.tilt
        back = -np.array([x, y, z])
        corner = np.array([*self.origin_m, self.ground_m])
        turned = corner + 2.0 * np.cross(back, np.cross(back, corner) + w * corner)
        return tuple(map(float, turned)), (-x, -y, -z, w)

    def __eq__(self, other):
        return (isinstance(other, Grid) and (self.resolution_m, self.origin_m) == (other.resolution_m, other.origin_m)
                and self.component == other.component and np.array_equal(self.cells, other.cells))


def settings_of(yaml):
    """{key: text} of a map's yaml as `tutti map export` and nav2's map saver write it: a line each, not nested."""
    lines = [line.split("#")[0].strip() for line in yaml.splitlines()]
    out = {key.strip(): text.strip() for key, colon, text in (line.partition(":") for line in lines) if colon}
    missing = [key for key in EXPECTED if key not in out]
    if missing:
        raise ValueError(f"a map's yaml without {', '.join(missing)}")
    return out


def pixels_of(pgm):
    """height x width of uint8, row by row from the top, of a binary PGM image with 255 shades."""
    words, at = [], 0
    while len(words) < 4:
        line, newline, _ = pgm[at:at + 1000].partition(b"\n")
        if not newline:
            raise ValueError("an image whose header does not end")
        at += len(line) + 1
        words += line.split(b"#")[0].split()
    kind, width, height, most = words[:4]
    if kind != b"P5" or most != b"255" or not (width + height).isdigit() or int(width) * int(height) > LARGEST_GRID:
        raise ValueError(f"an image that begins with {pgm[:20]}, expected P5, width, height and 255")
    shape = int(height), int(width)
    if len(pgm) - at != shape[0] * shape[1]:
        raise ValueError(f"an image of {len(pgm) - at} bytes, expected {shape[1]} x {shape[0]}")
    return np.frombuffer(pgm, np.uint8, offset=at).reshape(shape)


def grid_of(yaml, pgm):
    """As nav2's map server reads it, mode trinary: darker than occupied_thresh is occupied, lighter than free_thresh free
    (or inverted with negate), and the image's last row is the least y."""
    said = settings_of(yaml)
    if said["mode"] != "trinary":
        raise ValueError(f"mode '{said['mode']}', expected trinary")
    origin = [float(word) for word in said["origin"].strip("[]").split(",")]
    resolution_m, low, high = (float(said[key]) for key in ("resolution", "free_thresh", "occupied_thresh"))
    numbers = np.array([resolution_m, low, high, *origin])
    if len(origin) != 3 or not np.isfinite(numbers).all() or resolution_m <= 0.0 or origin[2] != 0.0:
        raise ValueError(f"resolution {said['resolution']}, origin {said['origin']}, thresholds {said['free_thresh']} and "
                         f"{said['occupied_thresh']}: expected a positive one, [x, y, 0], and finite numbers")
    shade = np.arange(256) / 255.0
    occupied = shade if said["negate"] == "1" else 1.0 - shade
    cell_of = np.where(occupied > high, OCCUPIED, np.where(occupied < low, FREE, UNKNOWN)).astype(np.int8)
    note = lambda pattern, other: [float(word) for word in (re.search(pattern, yaml, re.MULTILINE) or [0, other])[1].split()]
    return Grid(resolution_m, tuple(origin[:2]), cell_of[pixels_of(pgm)[::-1]],
                int(note(r"^# component (\d+) of the map$", "0")[0]),
                tuple(note(r"^# T_level_world 0 0 0 ((?:[-+.\de]+ ){4})", "0 0 0 1")),
                note(r"^# ground at ([-+.\de]+) m$", "0")[0])



class ServerMap:
    """Makes a grid whenever the map's file is another, one at a time and at most every `period_s`: look(). The file need
    not be there, and may be opened, closed and replaced at any time."""

    def __init__(self, file, period_s=5.0, program="tutti"):
        self.file, self.period_s, self.program = pathlib.Path(file), period_s, program
        self.folder = tempfile.TemporaryDirectory(prefix="tutti_map_")
        self.running, self.begin_s, self.not_before_s = None, 0.0, 0.0
        self.signature, self.failures, self.made = None, 0, 0
        self.grid, self.why, self.took_s = None, "", 0.0

    def close(self):
        if self.running:
            self.running.kill()
            self.running.wait()
        self.folder.cleanup()

    def look(self, now_s):
        """The grid, if it is another than before; else None. Returns at once."""
        if self.running:
            if self.running.poll() is None:
                return None
            return self._finish(now_s)
        signature = self.signature_now()
        if signature is None:
            self.why = f"{self.file} is not there yet: no server has begun a map in this folder"
        elif signature != self.signature and now_s >= self.not_before_s:
            self.signature = signature
            self._start(now_s)
        return None

    def signature_now(self):
        """The state of the files; another one where anything was stored. None: they are not there."""
        def state(path):
            try:
                found = path.stat()
            except OSError:
                return None
            return found.st_ino, found.st_size, found.st_mtime_ns
        there = state(self.file)
        return there and (there, state(self.file.with_name(self.file.name + "-wal")))

    def _start(self, now_s):
        self.begin_s = now_s
        self.why = self.why if self.failures else ""
        out = pathlib.Path(self.folder.name)
        try:
            with (out / "said").open("wb") as said:
                self.running = subprocess.Popen(
                    [self.program, "map", "export", self.file, "--live", "--grid", out / "map.yaml"],
                    stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=said, env={**os.environ, "TMPDIR": str(out)})
        except OSError as error:
            self._failed(now_s, f"{self.program}: {error}")
            return
        with contextlib.suppress(OSError):  # it has ended already
            os.setpriority(os.PRIO_PROCESS, self.running.pid, NICENESS)

    def _finish(self, now_s):
        code, self.running = self.running.returncode, None
        out, self.took_s = pathlib.Path(self.folder.name), now_s - self.begin_s
        if code != 0:
            said = (out / "said").read_text(errors="replace").strip()
            self._failed(now_s, (said.splitlines() or [f"tutti map export ended with {code}"])[-1][:500])
            return None
        try:
            grid = grid_of((out / "map.yaml").read_text(), (out / "map.pgm").read_bytes())
        except (OSError, ValueError) as error:
            self._failed(now_s, f"what tutti map export wrote: {error}")
            return None
        self.why, self.failures, self.made = "", 0, self.made + 1
        self._rest(now_s, self.period_s)
        if grid == self.grid:
            return None
        self.grid = grid
        return grid

    def _failed(self, now_s, why):
        """It is tried again, sooner or later."""
        self.why, self.signature, self.failures = why, None, self.failures + 1
        self._rest(now_s, max(self.period_s, min(self.period_s * 2**min(self.failures - 1, 10), LONGEST_WAIT_S)))

    def _rest(self, now_s, period_s):
        self.not_before_s = max(self.begin_s + period_s, now_s + REST_PER_WORK * (now_s - self.begin_s))

    def diagnosis(self, now_s):
        """(level, message, {key: value}) for /diagnostics."""
        values = {"map": self.file, "maps_made": self.made, "seconds_for_the_last": f"{self.took_s:.1f}",
                  "being_made_for_s": f"{now_s - self.begin_s:.0f}" if self.running else "", "reason": self.why}
        level, text = OK, "the map is shown"
        if self.grid is not None:
            height, width = self.grid.cells.shape
            values["cells"] = f"{width} x {height} of {self.grid.resolution_m} m"
        if self.why:
            level, text = (ERROR, self.why) if self.grid is None else (WARN, f"the map is an older one: {self.why}")
        elif self.grid is None:
            level, text = WARN, "the first map is being made"
        return level, text, {key: str(value) for key, value in values.items()}
