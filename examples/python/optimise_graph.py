# SPDX-License-Identifier: BSD-3-Clause
"""Which closures of a pose graph are wrong, and the graph without them: optimise_graph.py IN.g2o OUT.g2o"""
import sys

import tutti

if len(sys.argv) != 3:
    sys.exit(__doc__)
result = tutti.optimise_robust(tutti.read_graph(sys.argv[1]))
print(result)
for (a, b), reason in zip(result.graph.ids[tutti.read_graph(sys.argv[1]).edges], result.reasons):
    if reason:
        print(f"from {a} to {b}: {reason}")
tutti.write_graph(sys.argv[2], result.graph)
