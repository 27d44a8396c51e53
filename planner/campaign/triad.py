"""The three channels of a sensor: each by itself, and together where they have coefficients in common.

A shared coefficient (one Earth, one arm) is estimated once, by the records of all channels that it acts on,
each with its own covariance: y = J θ over the rows of the triad, J block by block but for the shared columns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner import catalog
from planner.campaign.channel_model import channel_model
from planner.campaign.estimate import Estimate, Robust, estimate, solved
from planner.campaign.first_order import FirstOrder, first_order
from planner.campaign.noise import Component, Noise, Slopes
from planner.campaign.power_ons import PowerOns
from planner.campaign.prior import Prior
from planner.measurement import AXES, Column, evaluate
from planner.nouns.array import Array
from planner.protocols import Sensor
from planner.solvers.mixed_model import MixedFit
from planner.solvers.random_effects import RandomEffects
from planner.solvers.reml import Variances
from planner.spec.model import Spec

ALL = (0, 1, 2)
ROUNDS = 3  # products are 1e-2 of an effect


class TooFewRecords(ValueError):
    """The records cannot give the coefficients of a channel."""


def fit_triad(
    sensor: Sensor,
    readings: Array,
    runs: PowerOns,
    spec: Spec,
    effects: Sequence[str],
    robust: Robust = "no",
    channels: Sequence[int] = ALL,
    slopes: Slopes = dict,
) -> list[Estimate]:
    """Estimates of the channels from readings (n, 3). Raises TooFewRecords for too few rows.

    channels: which of them are asked for; those that share a coefficient are fitted all the same, together
    """
    found = []
    for channel in ALL if shares(sensor, effects) else channels:
        model = channel_model(sensor, channel, runs.conditions, effects)
        try:
            found.append(estimate(model, readings[:, channel], runs, spec, robust, slopes=slopes))
        except ValueError as error:
            raise TooFewRecords(
                f"{len(runs)} rows cannot give the {len(model.columns())} coefficients of "
                f"{sensor} {AXES[channel]} ({error})"
            ) from error
    return _together(found, readings) if shares(sensor, effects) else found


def shares(sensor: Sensor, effects: Sequence[str]) -> bool:
    """Whether the channels of a sensor have a coefficient of these effects in common."""
    known = [catalog.effects()[name] for name in effects]
    return any(t.shared for e in known if sensor in e.sensors for t in e.terms(sensor))


# ---------------------------------------------------------------- joint solution


@dataclass(frozen=True)
class _Places:
    """Where the coefficients of every channel stand among those of the triad. places: per channel (p,)."""

    places: tuple[list[int], ...]
    count: int


def _places(found: Sequence[Estimate]) -> _Places:
    """Own coefficients one after the other; a shared one once."""
    shared: dict[Column, int] = {}
    places, count = [], 0
    for e in found:
        mine = []
        for column in e.model.columns():
            common = column in shared or e.model.shares(column)
            if common and column in shared:
                mine.append(shared[column])
                continue
            if common:
                shared[column] = count
            mine.append(count)
            count += 1
        places.append(mine)
    return _Places(tuple(places), count)


def _together(found: list[Estimate], readings: Array) -> list[Estimate]:
    """The same estimates with shared coefficients from all channels, by the covariances that each has."""
    at = _places(found)
    noise, variances = _stacked_noise(found)
    thetas = [e.theta for e in found]
    told = [first_order(e.model) for e in found]
    prior = _stacked_prior([e.prior for e in found])
    for _ in range(ROUNDS):
        J, target = _stacked(found, told, thetas, readings, at)
        fit = solved(target, J, prior, noise, variances)
        thetas = [fit.coefficients[place] for place in at.places]
    return [
        _of_channel(e, theta, fit, place, readings[:, e.model.channel])
        for e, theta, place in zip(found, thetas, at.places, strict=True)
    ]


def _stacked(
    found: Sequence[Estimate],
    told: Sequence[FirstOrder],
    thetas: Sequence[Array],
    readings: Array,
    at: _Places,
) -> tuple[Array, Array]:
    blocks, targets = [], []
    for e, first, theta, place in zip(found, told, thetas, at.places, strict=True):
        parts = evaluate(e.model, theta)
        J = first.slope(e.model, theta, parts)
        wide = np.zeros((len(J), at.count))
        wide[:, place] = J
        blocks.append(wide)
        targets.append(readings[:, e.model.channel] - parts.predicted + J @ theta)
    return np.concatenate(blocks), np.concatenate(targets)


def _stacked_prior(priors: Sequence[Prior]) -> Prior:
    """Each channel's unknowns are its own: what they have in common the shared columns do not rest on."""
    from scipy.linalg import block_diag

    return Prior(
        np.asarray(block_diag(*(p.columns for p in priors))),
        np.concatenate([p.sigma for p in priors]),
        tuple(unknown for p in priors for unknown in p.unknowns),
    )


def _stacked_noise(found: Sequence[Estimate]) -> tuple[Noise, Variances]:
    """V of all rows, channel by channel: every variance is of the rows of its own channel."""
    from scipy.linalg import block_diag

    n = len(found[0].residual)
    kinds: list[tuple[Component, float]] = []
    diagonals: list[Array] = []
    slopes: list[Array] = []
    drifts, order = [], []
    for number, e in enumerate(found):
        rows = slice(number * n, (number + 1) * n)
        effects = e.noise.effects
        a, b = len(effects.diagonals), len(effects.slopes)
        for k, component in enumerate(e.noise.components):
            kinds.append((component, float(e.variances.theta[k])))
            if k < a + b:
                wide = np.zeros(3 * n)
                wide[rows] = effects.diagonals[k] if k < a else effects.slopes[k - a]
                (diagonals if k < a else slopes).append(wide)
                order.append((0 if k < a else 1, len(kinds) - 1))
            else:
                drift = effects.drifts[k - a - b]
                z, time = np.zeros(3 * n), np.zeros(3 * n)
                z[rows], time[rows] = drift.z, drift.time
                drifts.append(replace(drift, z=z, time=time))
                order.append((2, len(kinds) - 1))
    ordered = [place for _, place in sorted(order)]
    starts = np.concatenate([e.noise.effects.starts + i * n for i, e in enumerate(found)])
    effects = RandomEffects(
        starts, np.array(diagonals), np.array(slopes) if slopes else np.empty((0, 3 * n)), tuple(drifts)
    )
    error = np.asarray(block_diag(*(e.variances.error for e in found)))[np.ix_(ordered, ordered)]
    theta = np.array([kinds[i][1] for i in ordered])
    noise = Noise(tuple(kinds[i][0] for i in ordered), effects, found[0].noise.duration)
    return noise, Variances(theta, error, theta > 0, float("nan"), True)


def _of_channel(e: Estimate, theta: Array, fit: MixedFit, place: list[int], y: Array) -> Estimate:
    i, n = e.model.channel, len(y)
    mine = replace(
        fit,
        coefficients=theta,
        covariance=fit.covariance[np.ix_(place, place)],
        freedom=fit.freedom[place],
        undetermined=fit.undetermined[place],
        whitened=fit.whitened[i * n : (i + 1) * n],
        variances=e.variances,
    )
    return replace(e, theta=theta, fit=mine, residual=y - evaluate(e.model, theta).predicted)
