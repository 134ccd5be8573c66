#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes two_components.json: a small graph of two components and an isolated node, solved in 40-digit arithmetic.

Independent of the C++ code: mpmath's eigensolver, the Schur complement by matrix inversion, and Meyer kernels
written from their definition. Run: python3 make_golden.py > two_components.json
"""
import json

import mpmath as mp

mp.mp.dps = 40
NODES = 12
EDGES = [(0, 1, 1.0), (1, 2, 0.5), (2, 3, 2.0), (3, 4, 0.25), (4, 5, 1.5), (5, 0, 0.75), (1, 4, 0.125),
         (6, 7, 3.0), (7, 8, 0.5), (8, 9, 1.0), (9, 10, 0.0625), (6, 8, 0.375)]
SIGNAL = [0.0, 1.0, 2.5, 3.25, 4.0, 2.0, 10.0, 11.5, 11.0, 14.0, -3.0, 5.0]
SCALES = 5
KEEP = [0, 2, 3, 6, 9, 10]


def laplacian():
    out = mp.zeros(NODES)
    for a, b, w in EDGES:
        out[a, a] += w
        out[b, b] += w
        out[a, b] -= w
        out[b, a] -= w
    return out


def smooth(y):
    return y**4 * (35 - 84 * y + 70 * y**2 - 20 * y**3)


def kernel(scale, x, lambda_max):
    t = mp.mpf(4) / (3 * lambda_max) * mp.mpf(2) ** (SCALES - 2 - max(scale - 1, 0))
    z = t * x
    third = mp.mpf(1) / 3
    if z < 2 * third:
        return mp.mpf(1 if scale == 0 else 0)
    if z < 4 * third:
        argument = mp.pi / 2 * smooth(3 * z / 2 - 1)
        return mp.cos(argument) if scale == 0 else mp.sin(argument)
    if z < 8 * third and scale > 0:
        return mp.cos(mp.pi / 2 * smooth(3 * z / 4 - 1))
    return mp.mpf(0)


def main():
    lap = laplacian()
    values, vectors = mp.eigsy(lap)
    lambda_max = max(values)
    spectrum = vectors.T * mp.matrix(SIGNAL)
    coefficients = [[None] * SCALES for _ in range(NODES)]
    for s in range(SCALES):
        filtered = mp.matrix([kernel(s, values[k], lambda_max) * spectrum[k] for k in range(NODES)])
        column = vectors * filtered
        for n in range(NODES):
            coefficients[n][s] = float(column[n])
    # Node 11 has no edge and is not kept: it would make the eliminated block singular, and nothing couples to it.
    drop = [n for n in range(NODES) if n not in KEEP and n != 11]
    pick = lambda rows, cols: mp.matrix([[lap[r, c] for c in cols] for r in rows])
    reduced = pick(KEEP, KEEP) - pick(KEEP, drop) * pick(drop, drop) ** -1 * pick(drop, KEEP)
    fields = {
        "nodes": NODES, "edges": EDGES, "signal": SIGNAL, "scales": SCALES,
        "eigenvalues": sorted(float(mp.chop(v)) for v in values),
        "coefficients": coefficients, "keep": KEEP,
        "reduced": [[float(reduced[r, c]) for c in range(len(KEEP))] for r in range(len(KEEP))]}
    print("{" + ",\n ".join(f'"{key}": {json.dumps(value)}' for key, value in fields.items()) + "}")


if __name__ == "__main__":
    main()
