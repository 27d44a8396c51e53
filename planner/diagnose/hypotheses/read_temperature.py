"""What the thermometer's own noise leaves: a soaked unit keeps its temperature, the readings of it stray.

    y = b(T) + …,  T̃ = T + δ    ⇒    y − b(T̃) = −b′(T̃) δ,    δ ≈ T̃ − mean of the power-on

0.05 K on a bias of 0.8 mg/K are 0.04 mg, the noise of a record; only where the curve is steep, so that it
looks like an effect of temperature. One column with a free coefficient says how much of the straying is
noise: none where the unit's temperature really moved (it then lies on the curve), all where it did not.

A unit that warms itself moves by kelvins on a course that is smooth, and the readings stray about that,

    δ ≈ T̃ − q(t),   q a parabola over the time of each stretch of a power-on that moves by less than JUMP_K

At 600 deg/s on an arm 0.04 K are ten sigma of a record there: a scale factor that goes with the time.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from planner import catalog
from planner.diagnose.hypotheses.channels import LEAST_NODES, ROUNDING, SOAKED_K, Channel, tables
from planner.effects._bench_frame import turning
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.solvers.group_batches import batches_of

JUMP_K = 1.5  # between records, from which the chamber went on to another point
MOVES = 5.0  # times what strays about it, from which a course is one: of noise alone it is twice
LEAST_OF_A_COURSE = 5  # records: a parabola leaves two of them
STILL_K_S = 0.1 / 60.0  # K/s: a chamber that soaks moves less; on a ramp the readings move with the unit


def strays_of(x: Conditions, starts: NDArray[np.int64]) -> tuple[Array, Array]:
    """(n,) K each: how soaked rows stray about the mean of their power-on, and about their course."""
    return (
        straying(x.temperature_degc, x.temperature_rate, starts),
        about_course(x.temperature_degc, x.temperature_rate, x.time_on, starts),
    )


def with_read_temperature(c: Channel, strays: Sequence[Array]) -> Channel:
    """The channel with the columns of the thermometer's noise among those of the declared model."""
    columns = np.column_stack([np.empty((len(c.r), 0)), *_columns(c, strays)])
    return replace(
        c,
        J=np.column_stack([c.J, columns]),
        most=np.concatenate([c.most, np.full(columns.shape[1], np.inf)]),
    )


def _columns(c: Channel, strays: Sequence[Array]) -> Iterator[Array]:
    """(n, 1) at rest and in turns, where another thermometer's place or another soak may hold."""
    if not np.any(strays):
        return
    steep, turns = _steepness(c), turning(c.model.conditions)
    for stray in strays:
        for here in (turns, ~turns):
            if np.any((stray * steep)[here]):
                yield np.where(here, stray * steep, 0.0)[:, None]


def straying(degc: Array, rate: Array, starts: NDArray[np.int64]) -> Array:
    """(n,) K by which a soaked row's reading differs from the mean of its power-on's soaked rows."""
    run = np.repeat(np.arange(len(starts)), np.diff(np.append(starts, len(degc))))
    still = np.abs(rate) <= STILL_K_S
    count = np.bincount(run, still, len(starts))
    mean = np.bincount(run, np.where(still, degc, 0.0), len(starts)) / np.maximum(count, 1.0)
    about = np.where(still, degc - mean[run], 0.0)
    return np.where((np.abs(about) <= SOAKED_K) & (count[run] > 1), about, 0.0)


def about_course(degc: Array, rate: Array, time_on: Array, starts: NDArray[np.int64]) -> Array:
    """(n,) K by which a soaked row's reading differs from the course of those before and after it."""
    run = np.repeat(np.arange(len(starts)), np.diff(np.append(starts, len(degc))))
    soaked = np.flatnonzero(np.abs(rate) <= STILL_K_S)
    goes_on = (np.diff(run[soaked]) == 0) & (np.abs(np.diff(degc[soaked])) <= JUMP_K)
    firsts = np.flatnonzero(np.concatenate([np.ones(min(len(soaked), 1), dtype=bool), ~goes_on]))
    out = np.zeros(len(degc))
    for batch in batches_of(firsts, np.diff(np.append(firsts, len(soaked)))):
        if batch.rows.shape[1] >= LEAST_OF_A_COURSE:
            rows = soaked[batch.rows]
            about = degc[rows] - degc[rows].mean(axis=1, keepdims=True)
            left = _beside_parabolas(time_on[rows], about)
            # a unit that keeps its temperature has its mean
            moves = np.ptp(about - left, axis=1) > MOVES * np.std(left, axis=1)
            out[rows[moves]] = left[moves]
    return out


def _beside_parabolas(time: Array, y: Array) -> Array:
    """(G, m) what parabolas over the times (G, m) of stretches of one length leave of y (G, m)."""
    t = time - time.mean(axis=1, keepdims=True)
    t /= np.maximum(np.abs(t).max(axis=1, keepdims=True), 1.0)
    powers = np.stack([t**2, t, np.ones_like(t)], axis=2)
    length = np.linalg.norm(powers, axis=1, keepdims=True)
    u, s, _ = np.linalg.svd(powers / np.where(length > 0, length, 1.0), full_matrices=False)
    u *= (s > ROUNDING * s[:, :1])[:, None, :]
    left = y[:, :, None]
    for _ in range(2):  # once leaves rounding of the first values
        left = left - u @ (np.swapaxes(u, 1, 2) @ left)
    return np.asarray(left[:, :, 0])


def _steepness(c: Channel) -> Array:
    """(n,) dy/dT of the declared tables, each along a smooth curve through its nodes."""
    from scipy.interpolate import CubicSpline

    t = c.model.conditions.temperature_degc
    total = np.zeros(len(t))
    for (name, term), place in tables(c.model).items():
        if len(place) < LEAST_NODES:
            continue
        effect = catalog.effects()[name]
        index = [x.name for x in effect.terms(c.sensor)].index(term)
        seen = c.driven if effect.group == "scale_factor" else c.model.conditions
        column = effect.regressors(c.sensor, seen)[:, c.axis, index]
        nodes = np.array([c.model.columns()[i].node_degc for i in place])
        order = np.argsort(nodes)
        curve = CubicSpline(nodes[order], c.theta[place][order])
        total += curve(np.clip(t, nodes.min(), nodes.max()), 1) * column
    return total
