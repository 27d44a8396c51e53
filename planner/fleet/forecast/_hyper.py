"""How a type of unit drifts in store: sizes of walk, ageing, season and noise, learned from all series
together.

    y_i = α_i + r t_i/60 d + a sin + b cos + n_i,   α a random walk of q in 60 days,
    r ~ N(0, s²),   a, b ~ N(0, c²),   n_i ~ N(0, v² w_i)

all in units of the spec's storage, which is the prior: ln q, ln s, ln c, ln v are normal about it, so what
the spec says counts where the data are silent and fades as they speak. Units of one type are alike, not the
same: ln q and ln v of a series are normal about the type's with a spread that is learned, too. Everything is
summed on a grid (coarse, then fine where the posterior is); the likelihood of a series is a closed form of
what the filter left (`solvers.local_level`), with α_0 unknown:

    −2 log p = Σ log F + e² − m'M⁻¹m + log |M| − log |Λ|,    M = E'E + Λ,  m = E'e,  Λ = diag(s, c, c)⁻²
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from planner.fleet.forecast._states import COLUMNS, columns_at
from planner.nouns.array import Array
from planner.solvers.local_level import Filtered, filtered

WALK, AGE, SEASON, NOISE = range(4)
# median and spread of log2 of the sizes, in storages: together they move a unit by about one in 60 days
MIDDLE = np.array([-1.0, -1.5, -2.3, -2.5])
SPREAD = np.array([1.2, 2.0, 1.6, 1.6])
STATED_MIDDLE, STATED_SPREAD = 0.0, 0.5  # of a stated uncertainty: log2 of the factor to the true one
SPREADS = np.array([0.0, 0.3, 0.6, 1.0])  # of log2 q and log2 v from unit to unit
COARSE, FINE = (9, 9, 7, 7), (9, 9, 7, 7)
REACH = 3.0  # of the grid, in sigmas of the prior, then of the posterior
LEAST_REACH = 0.25  # octaves
ATOMS = 64


@dataclass(frozen=True)
class Fleet:
    """Series of one kind in units of the storage, padded. day, value, weight: (U, n); used, fresh: (U, n)
    flags

    stated: whether the noise is a factor on stated uncertainties (weight their squares), else a size of its
    own
    """

    day: Array
    value: Array
    weight: Array
    used: NDArray[np.bool_]
    fresh: NDArray[np.bool_]
    stated: bool

    @cached_property
    def columns(self) -> Array:
        """(U, n, 1+p) the values and what goes on steadily."""
        return np.concatenate([self.value[..., None], columns_at(self.day)], axis=2)

    @property
    def middle(self) -> Array:
        """(4,) median of log2 of the sizes."""
        return np.append(MIDDLE[:3], STATED_MIDDLE if self.stated else MIDDLE[3])

    @property
    def spread(self) -> Array:
        """(4,) spread of log2 of the sizes."""
        return np.append(SPREAD[:3], STATED_SPREAD if self.stated else SPREAD[3])


@dataclass(frozen=True)
class Grid:
    """log2 of the sizes: one axis each for walk, ageing, season, noise."""

    axes: tuple[Array, Array, Array, Array]

    @property
    def shape(self) -> tuple[int, ...]:
        """Points of every axis."""
        return tuple(len(a) for a in self.axes)

    def kernel(self, axis: int, spread: float) -> Array:
        """(θ, g) how a unit's size is spread about the type's."""
        x = self.axes[axis]
        if spread == 0 or len(x) == 1:
            return np.eye(len(x))
        k = np.exp(-0.5 * ((x[:, None] - x[None, :]) / spread) ** 2)
        return np.asarray(k / k.sum(axis=1, keepdims=True))


def grid_about(middle: Array, spread: Array, shape: Sequence[int]) -> Grid:
    """Points evenly over the reach about the middle."""
    reach = np.maximum(REACH * spread, LEAST_REACH)
    axes = [np.linspace(m - r, m + r, n) for m, r, n in zip(middle, reach, shape, strict=True)]
    return Grid((axes[0], axes[1], axes[2], axes[3]))


@dataclass(frozen=True)
class Learned:
    """Posterior of a type on its grid. likelihood: (U, *grid) of every series, largest 1

    weight: (spreads, *grid) of the type's sizes and of the spread between units
    """

    grid: Grid
    likelihood: Array
    weight: Array
    left: Filtered

    def sizes(self) -> tuple[Array, Array]:
        """(4,) mean and spread of log2 of the units' sizes."""
        units = sum(_spread_out(self.grid, self.weight[i], s) for i, s in enumerate(SPREADS))
        mean, deviation = np.empty(4), np.empty(4)
        for axis, x in enumerate(self.grid.axes):
            w = np.asarray(units).sum(axis=tuple(a for a in range(4) if a != axis))
            mean[axis] = w @ x / w.sum()
            deviation[axis] = np.sqrt(w @ (x - mean[axis]) ** 2 / w.sum())
        return mean, deviation

    def drawn(self, rng: np.random.Generator, count: int) -> NDArray[np.intp]:
        """(U, count, 4) places on the grid: draw k is of one draw of the type for all series."""
        flat = self.weight.ravel() / self.weight.sum()
        points = (rng.random() + np.arange(count)) / count
        chosen = np.minimum(np.searchsorted(np.cumsum(flat), points), flat.size - 1)
        rng.shuffle(chosen)
        spread, *place = np.unravel_index(chosen, self.weight.shape)
        found = np.empty((len(self.likelihood), count, 4), dtype=np.intp)
        for k in range(count):
            found[:, k] = [p[k] for p in place]
            if SPREADS[spread[k]] > 0:
                found[:, k, WALK], found[:, k, NOISE] = self._own(
                    SPREADS[spread[k]], [int(p[k]) for p in place], rng
                )
        return found

    def _own(
        self, spread: float, place: Sequence[int], rng: np.random.Generator
    ) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """(U,) walk and noise of the series themselves, given the type's."""
        near = [self.grid.kernel(axis, spread)[place[axis]] for axis in (WALK, NOISE)]
        w = self.likelihood[:, :, place[AGE], place[SEASON], :] * np.outer(*near)
        flat = np.cumsum(w.reshape(len(w), -1), axis=1)
        at = (flat < rng.random((len(w), 1)) * flat[:, -1:]).sum(axis=1)
        q, v = np.unravel_index(np.minimum(at, flat.shape[1] - 1), w.shape[1:])
        return q, v


def learned(fleet: Fleet) -> Learned:
    """The type's sizes: a coarse grid over the prior, then a fine one where the posterior is."""
    first = _on_grid(fleet, grid_about(fleet.middle, fleet.spread, COARSE))
    middle, spread = first.sizes()
    step = np.array([x[1] - x[0] for x in first.grid.axes])
    second = _on_grid(fleet, grid_about(middle, np.maximum(spread, step / REACH), FINE))
    middle, spread = second.sizes()
    return _on_grid(fleet, grid_about(middle, spread, FINE))


def _on_grid(fleet: Fleet, grid: Grid) -> Learned:
    q, v = (2.0 ** grid.axes[a] for a in (WALK, NOISE))
    walk = np.repeat(q**2 / 60.0, len(v))
    noise = np.tile(v**2, len(q))
    left = filtered(
        fleet.day,
        fleet.columns,
        fleet.weight[:, None, :] * noise[None, :, None],
        fleet.used,
        fleet.fresh,
        walk,
    )
    log = _log_likelihood(left, grid)
    log -= log.max(axis=(1, 2, 3, 4), keepdims=True)
    likelihood = np.exp(log)
    prior = sum(
        (-0.5 * ((x - m) / s) ** 2).reshape([-1 if a == axis else 1 for a in range(4)])
        for axis, (x, m, s) in enumerate(zip(grid.axes, fleet.middle, fleet.spread, strict=True))
    )
    weight = np.stack([_type_log(likelihood, grid, s) + np.asarray(prior) for s in SPREADS])
    return Learned(grid, likelihood, np.exp(weight - weight.max()), left)


def _type_log(likelihood: Array, grid: Grid, spread: float) -> Array:
    """(*grid) log likelihood of all series, given the type's sizes."""
    blurred = likelihood
    if spread > 0:
        blurred = np.einsum("Qq,uqacv->uQacv", grid.kernel(WALK, spread), blurred)
        blurred = np.einsum("Vv,uqacv->uqacV", grid.kernel(NOISE, spread), blurred)
    return np.asarray(np.log(np.maximum(blurred, 1e-300)).sum(axis=0))


def _spread_out(grid: Grid, weight: Array, spread: float) -> Array:
    """(*grid) where units of a type are whose own place has these weights."""
    if spread == 0:
        return weight
    found = np.einsum("Qq,Qacv->qacv", grid.kernel(WALK, spread), weight)
    return np.asarray(np.einsum("Vv,qacV->qacv", grid.kernel(NOISE, spread), found))


def _log_likelihood(left: Filtered, grid: Grid) -> Array:
    """(U, *grid)"""
    nq, _, _, nv = grid.shape
    U = len(left.count)
    age, season = (4.0 ** -grid.axes[a] for a in (AGE, SEASON))
    G = left.gram.reshape(U, nq, 1, 1, nv, 1 + COLUMNS, 1 + COLUMNS)
    extra = [
        age[None, None, :, None, None],
        season[None, None, None, :, None],
        season[None, None, None, :, None],
    ]
    quadratic, log_det = _explained(G, extra)
    prior = np.log(age)[None, None, :, None, None] + 2 * np.log(season)[None, None, None, :, None]
    log_f = left.log_f.reshape(U, nq, 1, 1, nv)
    return np.asarray(-0.5 * (log_f + G[..., 0, 0] - quadratic + log_det - prior))


def _explained(G: Array, extra: Sequence[Array]) -> tuple[Array, Array]:
    """m'M⁻¹m and log |M| by a Cholesky factor written out: three columns, a million points."""
    a, b, c = (G[..., i, i] + extra[i - 1] for i in (1, 2, 3))
    d, e, f = G[..., 2, 1], G[..., 3, 1], G[..., 3, 2]
    l11 = np.sqrt(a)
    l21, l31 = d / l11, e / l11
    l22 = np.sqrt(b - l21**2)
    l32 = (f - l31 * l21) / l22
    l33 = np.sqrt(c - l31**2 - l32**2)
    y1 = G[..., 1, 0] / l11
    y2 = (G[..., 2, 0] - l21 * y1) / l22
    y3 = (G[..., 3, 0] - l31 * y1 - l32 * y2) / l33
    return y1**2 + y2**2 + y3**2, 2 * (np.log(l11) + np.log(l22) + np.log(l33))
