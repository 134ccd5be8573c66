#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The ROS 2 node without ROS: real CDR bytes into a stub of rclpy, and `tutti robot` at the other end of the socket.

usage: tutti_ros_test.py TUTTI_PROGRAM SOURCE_DIR PROTO_PYTHON_DIR SHARED_DIR [MODULE.CLASS.TEST...]
"""
import os
import pathlib
import sys
import unittest

HERE = pathlib.Path(__file__).resolve().parent
sys.path += [sys.argv[3], str(HERE), str(HERE.parent)]
try:
    import google.protobuf  # noqa: F401
    import numpy  # noqa: F401
except ImportError as missing:
    if sys.executable != "/usr/bin/python3" and os.path.exists("/usr/bin/python3"):  # where Debian's packages are
        os.execv("/usr/bin/python3", ["/usr/bin/python3", *sys.argv])
    print(f"TUTTI_ALL_SKIPPED: {missing}; Debian's packages are python3-protobuf and python3-numpy")
    sys.exit(0)

import ros_stub

ros_stub.install()

if __name__ == "__main__":
    names = sys.argv[5:] or ["images_node_test", "link_test", "node_test", "package_test", "server_map_test"]
    unittest.main(module=None, argv=[sys.argv[0], *names])
