# SPDX-License-Identifier: BSD-3-Clause
"""Collaborative robot mapping by spectral graph analysis: numpy in, numpy out.

Lengths are metres, stamps seconds, angles as their names say. T_a_b, (4, 4), maps coordinates of b to a. Quaternions are
Hamilton, in the order x y z w. Covariances and information matrices, (6, 6), are of the right perturbation
[translation m; rotation rad]. Wrong input raises ValueError and troubles with files OSError, with what, where, the value
and what was expected; RuntimeError is a bug of Tutti's own.
"""
import functools
import warnings

from . import _tutti
from ._tutti import *  # noqa: F403
from ._tutti import __version__



@functools.wraps(_tutti.compare)
def compare(*both, **named):
    # For who called it before 0.2, as compare(a, b), where a judged: until 0.3.
    if {"a", "b"} & named.keys():
        warnings.warn("tutti.compare: a and b are called reference and estimate since 0.2", DeprecationWarning, stacklevel=2)
        named = {{"a": "reference", "b": "estimate"}.get(name, name): value for name, value in named.items()}
    elif len(both) > 1:
        warnings.warn("tutti.compare takes (estimate, reference) since 0.2, in the order of tutti.ate, and took the reference first "
                      "before: name them", FutureWarning, stacklevel=2)
    return _tutti.compare(*both, **named)


__all__ = sorted(name for name in vars(_tutti) if not name.startswith("_"))
