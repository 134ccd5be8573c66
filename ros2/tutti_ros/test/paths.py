# SPDX-License-Identifier: BSD-3-Clause
"""As given to tutti_ros_test.py."""
import pathlib
import sys

TUTTI, SOURCE, PROTO, SHARED = sys.argv[1], pathlib.Path(sys.argv[2]), sys.argv[3], pathlib.Path(sys.argv[4])
