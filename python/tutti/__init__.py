# SPDX-License-Identifier: BSD-3-Clause
"""Collaborative robot mapping by spectral graph analysis: numpy in, numpy out.

Lengths are metres, stamps seconds, angles as their names say. T_a_b, (4, 4), maps coordinates of b to a. Quaternions are
Hamilton, in the order x y z w. Covariances and information matrices, (6, 6), are of the right perturbation
[translation m; rotation rad]. Wrong input raises ValueError and troubles with files OSError, with what, where, the value
and what was expected; RuntimeError is a bug of Tutti's own.
"""
from . import _tutti
from ._tutti import *  # noqa: F403
from ._tutti import __version__

__all__ = sorted(name for name in vars(_tutti) if not name.startswith("_"))
