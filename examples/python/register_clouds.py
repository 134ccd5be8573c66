# SPDX-License-Identifier: BSD-3-Clause
"""Lays the scans of a bag on each other, one after the other: register_clouds.py BAG TOPIC OUT.ply"""
import sys

import numpy as np
import tutti

if len(sys.argv) != 4:
    sys.exit(__doc__)
bag, topic, out = sys.argv[1:]
T_first_scan, before, everything = np.eye(4), None, []
for message in tutti.read_bag(bag, [topic]):
    scan = tutti.OrientedCloud(message.decode()["points"], voxel_m=0.3)
    if before is not None:
        step = tutti.register_clouds(before, scan)
        if not step.converged:
            continue
        T_first_scan = T_first_scan @ step.T_target_source
        print(f"{message.log_time:.3f} s  {T_first_scan[:3, 3].round(3)} m, overlap {step.overlap:.2f}")
    everything.append(scan.points @ T_first_scan[:3, :3].T + T_first_scan[:3, 3])
    before = scan
tutti.write_cloud(out, tutti.voxel_downsample(np.concatenate(everything), 0.1))
