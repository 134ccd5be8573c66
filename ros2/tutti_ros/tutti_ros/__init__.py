# SPDX-License-Identifier: BSD-3-Clause
"""A client of Tutti's live feed (docs/protocol.md) as a ROS 2 node; everything but node.py knows no ROS."""
