# SPDX-License-Identifier: BSD-3-Clause
"""Says where a robot was in a map, by what it has recorded, and when it did not know: localise.py MAP BAG OUT.tum"""
import sys

import tutti

if len(sys.argv) != 4:
    sys.exit(__doc__)
file, bag, out = sys.argv[1:]
robot, = tutti.localise_bags({"robot": bag}, file).robots
before = None
for place in robot.course:
    if place.state != before:
        print(f"{place.stamp:.1f} s: {place.state}; {place.why}")
    before = place.state
tutti.write_trajectory(out, robot.published())
