# SPDX-License-Identifier: BSD-3-Clause
"""Shared by the tests of the package. Usage of each: PYTHONPATH=BUILD/python xyz_test.py TUTTI_PROGRAM SOURCE_DIR [unittest's]"""
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np
import tutti

PROGRAM, SOURCE = sys.argv[1], pathlib.Path(sys.argv[2])


def run():
    unittest.main(module="__main__", argv=sys.argv[:1] + sys.argv[3:])


def program(*arguments):
    """The program's output."""
    return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=120, check=True).stdout


class InFolder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = pathlib.Path(folder.name)

    def refuses(self, words, function, *arguments, error=ValueError, **named):
        """Every one of the words is in the message."""
        with self.assertRaises(error) as caught:
            function(*arguments, **named)
        for word in words.split("|"):
            self.assertIn(word, str(caught.exception))


def turn(axis, angle):
    """(4, 4): a rotation."""
    x, y, z = np.asarray(axis, float) / np.linalg.norm(axis)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    T = np.eye(4)
    T[:3, :3] += np.sin(angle) * K + (1 - np.cos(angle)) * K @ K
    return T


def shift(x, y=0.0, z=0.0):
    T = np.eye(4)
    T[:3, 3] = x, y, z
    return T


def walk(n=200, step_s=0.1, start_s=1.7e9, error_rad=0.0):
    """A trajectory through space: odometry that turns by error_rad too much a step."""
    T, poses = np.eye(4), []
    for i in range(n):
        poses.append(T)
        T = T @ shift(0.2) @ turn([0.1, 0.2, 1.0], 0.05 * np.sin(0.05 * i) + error_rad)
    return tutti.Trajectory.from_matrices(start_s + step_s * np.arange(n), np.array(poses))
