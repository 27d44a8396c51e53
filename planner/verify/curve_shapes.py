"""Shapes of a curve over temperature before its size: what a table of residuals leaves open.

x runs from 0 to 1 over the range. Each shape is a way to draw curves, and the rows r whose sum of r rᵀ is
their second moment, from which follows what N points leave of them in the mean.

    cosines   Σ a_m cos(mπx + φ_m),   φ_m ~ U(0, 2π); the a_m are found for each table
    kink      a (x − ½)² + b |x − k|,   a, b ~ N(0, 1), k ~ U(0, 1)
    cubic     a z + b z² + c z³,   z = 2x − 1,   a, b, c ~ N(0, 1)
    matern    E f f' = (1 + √3 d/l) exp(−√3 d/l),   l = ½, drawn step by step along x

The last is the Markov process of (f, f') with f'' = −λ² f − 2λ f' + white noise, λ = √3/l (Hartikainen and
Särkkä, MLSP 2010).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from planner.nouns.array import Array

POINTS = 481
MODES = 40
LENGTH = 0.5  # l of matern
LEAST = 0.5**31
SHAPES = ("cosines", "kink", "cubic", "matern")


def position() -> Array:
    """(POINTS,) x of a curve's grid."""
    return np.linspace(0.0, 1.0, POINTS)


def angles(x: Array) -> Array:
    """(MODES, k) mπx of the modes 1 … MODES at x (k,)."""
    return np.asarray(np.pi * np.arange(1, MODES + 1)[:, None] * x)


def cosines(count: int, rng: np.random.Generator, amplitude: Array) -> Array:
    """(count, POINTS) sums of the modes 1 … MODES of amplitudes (MODES,)."""
    phase = rng.uniform(0.0, 2.0 * np.pi, size=(count, MODES))
    angle = angles(position())
    return np.asarray(
        (amplitude * np.cos(phase)) @ np.cos(angle) - (amplitude * np.sin(phase)) @ np.sin(angle)
    )


def _kink(count: int, rng: np.random.Generator) -> Array:
    a, b = rng.normal(size=(2, count))
    return _kinked(a, b, rng.uniform(size=count))


def _kinked(a: Array, b: Array, k: Array) -> Array:
    x = position()
    return np.asarray(a[:, None] * (x - 0.5) ** 2 + b[:, None] * np.abs(x - k[:, None]))


def _kink_rows() -> Array:
    x = position()
    k = (np.arange(POINTS) + 0.5) / POINTS
    return np.vstack([(x - 0.5) ** 2, np.abs(x - k[:, None]) / np.sqrt(POINTS)])


def _powers() -> Array:
    z = 2.0 * position() - 1.0
    return np.stack([z, z**2, z**3])


def _cubic(count: int, rng: np.random.Generator) -> Array:
    return np.asarray(rng.normal(size=(count, 3)) @ _powers())


def _matern(count: int, rng: np.random.Generator) -> Array:
    keep, root, decay = _matern_step()
    state = rng.normal(size=(count, 2)).T * [[1.0], [decay]]
    found = np.empty((POINTS, count))
    for i in range(POINTS):
        found[i] = state[0]
        state = keep @ state + root @ rng.normal(size=(count, 2)).T
    return np.ascontiguousarray(found.T)


def _matern_step() -> tuple[Array, Array, float]:
    """A (2, 2) and the root of Q = P − A P Aᵀ of one step of x, P = diag(1, λ²); λ."""
    decay, d = float(np.sqrt(3.0)) / LENGTH, 1.0 / (POINTS - 1)
    keep = np.exp(-decay * d) * np.array([[1.0 + decay * d, d], [-(decay**2) * d, 1.0 - decay * d]])
    P = np.diag([1.0, decay**2])
    return keep, np.linalg.cholesky(P - keep @ P @ keep.T), decay


def _matern_rows() -> Array:
    apart = np.abs(np.subtract.outer(position(), position())) * np.sqrt(3.0) / LENGTH
    value, vector = np.linalg.eigh((1.0 + apart) * np.exp(-apart))
    return np.asarray(np.sqrt(np.maximum(value, 0.0))[:, None] * vector.T)


def evenly(shape: str, count: int, rng: np.random.Generator) -> Array:
    """(count, POINTS) of a kink or a cubic, evenly over their law: a scrambled net of its three numbers.

    A mean over 20 000 of them scatters a third as much as over as many draws (Owen, Scrambled net variance
    for integrals of smooth functions, 1997).
    """
    from scipy.special import ndtri
    from scipy.stats.qmc import Sobol

    u = Sobol(3, seed=rng).random_base2(int(np.ceil(np.log2(count))))[:count]
    z = ndtri(np.clip(u, LEAST, 1.0 - LEAST))
    return np.asarray(z @ _powers()) if shape == "cubic" else _kinked(z[:, 0], z[:, 1], u[:, 2])


FEW = ("kink", "cubic")  # numbers that a curve is made of
DRAWN: Mapping[str, Callable[[int, np.random.Generator], Array]] = {
    "kink": _kink,
    "cubic": _cubic,
    "matern": _matern,
}
ROWS: Mapping[str, Callable[[], Array]] = {"kink": _kink_rows, "cubic": _powers, "matern": _matern_rows}
