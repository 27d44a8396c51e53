"""Gyros without a table: between two rests the gyros carry gravity over, and the accelerometers check (B 3).

    Ḃ = −ω × B,   ω = S (ω_m − b),   |B_carried − f/|f|| → min over S (3, 3),   b from the rest just before

The accelerometers must be calibrated. A turn about the vertical itself shows nothing; what no turn shows is
named. The Earth's rate is left out: 0.25 deg in a minute, below what hand turns of such units are used for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.solvers.least_squares import factors

_STEPS = 30
_DELTA = 1e-6  # of S, for its derivative
_RANK = 1e-5


@dataclass(frozen=True)
class Turn:
    """From rest to rest. rates: (m, 3) rad/s read; spacing: (m,) s; bias: (3,) read at rest before it

    before, after: (3,) specific force at the rests, any unit
    """

    rates: Array
    spacing: Array
    bias: Array
    before: Array
    after: Array


@dataclass(frozen=True)
class PoissonFit:
    """K (3, 3) of ω_m − b = K ω; covariance (9, 9), undetermined (9,): K row by row; residual (3 n,) rad."""

    K: Array
    covariance: Array
    undetermined: NDArray[np.bool_]
    residual: Array
    freedom: int
    condition: float


def poisson_gyro(turns: Sequence[Turn]) -> PoissonFit:
    """K from turns between rests. Raises ValueError without a turn."""
    if not turns:
        raise ValueError("no turn between two rests")
    S = np.eye(3)
    for _ in range(_STEPS):
        r, J = _linearised(turns, S)
        found = factors(J, _RANK)
        step = found.solve(-r)
        S = S + step.reshape(3, 3)
        if np.abs(step).max() < 1e-9:
            break
    r, J = _linearised(turns, S)
    found = factors(J, _RANK)
    freedom = 2 * len(turns) - found.rank  # a direction has two numbers
    variance = float(r @ r) / freedom if freedom > 0 else np.nan
    covariance = variance * found.to_coefficients @ found.to_coefficients.T
    K = np.asarray(np.linalg.inv(S), dtype=float)
    to = -np.kron(K, K.T)  # dK = −K dS K
    return PoissonFit(
        K, np.asarray(to @ covariance @ to.T), found.undetermined(1e-3), r, freedom, found.condition
    )


def _linearised(turns: Sequence[Turn], S: Array) -> tuple[Array, Array]:
    """Residual (3 n,) and its derivative (3 n, 9) by the entries of S, by central differences."""
    moved = [S]
    for k in range(9):
        for sign in (1.0, -1.0):
            other = S.copy().ravel()
            other[k] += sign * _DELTA
            moved.append(other.reshape(3, 3))
    all_S = np.array(moved)
    after = np.array([_unit(turn.after) for turn in turns])
    r = np.swapaxes(_carried(turns, all_S) - after[:, None], 0, 1).reshape(len(all_S), -1)
    return r[0], ((r[1::2] - r[2::2]) / (2.0 * _DELTA)).T


def carried(turn: Turn, S: Array) -> Array:
    """(3,) gravity's direction after a turn by gyros whose ω = S (ω_m − b)."""
    return np.asarray(_carried([turn], S[None])[0, 0])


def _carried(turns: Sequence[Turn], S: Array) -> Array:
    """(n, s, 3) gravity's direction after each turn, by each of S (s, 3, 3); all turns go on together."""
    angles = np.zeros((max(len(turn.rates) for turn in turns), len(turns), 3))  # a turn that is over rests
    for i, turn in enumerate(turns):
        angles[: len(turn.rates), i] = (turn.rates - turn.bias) * turn.spacing[:, None]
    B = np.repeat([_unit(turn.before) for turn in turns], len(S), axis=0)
    for read in angles:
        B = _turned(B, np.einsum("sij,nj->nsi", S, read).reshape(-1, 3))
    return np.asarray(B.reshape(len(turns), len(S), 3))


def _turned(B: Array, phi: Array) -> Array:
    """exp(−[φ×]) B by Rodrigues, (s, 3) each."""
    size = np.linalg.norm(phi, axis=1, keepdims=True)
    sinc = np.sinc(size / np.pi)
    half = 0.5 * np.sinc(size / (2.0 * np.pi)) ** 2  # (1 − cos φ)/φ²
    once = _cross(phi, B)
    return np.asarray(B - sinc * once + half * _cross(phi, once))


def _cross(a: Array, b: Array) -> Array:
    """a × b, (s, 3) each; np.cross takes five times as long for so few rows."""
    return np.asarray(a[:, [1, 2, 0]] * b[:, [2, 0, 1]] - a[:, [2, 0, 1]] * b[:, [1, 2, 0]])


def _unit(f: Array) -> Array:
    return np.asarray(f / np.linalg.norm(f))
