"""Gravity that goes round a unit which turns about a level axis: what the mean force of a record leaves out.

    f(φ) = f_a a + ρ (c cos φ + a × c sin φ),   ρ² = g² − f_a²,   φ = −θ/2 … θ/2,   θ = |ω| T

Its mean across the axis a is ρ sin(θ/2) / (θ/2), nothing after whole turns; those of |f|, f² and f³ are not
the modulus, the square and the cube of the mean: at every instant |f| is g, and the mean of f nothing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.physics.attitude import cross, unit

Array = NDArray[np.float64]

TURNING = float(np.radians(1.0))  # rad/s: above it a record is of a turn, far above the Earth's rate
SHORT = 0.01  # of g, that a mean lacks: local gravities differ by 0.7 %, an axis 8 deg off upright lacks that
NEAR = 0.2  # of g, within which the reference of a rest is gravity
INSTANTS = 24  # through a record: the mean of a modulus is then off by 3e-3 of itself
AS_TOLD = 0.02  # of ρ, within which rate and duration give the mean that the reference has
NEAR_ARC = 0.5  # rad, within which an arc is the one that rate and duration give
FEW_TURNS = 8.0 * np.pi  # beyond which what is over the whole turns changes no mean square by 4 %
STEPS = 30  # of Newton's method, which has arrived after six but near a whole turn's extremum
DIFFERENCE = 1e-5  # rad
MET = 1e-9  # of ρ


def swing(rate: Array, force: Array, duration: Array, standard: float) -> Array | None:
    """(n, INSTANTS, 3) m/s², the force at instants spread evenly through each record, less its mean.

    rate, force: (n, 3) means in body axes; duration: (n,) s; standard: m/s², of gravity where none rests.
    None where no record's force goes round.
    Where rate and duration do not give the mean across the axis, or after more than four turns, the arc is
    the shortest that has it.
    """
    turns = np.linalg.norm(rate, axis=1) > TURNING
    g = _gravity(np.linalg.norm(force[~turns], axis=1), standard)
    rows = np.flatnonzero(turns & (np.linalg.norm(force, axis=1) < (1.0 - SHORT) * g))
    if g == 0.0 or len(rows) == 0:
        return None
    a = unit(rate[rows])
    along = np.sum(a * force[rows], axis=1, keepdims=True)
    mean = force[rows] - along * a
    radius = np.sqrt(g**2 - along**2)
    turned = np.linalg.norm(rate[rows], axis=1) * duration[rows]
    arc, sense = _arc(turned, np.linalg.norm(mean, axis=1) / radius[:, 0])
    c = sense[:, None] * _middle(a, mean, radius)
    phi = arc[:, None] * ((np.arange(INSTANTS) + 0.5) / INSTANTS - 0.5)
    round_ = np.cos(phi)[..., None] * c[:, None] + np.sin(phi)[..., None] * cross(a, c)[:, None]
    found = np.zeros((len(rate), INSTANTS, 3))
    found[rows] = radius[..., None] * (round_ - round_.mean(axis=1, keepdims=True))
    return found


def _gravity(size: Array, standard: float) -> float:
    """m/s², the median of the rests' reference; 0 where there is none of about that size."""
    if len(size) == 0:
        return standard
    near = size[np.abs(size / standard - 1.0) < NEAR]
    return float(np.median(near)) if len(near) else 0.0


def _arc(turned: Array, share: Array) -> tuple[Array, Array]:
    """(n,) rad that the force goes round; (n,) ±1 by which its middle is on the side of the mean.

    turned: (n,) rad by rate and duration; share: (n,) size of the mean across the axis, of ρ. That is met to
    its last digit, so that |f| is g at every instant: what it lacked would follow the mean's square.
    """
    told = np.sinc(turned / (2.0 * np.pi))
    few = (np.abs(np.abs(told) - share) < AS_TOLD) & (turned < FEW_TURNS)
    near, met = _with_mean(turned, np.sign(told) * share)
    few &= met & (np.abs(near - turned) < NEAR_ARC)
    half = np.linspace(np.pi, 0.0, 400)
    shortest, _ = _with_mean(2.0 * np.interp(share, np.sinc(half / np.pi), half), share)
    return np.where(few, near, shortest), np.where(few & (told < 0.0), -1.0, 1.0)


def _with_mean(arc: Array, share: Array) -> tuple[Array, NDArray[np.bool_]]:
    """(n,) rad, near some arcs, of which the instants' mean is a share of the radius, and whether it is."""

    def mean(x: Array) -> Array:
        return np.asarray(_dirichlet(x) - share)

    for _ in range(STEPS):
        slope = (_dirichlet(arc + DIFFERENCE) - _dirichlet(arc - DIFFERENCE)) / (2.0 * DIFFERENCE)
        safe = np.where(np.abs(slope) > DIFFERENCE, slope, np.inf)
        arc = np.clip(arc - np.clip(mean(arc) / safe, -0.2, 0.2), 0.0, FEW_TURNS)
    return arc, np.abs(mean(arc)) < MET


def _dirichlet(arc: Array) -> Array:
    """Mean of cos φ over INSTANTS spread evenly through an arc: sin(θ/2) / (K sin(θ/2K))."""
    below = INSTANTS * np.sin(arc / (2.0 * INSTANTS))
    return np.asarray(np.divide(np.sin(arc / 2.0), below, out=np.ones_like(arc), where=below > 0.0))


def _middle(a: Array, mean: Array, radius: Array) -> Array:
    """(n, 3) unit vectors across a: along the mean, else, after whole turns, any."""
    other = np.eye(3)[np.argmin(np.abs(a), axis=1)]
    anyhow = unit(other - np.sum(other * a, axis=1, keepdims=True) * a)
    size = np.linalg.norm(mean, axis=1, keepdims=True)
    return np.where(size > 1e-6 * radius, mean / np.maximum(size, 1e-300), anyhow)
