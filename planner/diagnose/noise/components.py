"""What the noise of a channel is made of: of each row, drawn by every power-on, and how fine it can be."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from planner.campaign.channel_model import EXCITING
from planner.diagnose.channels.channel import Channel, usual_columns
from planner.diagnose.channels.orthogonal import clear, orthonormal
from planner.measurement import sensed
from planner.nouns.array import Array
from planner.solvers.random_effects import RandomEffects

LEVEL = "run_to_run_bias"  # fixed where power-ons are few
RATE_NOISE, CROSS_NOISE = "rate_noise", "cross_noise"  # of each record
LEANS = "misalignment"  # towards the next axis, and the one after it
IN_RUN = "in_run_bias"  # what moves within power-ons
IN_RUN_SCALE = "in_run_scale_factor"
FEW = 12  # power-ons, fewer of which do not tell each its scale factor
APART = 0.02  # share of a component's length that others must leave, or the rows cannot tell it from them


def random_effects(
    starts: NDArray[np.int64], diagonals: dict[str, Array], slopes: dict[str, Array]
) -> RandomEffects:
    """Of power-ons from `starts`; (n,) variances of rows and columns of what each power-on draws, by name."""
    n = len(next(iter(diagonals.values())))
    stacked = np.array([*slopes.values()]) if slopes else np.empty((0, n))
    return RandomEffects(starts, np.array([*diagonals.values()]), stacked)


def own_of_rows(c: Channel, duration: Array, weights: Array) -> dict[str, Array]:
    """The components of each row's own noise that the rows can tell apart, the most usual first."""
    duration = np.where(duration > 0, duration, 1.0)
    exciting = (EXCITING[c.sensor] * (1.0 if c.sensor == "gyro" else 6.0)) ** 2
    found = {"white": duration.mean() / duration}
    inputs = {RATE_NOISE: c.u**2, CROSS_NOISE: c.across**2}
    other = {name: x for name, x in inputs.items() if x.max(initial=0.0) > exciting}
    if duration.max() > 1.5 * duration.min():
        other["constant"] = np.ones(len(duration))
    for name, x in other.items():
        Q = orthonormal(np.array([*found.values()]).T)
        if np.linalg.norm(clear(Q, x[:, None])) > APART * np.linalg.norm(x):
            found[name] = x
    return {name: x / weights for name, x in found.items()}


def drawn_of_power_ons(c: Channel, drawn: Iterable[str], power_ons: int = FEW) -> dict[str, Array]:
    """(n,) column of what every power-on draws: its level, its scale factor, terms of the effects `drawn`.

    A scale factor multiplies the misaligned input: drawn by 2e-4 where the axes lean by 0.4 deg it is a lean
    of 1.4e-6, which along the own input alone passed for misalignments that every power-on draws. Of a few
    power-ons hardly one tells its scale factor by its own input, beside that of each temperature, and what is
    across would: misalignments of six were a scale factor of 0.5 %, one over the temperature was one of 0.01.
    """
    found = {LEVEL: np.ones(len(c.r))}
    if np.ptp(np.abs(c.u)) > EXCITING[c.sensor]:
        leaned = sensed(c.sensor, c.driven)[:, c.axis]
        found["run_to_run_scale_factor"] = c.u if power_ons < FEW else leaned
    return found | draws(c, drawn)


def draws(c: Channel, effects: Iterable[str]) -> dict[str, Array]:
    """(n,) what each coefficient of some effects adds to a channel, by the name of its spread."""
    return {drawn_name(e, k): x for e in effects for k, x in enumerate(_terms(c, e), 1)}


def drawn_name(effect: str, k: int) -> str:
    """Of the spread from power-on to power-on of an effect's k-th coefficient of a channel."""
    return f"run_to_run_{effect}_{k}"


def of_effect(effect: str, components: Iterable[str]) -> list[str]:
    """The components of a noise that are spreads of an effect's coefficients."""
    return [c for c in components if c.rpartition("_")[0] == f"run_to_run_{effect}"]


def _terms(c: Channel, effect: str) -> list[Array]:
    """(n,) of every coefficient that the channel reads; of misalignments the next axis, the one after it."""
    if effect == LEANS:
        inputs = sensed(c.sensor, c.model.conditions)
        return [inputs[:, (c.axis + k) % 3] for k in (1, 2)]
    return usual_columns(c, effect)


def is_level(z: Array, starts: NDArray[np.int64]) -> bool:
    """Whether a column is one value in every power-on: beside a level of each it is no own variance."""
    sizes = np.diff(np.append(starts, len(z)))
    about = z - np.repeat(np.add.reduceat(z, starts) / sizes, sizes)
    return bool(np.linalg.norm(about) <= APART * np.linalg.norm(z))


def indicators(starts: NDArray[np.int64], n: int) -> Array:
    """(n, g − 1) of the power-ons but the first."""
    sizes = np.diff(np.append(starts, n))
    return np.repeat(np.eye(len(starts))[:, 1:], sizes, axis=0)


def finest(c: Channel) -> float:
    """What a reading cannot be told finer than: the step of its numbers, or rounding.

    Rows of one condition that have hardly any noise all have the same error of it: what they scatter by is no
    noise of theirs.
    """
    steps = np.diff(np.unique(c.y))
    step = float(np.min(steps[steps > 0], initial=np.inf))
    coarse = step if np.isfinite(step) and len(steps) < len(c.y) / 2 else 0.0
    return float(max(coarse / np.sqrt(12.0), 1e-12 * np.abs(c.y).max(initial=0.0)))
