# SPDX-License-Identifier: BSD-3-Clause
"""Where, since when and at which scale two trajectories part: compare_trajectories.py REFERENCE ESTIMATE (TUM, EuRoC, KITTI)"""
import sys

import tutti

reference, estimate = map(tutti.read_trajectory, sys.argv[1:3])
print(tutti.ate(estimate, reference))
print(tutti.rpe(estimate, reference, delta_m=10.0))
for origin in tutti.compare(reference, estimate).origins:
    print(origin)
