# SPDX-License-Identifier: BSD-3-Clause
"""Where, since when and at which scale two trajectories part: compare_trajectories.py ESTIMATE REFERENCE (TUM, EuRoC, KITTI)"""
import sys

import tutti

if len(sys.argv) != 3:
    sys.exit(__doc__)
estimate, reference = map(tutti.read_trajectory, sys.argv[1:3])
print(tutti.ate(estimate, reference))
print(tutti.rpe(estimate, reference, delta_m=10.0))
for origin in tutti.compare(estimate=estimate, reference=reference).origins:
    print(origin)
