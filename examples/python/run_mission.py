# SPDX-License-Identifier: BSD-3-Clause
"""Runs a mission, then looks into its map: run_mission.py MISSION.yaml MAP [DATA] (demo: the built-in mission)"""
import sys

import numpy as np
import tutti

if len(sys.argv) not in (3, 4):
    sys.exit(__doc__)
mission, file, *data = sys.argv[1:]
result = tutti.run_mission(mission, *data, map=file, settings={"agent.submap.duration_s": 8})
for robot in result.robots:
    if len(robot.reference):
        print(f"{robot.name}: {robot.odometry_rmse_m:.3f} m by odometry, {robot.corrected_rmse_m:.3f} m corrected")

joint = tutti.open_map(file)
print(joint, "in", joint.components, "components")
for closure in joint.closures():
    if closure.state == "rejected":
        print(closure.name, closure.reason)
cells, corner, _ = joint.grid(resolution_m=0.2)
print(f"a map to drive on of {cells.shape[1]} x {cells.shape[0]} cells, {np.mean(cells == 0):.0%} free")
